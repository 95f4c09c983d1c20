// request_shapes: framing that proxies and servers read differently, foreign hosts and origins, sizes and deadlines: refused
// by the gate before any handler runs, with the connection closed.
import assert from 'node:assert/strict';
import net from 'node:net';
import test from 'node:test';
import { sendRaw } from './harness/http.mjs';
import { startServer } from './harness/server.mjs';
import { within } from './harness/wait.mjs';

const body = JSON.stringify({ preset: 'paper', until: { cells: 5 } });
const chunked = `${body.length.toString(16)}\r\n${body}\r\n0\r\n\r\n`;
const post = (headers, payload) => ['POST /v1/jobs HTTP/1.1', ...headers, 'Content-Type: application/json', '', payload].join('\r\n');
const get = (target, headers, version = 'HTTP/1.1') => [`GET ${target} ${version}`, ...headers, '', ''].join('\r\n');
const host = 'Host: 127.0.0.1';
const length = `Content-Length: ${body.length}`;

/** [what, bytes, statuses]: each is answered at most once, and then the connection is closed. */
const shapes = [
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

test('request shapes', async (t) => {
  const server = await startServer(t);
  const before = await server.counts();
  // The header's deadline is checked on the side, while the rest runs: a header that never ends is cut.
  const dripping = sendRaw(server.port, `GET /healthz HTTP/1.1\r\n${host}\r\nX-Slow: `);
  const lazyBody = sendRaw(server.port, post([host, length], body.slice(0, 10)));

  for (const [what, bytes, statuses] of shapes) {
    await t.test(what, async () => {
      // Something well-formed follows at once: a second answer would mean that the first was framed wrongly.
      const { responses, closed } = await sendRaw(server.port, Buffer.from(`${bytes}${get('/healthz', [host])}`, 'latin1'));
      assert.ok(closed);
      assert.equal(responses.length, 1, `answers: ${responses.map(({ status }) => status)}`);
      assert.ok(statuses.includes(responses[0].status), `${responses[0].status}: ${responses[0].text}`);
      server.contract.checkProblem(responses[0], what);
      assert.deepEqual(await server.counts(), before);
    });
  }

  await t.test('an absolute target of an allowed host, localhost, and its own Origin are served', async () => {
    for (const request of [get(`http://127.0.0.1:${server.port}/healthz`, [`Host: 127.0.0.1:${server.port}`, 'Connection: close']),
      get('/healthz', [`Host: localhost:${server.port}`, 'Connection: close']),
      get('/healthz', [host, `Origin: http://127.0.0.1:${server.port}`, 'Connection: close'])]) {
      const { responses, closed } = await sendRaw(server.port, request);
      assert.deepEqual([responses.map(({ status }) => status), closed], [[200], true], request);
    }
  });

  await t.test('requests on one connection are answered in order', async () => {
    const { responses } = await sendRaw(server.port, get('/healthz', [host]) + get('/v1/jobs/counts', [host]) + get('/v1/made-up', [host]), { count: 3 });
    assert.deepEqual(responses.map(({ status }) => status), [200, 200, 404]);
    assert.deepEqual(responses[1].json, before);
  });

  await t.test('a chunked body is read', async () => {
    const { responses } = await sendRaw(server.port, post([host, 'Transfer-Encoding: chunked'], chunked).replace('/v1/jobs', '/v1/jobs?dry_run=true'), { count: 1 });
    assert.equal(responses[0].status, 200, responses[0].text);
  });

  await t.test('Expect: 100-continue does not hang', async () => {
    const request = post([host, length, 'Expect: 100-continue', 'Connection: close'], body).replace('/v1/jobs', '/v1/jobs?dry_run=true');
    const { responses } = await sendRaw(server.port, request);
    assert.ok([200, 417].includes(responses.at(-1).status), responses.at(-1).text);
  });

  await t.test('a header and a body that never end are cut off', async () => {
    for (const slow of [await dripping, await lazyBody]) {
      assert.ok(slow.closed);
      assert.deepEqual(slow.responses.map(({ status }) => status).filter((status) => status !== 408), [], '408 or nothing');
    }
    assert.deepEqual(await server.counts(), before);
  });

  await t.test('clients that go away in the middle do no harm', async () => {
    for (const bytes of ['', 'GET', 'GET /healthz HTTP/1.1\r\n', post([host, length], body.slice(0, 5)), get('/v1/jobs', [host])]) {
      await within(10_000, new Promise((done) => {
        const socket = net.connect(server.port, '127.0.0.1', () => socket.write(bytes || ' ', () => socket.resetAndDestroy()));
        socket.on('error', () => {});
        socket.on('close', done);
      }), 'a client to go away');
    }
    assert.deepEqual(await server.counts(), before);
  });
});
