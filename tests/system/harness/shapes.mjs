// shapes: requests that proxies and servers read differently, for one server or for one behind a proxy under a base path.

/** Ways to write raw requests. `fields`: lines that every request has, e.g. a token. */
export function maker({ base = '', fields = [] } = {}) {
  const body = JSON.stringify({ preset: 'paper', until: { cells: 5 } });
  return {
    base,
    body,
    chunked: `${body.length.toString(16)}\r\n${body}\r\n0\r\n\r\n`,
    host: 'Host: 127.0.0.1',
    length: `Content-Length: ${body.length}`,
    post: (headers, payload, target = '/v1/jobs') => [`POST ${base}${target} HTTP/1.1`, ...fields, ...headers, 'Content-Type: application/json', '', payload].join('\r\n'),
    get: (target, headers, version = 'HTTP/1.1') => [`GET ${target.startsWith('/') ? base : ''}${target} ${version}`, ...fields, ...headers, '', ''].join('\r\n'),
  };
}

/** [what, bytes, statuses]: each is answered at most once, and then the connection is closed. */
export function requestShapes(place) {
  const { post, get, host, length, body, chunked } = maker(place);
  return [
    ['a Transfer-Encoding other than chunked', post([host, 'Transfer-Encoding: gzip, chunked'], chunked), [400]],
    ['a Transfer-Encoding of identity', post([host, 'Transfer-Encoding: identity', length], body), [400]],
    ['a Transfer-Encoding spelled with a blank', post([host, 'Transfer-Encoding: chunked , '], chunked), [400]],
    ['an obscure Transfer-Encoding', post([host, 'Transfer-Encoding: xchunked'], chunked), [400]],
    ['chunked on HTTP/1.0', post([host, 'Transfer-Encoding: chunked'], chunked).replace('HTTP/1.1', 'HTTP/1.0'), [400]],
    ['Transfer-Encoding with Content-Length', post([host, 'Transfer-Encoding: chunked', length], chunked), [400]],
    ['two Transfer-Encodings', post([host, 'Transfer-Encoding: chunked', 'Transfer-Encoding: chunked'], chunked), [400]],
    ['two equal Content-Lengths', post([host, length, length], body), [400]],
    ['two unequal Content-Lengths', post([host, length, 'Content-Length: 0'], body), [400]],
    ['a comma in Content-Length', post([host, `${length}, ${body.length}`], body), [400]],
    ['a signed Content-Length', post([host, `Content-Length: +${body.length}`], body), [400]],
    ['a hexadecimal Content-Length', post([host, 'Content-Length: 0x10'], body), [400]],
    ['a Content-Length beyond 64 bits', post([host, 'Content-Length: 99999999999999999999999'], body), [400, 413]],
    ['no Host', get('/healthz', ['Accept: */*']), [400]],
    ['two Hosts', get('/healthz', [host, host]), [400]],
    ['a folded header', get('/healthz', [host, 'X-Note: one\r\n two']), [400]],
    ['a blank before the colon', get('/healthz', [host, 'X-Note : one']), [400]],
    ['a header without a name', get('/healthz', [host, ': nothing']), [400]],
    ['oversized chunk extensions', post([host, 'Transfer-Encoding: chunked'], `${body.length.toString(16)};${'x'.repeat(20_000)}\r\n${body}\r\n0\r\n\r\n`), [400]],
    ['a chunk size that is none', post([host, 'Transfer-Encoding: chunked'], `zz\r\n${body}\r\n0\r\n\r\n`), [400]],
    ['an absolute target of a foreign authority', get('http://evil.example/healthz', [host]), [400, 421]],
    ['an authority target', 'CONNECT 127.0.0.1:80 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n', [400, 405, 501]],
    ['a target without a slash', get('healthz', [host]), [400]],
    ['a target with a control character', get('/health\x01z', [host]), [400]],
    ['a broken percent escape', get('/v1/jobs/%zz', [host]), [400, 404]],
    ['a percent-coded NUL', get('/v1/jobs/%00', [host]), [400, 404]],
    ['no HTTP at all', 'hello there\r\n\r\n', [400]],
    ['another protocol version', get('/healthz', [host], 'HTTP/2.0'), [400, 505]],
    ['a foreign Host', get('/v1/jobs', ['Host: evil.example']), [403, 421]],
    ['a Host that only begins well', get('/v1/jobs', ['Host: 127.0.0.1.evil.example']), [400, 403, 421]],
    ['a Host with a user', get('/v1/jobs', ['Host: 127.0.0.1@evil.example']), [400, 403, 421]],
    ['a foreign Origin', post([host, length, 'Origin: http://evil.example'], body), [403]],
    ['an Origin of null', post([host, length, 'Origin: null'], body), [403]],
    ['a header of 9 kB', get('/healthz', [host, `X-Note: ${'x'.repeat(9000)}`]), [431]],
    ['very many headers', get('/healthz', [host, ...Array.from({ length: 2000 }, (_, i) => `X-${i}: 1`)]), [431]],
    ['a target of 9 kB', get(`/v1/jobs?name=${'x'.repeat(9000)}`, [host]), [414, 431]],
    ['a body of 2 MB', post([host, 'Content-Length: 2000000'], ' '.repeat(2_000_000)), [413]],
    ['a chunked body of 2 MB', post([host, 'Transfer-Encoding: chunked'], `${(2_000_000).toString(16)}\r\n${' '.repeat(2_000_000)}\r\n0\r\n\r\n`), [413]],
    ['a body announced as 2 GB', post([host, 'Content-Length: 2000000000'], ''), [413]],
  ];
}
