// hostile: what those send who have no business here, and what each got: directly, and through a real proxy.
// Promise: no answer is a 5xx but those that are meant (a cap, a method or version that is not spoken), nothing is carried out that
//          should not be, and the server is well afterwards.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { sendRaw } from './harness/http.mjs';
import { small } from './harness/jobs.mjs';
import { startNginx } from './harness/nginx.mjs';
import { createToken, full, startServer, temporaryFolder, top } from './harness/server.mjs';
import { maker, requestShapes } from './harness/shapes.mjs';
import { within } from './harness/wait.mjs';

const base = '/colony';
const meant = new Set([501, 503, 505]);
const table = [];
const record = (way, what, got) => table.push([way, what, got]);

/** What a smuggler would have carried out. */
const smuggled = `GET ${base}/v1/smuggled HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n`;

/** [what, bytes, statuses], beyond the shapes: tokens, paths, queries, bodies, addresses. */
function attacks({ reader, submitter, unknown, cut, foreign }) {
  const anyone = maker({ base });
  const as = (token) => maker({ base, fields: [`Authorization: Bearer ${token}`] });
  const { host } = anyone;
  const { post, get } = as(submitter);
  const length = (payload) => `Content-Length: ${Buffer.byteLength(payload)}`;
  const sent = (payload, target) => post([host, length(payload)], payload, target);
  const smuggle = `0\r\n\r\n${smuggled}`;
  return [
    ['no token', anyone.get('/v1/jobs', [host]), [401]],
    ['no token, a body of 1 MB', anyone.post([host, 'Content-Length: 1000000'], 'x'.repeat(1000)), [401]],
    ['an unknown token', as(unknown).get('/v1/jobs', [host]), [401]],
    ['a token cut short', as(cut).get('/v1/jobs', [host]), [401]],
    ['a token with a byte more', as(`${submitter}0`).get('/v1/jobs', [host]), [401]],
    ['a token of 7 kB', as('a'.repeat(7000)).get('/v1/jobs', [host]), [401]],
    ['a token in upper case', as(submitter.toUpperCase()).get('/v1/jobs', [host]), [401]],
    ['a JSON web token without a signature', as('eyJhbGciOiJub25lIn0.eyJzY29wZSI6ImFkbWluIn0.').get('/v1/jobs', [host]), [401]],
    ['Basic instead of Bearer', anyone.get('/v1/jobs', [host, `Authorization: Basic ${Buffer.from(`a:${submitter}`).toString('base64')}`]), [401]],
    ['two Authorizations', get('/v1/jobs', [host, `Authorization: Bearer ${unknown}`]), [400]],
    ['a token in the query', anyone.get(`/v1/jobs?access_token=${submitter}`, [host]), [401]],
    ['a token in a cookie', anyone.get('/v1/jobs', [host, `Cookie: token=${submitter}`]), [401]],
    ['read tries to submit', as(reader).post([host, length('{}')], '{}'), [403]],
    ['read tries to delete', as(reader).get('/v1/jobs/x', [host]).replace('GET', 'DELETE'), [403]],
    ['submit tries to make a token', sent('{"name":"x","scope":"admin","expires_h":1}', '/v1/tokens'), [403]],
    ['submit lists tokens', get('/v1/tokens', [host]), [403]],
    ['a method override', get('/v1/jobs/x', [host, 'X-HTTP-Method-Override: DELETE']), [404]],
    ['HEAD where admin is needed', get('/v1/tokens', [host]).replace('GET', 'HEAD'), [403]],
    ['TRACE', get('/healthz', [host]).replace('GET', 'TRACE'), [501]],
    ['OPTIONS of the server itself', `OPTIONS * HTTP/1.1\r\n${host}\r\n\r\n`, [204]],
    ['another method of the server itself', `DELETE * HTTP/1.1\r\n${host}\r\n\r\n`, [400]],
    ['a method of 4 kB', get('/healthz', [host]).replace('GET', 'G'.repeat(4000)), [400, 414, 501]],
    ['a forged X-Forwarded-For', anyone.get('/v1/jobs', [host, 'X-Forwarded-For: 127.0.0.1', 'X-Real-IP: 127.0.0.1']), [401]],
    ['a rewritten URL', anyone.get('/healthz', [host, 'X-Original-URL: /v1/tokens', 'X-Rewrite-URL: /v1/tokens']), [200]],
    ['a foreign Origin, preflight', get('/v1/jobs', [host, `Origin: ${foreign}`, 'Access-Control-Request-Method: POST']).replace('GET', 'OPTIONS'), [403]],
    ['a Host of another port and name', get('/v1/jobs', ['Host: evil.example:8080']), [421]],
    ['a Host in X-Forwarded-Host', get('/healthz', [host, 'X-Forwarded-Host: evil.example']), [200]],
    ['an upgrade to h2c', get('/healthz', [host, 'Connection: Upgrade, HTTP2-Settings', 'Upgrade: h2c', 'HTTP2-Settings: AAMAAABk']), [200]],
    ['the preface of HTTP/2', 'PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n', [400, 505]],
    ['a traversal', get('/../../etc/passwd', [host]), [400]],
    ['a traversal, escaped', get('/%2e%2e/%2e%2e/etc/passwd', [host]), [400]],
    ['a traversal, escaped twice', get('/%252e%252e%252fetc%252fpasswd', [host]), [404]],
    ['a traversal, backslashes', get('/..%5c..%5cetc%5cpasswd', [host]), [404]],
    ['a traversal with a path parameter', get('/..;/v1/tokens', [host]), [404]],
    ['an escaped slash', get('/v1%2Ftokens', [host]), [400]],
    ['an overlong dot (UTF-8)', get('/%c0%ae%c0%ae/etc/passwd', [host]), [400]],
    ['double slashes', get('//v1//tokens', [host]), [404]],
    ['a slash at the end', get('/v1/tokens/', [host]), [404]],
    ['a path in upper case', get('/V1/TOKENS', [host]), [404]],
    ['a path outside the base path', get('/v1/jobs', [host]).replace(base, ''), [404]],
    ['the base path as a prefix', get('evil/v1/jobs', [host]).replace('GET evil', `GET ${base}evil`), [404]],
    ['the base path and dots', get('/../colony/v1/tokens', [host]), [400]],
    ['a job id with SQL', get("/v1/jobs/1'%20OR%20'1'='1", [host]), [404]],
    ['a job id of 3 kB', get(`/v1/jobs/${'a'.repeat(3000)}`, [host]), [404]],
    ['SQL in a filter', get("/v1/jobs?name=x'%3B%20DROP%20TABLE%20job%3B--", [host]), [200]],
    ['a query given twice', get('/v1/jobs?limit=1&limit=500', [host]), [400, 422]],
    ['an unknown parameter', get('/v1/jobs?admin=true', [host]), [422]],
    ['a limit beyond all', get('/v1/jobs?limit=99999999999999999999', [host]), [422]],
    ['a NUL in the query', get('/v1/jobs?name=%00', [host]), [400, 422]],
    ['a made-up cursor', get(`/v1/jobs?cursor=${'0'.repeat(32)}`, [host]), [422]],
    ['CR and LF in a label filter', get('/v1/jobs?label=a:b%0d%0aSet-Cookie:%20x=1', [host]), [200, 422]],
    ['2,000 parameters', get(`/v1/jobs?${'a&'.repeat(2000)}`, [host]), [414, 422]],
    ['JSON 10,000 deep', sent('['.repeat(10_000)), [400]],
    ['a duplicate member', sent('{"seed":1,"seed":2,"until":{"cells":5}}'), [400, 422]],
    ['a number beyond a double', sent('{"seed":1e999,"until":{"cells":5}}'), [400, 422]],
    ['a prototype', sent('{"__proto__":{"x":1},"until":{"cells":5}}'), [422]],
    ['bytes that are not UTF-8', post([host, 'Content-Length: 4'], '"\xff\xfe"'), [400]],
    ['10,000 members', sent(`{${Array.from({ length: 10_000 }, (_, i) => `"a${i}":1`).join(',')}}`), [400, 422]],
    ['a form', anyone.post([host, `Authorization: Bearer ${submitter}`, length('a=b')], 'a=b').replace('application/json', 'application/x-www-form-urlencoded'), [415]],
    ['text/plain, as a foreign page can send it', anyone.post([host, `Authorization: Bearer ${submitter}`, length('{}')], '{}').replace('application/json', 'text/plain'), [415]],
    ['a bomb of gzip', post([host, 'Content-Encoding: gzip', length('x')], 'x'), [400, 415]],
    ['an idempotency key of 4 kB', post([host, `Idempotency-Key: ${'k'.repeat(4000)}`, length('{"until":{"cells":5}}')], '{"until":{"cells":5}}'), [422]],
    ['CL.TE', post([host, `Content-Length: ${smuggle.length}`, 'Transfer-Encoding: chunked'], smuggle), [400]],
    ['TE.CL', post([host, 'Transfer-Encoding: chunked', 'Content-Length: 4'], `5c\r\n${smuggled}\r\n0\r\n\r\n`), [400]],
    ['TE.TE', post([host, 'Transfer-Encoding: chunked', 'Transfer-encoding: x'], smuggle), [400]],
    ['TE with a vertical tab', post([host, 'Transfer-Encoding: \x0bchunked', length(smuggle)], smuggle), [400]],
    ['TE after a blank line of header', post([host, 'X: 1\r\n\tTransfer-Encoding: chunked', length(smuggle)], smuggle), [400]],
    ['CL.0 on a GET', `GET ${base}/healthz HTTP/1.1\r\n${host}\r\nContent-Length: ${smuggled.length}\r\n\r\n${smuggled}`, [200]],
    ['a chunk size with a sign', post([host, 'Transfer-Encoding: chunked'], `+5\r\nhello\r\n${smuggle}`), [400]],
    ['a chunk size beyond 64 bits', post([host, 'Transfer-Encoding: chunked'], `fffffffffffffffff\r\n${smuggle}`), [400, 413]],
    ['a chunk whose line ends in LF', post([host, 'Transfer-Encoding: chunked'], `0\n\r\n${smuggled}`), [400]],
    ['a trailer that names a length', post([host, 'Transfer-Encoding: chunked'], `0\r\nContent-Length: 999\r\n\r\n`), [400]],
    ['a request line with a tab', `GET\t${base}/healthz\tHTTP/1.1\r\n${host}\r\n\r\n`, [400]],
    ['a header with LF alone', `GET ${base}/healthz HTTP/1.1\n${host}\n\n`, [400]],
    ['an absolute target with a user', get('/healthz', [host]).replace(`GET ${base}`, `GET http://127.0.0.1@evil.example${base}`), [400, 421]],
    ['a body for the large path of 2 GB', get('/v1/analyses', [host, 'Content-Type: image/png', 'Content-Length: 2000000000']).replace('GET', 'POST'), [413]],
    ['a picture that is none', post([host, 'Content-Length: 9'], 'not a png', '/v1/analyses').replace('application/json', 'image/png'), [400, 422]],
  ];
}

test('hostile requests', async (t) => {
  const data = temporaryFolder(t);
  const root = createToken(data, 'root', 'admin');
  const reader = createToken(data, 'reader', 'read');
  const submitter = createToken(data, 'submitter', 'submit');
  const expired = createToken(data, 'late', 'admin');
  // None may be made so short that a test could wait for it: with the server stopped its row is written over.
  execFileSync('sqlite3', ['-batch', join(data, 'colony.db'), "update token set expires_at = '2020-01-01T00:00:00.000Z' where name = 'late'"]);
  const server = await startServer(t, {
    data, token: root,
    args: ['--auth.mode', 'required', '--log.format', 'json', '--server.base-path', base, '--server.behind-proxy', 'true', '--limits.failed-tokens-per-min', '0'],
  });
  const nginx = await startNginx(t, data, server.port, base);
  const place = { base, fields: [`Authorization: Bearer ${root}`] };
  const { get, host } = maker(place);
  const before = await server.counts();
  const rows = [
    ...requestShapes(place),
    ...attacks({ reader, submitter, unknown: `colony_${'0'.repeat(64)}`, cut: submitter.slice(0, 40), foreign: 'https://evil.example' }),
    ['an expired token', maker({ base, fields: [`Authorization: Bearer ${expired}`] }).get('/v1/jobs', [host]), [401]],
  ];

  for (const [what, bytes, statuses] of rows) {
    await t.test(`directly: ${what}`, async () => {
      // Well-formed, and the last on its connection: whoever frames wrongly answers it too early, or never.
      const last = get('/healthz', [host, 'Connection: close']);
      const { responses, closed } = await sendRaw(server.port, Buffer.from(bytes + last, 'latin1'), { isHead: bytes.startsWith('HEAD') });
      const got = responses.map(({ status }) => status);
      record('direct', what, got[0] ?? 'closed');
      assert.ok(closed && responses.length >= 1 && responses.length <= 2, `answers: ${got}`);
      assert.ok(statuses.includes(got[0]), `${got[0]}: ${responses[0].text}`);
      assert.ok(got.every((status) => status < 500 || meant.has(status)));
      for (const { headers } of responses) assert.equal(headers['x-content-type-options'], 'nosniff');
      assert.deepEqual(await server.counts(), before);
    });
  }

  // What is well-formed once nginx has read it may be carried out: it was let in.
  let admitted = 0;
  for (const [what, bytes] of rows) {
    await t.test(`through nginx: ${what}`, async () => {
      const { responses } = await sendRaw(nginx.port, Buffer.from(`${bytes}${get('/healthz', [host, 'Connection: close'])}`, 'latin1'), { isHead: bytes.startsWith('HEAD'), foreign: true });
      const got = responses.map(({ status }) => status);
      record('nginx', what, got[0] ?? 'closed');
      assert.ok(got.every((status) => status < 500 || status === 501 || status === 505), `answers: ${got}`);
      // Nobody else's request on the kept connections got a wrong answer.
      const { responses: [next] } = await sendRaw(nginx.port, get('/v1/jobs/counts', [host, 'Connection: close']));
      assert.equal(next.status, 200);
      admitted += got.filter((status) => status === 201).length;
      assert.equal(Object.values(next.json).reduce((sum, count) => sum + count), admitted);
    });
  }

  await t.test('nothing smuggled was carried out', () => {
    const requests = server.err.trim().split('\n').map((line) => JSON.parse(line)).filter(({ event }) => event === 'request');
    assert.ok(requests.length > rows.length);
    // An attacker may ask for it plainly, behind another request of their own; then nginx has seen it, too.
    const seen = nginx.seen();
    const hidden = requests.filter(({ path, request_id }) => path.includes('smuggled') && !seen.has(request_id));
    assert.deepEqual(hidden, []);
    assert.ok(!server.err.includes(submitter.slice(7, 20)), 'a token sent in the wrong place is not in the log');
  });
});

/** Runs slowhttptest against a URL; it ends when its connections are closed, or after `seconds`. */
function slow(mode, url, seconds, more = []) {
  const child = spawn('slowhttptest', [mode, '-c', '60', '-r', '60', '-i', '1', '-l', String(seconds), '-p', '5', '-u', url, ...more], { stdio: ['ignore', 'pipe', 'pipe'] });
  let out = '';
  child.stdout.on('data', (bytes) => { out += bytes; });
  return within((seconds + 60) * 1000, new Promise((done, fail) => {
    child.on('error', fail);
    child.on('close', () => done(out.replace(/\x1b\[[\d;]*m/g, '')));
  }), 'slowhttptest to end');
}

test('slow headers, bodies and readers', async (t) => {
  const server = await startServer(t, { args: ['--limits.header-timeout-ms', '1500', '--limits.body-timeout-ms', '1500', '--limits.idle-timeout-ms', '1500', '--limits.write-timeout-ms', '1500', '--limits.connections-max', '200'] });
  const seconds = full ? 30 : 10;
  for (const [what, mode, path, more] of [
    ['slow headers', '-H', '/v1/jobs', []],
    ['slow bodies', '-B', '/v1/jobs', ['-f', 'application/json', '-s', '8192', '-x', '10']],
    ['slow readers', '-X', '/openapi.json', ['-w', '1', '-y', '2', '-n', '1', '-z', '4', '-k', '3']],
  ]) {
    await t.test(what, async () => {
      const run = slow(mode, `${server.url}${path}`, seconds, more);
      let ended = false;
      run.finally(() => { ended = true; }).catch(() => {});
      let served = 0;
      while (!ended) {
        assert.equal((await server.get('/v1/jobs/counts')).status, 200, 'others are served meanwhile');
        ++served;
      }
      const out = await run;
      assert.match(out, /service available:\s+YES/, out.slice(-1500));
      const end = /Exit status:\s+(.*)/.exec(out)?.[1] ?? '';
      record('slow', `${what}, 60 connections (beside ${served} others, served)`, end);
      // A slow reader still reads from its own kernel what ours has long got rid of: what it says of itself proves nothing.
      if (mode !== '-X') assert.equal(end, 'No open connections left', out.slice(-1500));
    });
  }
});

test('caps, each with its own answer', async (t) => {
  const server = await startServer(t, { args: ['--limits.count-loopback', 'true', '--limits.connections-per-address-max', '3', '--limits.requests-per-s', '1', '--limits.requests-burst', '8'] });
  const get = maker().get('/healthz', [maker().host]);
  const kept = [];
  for (let i = 0; i < 10; ++i) kept.push(await sendRaw(server.port, get, { count: 1, keep: true }));
  const refused = kept.filter(({ responses }) => responses[0].status === 503);
  assert.ok(refused.length >= 7 && refused.length <= 8, 'three, less one of the harness that may not have gone yet');
  assert.match(refused[0].responses[0].text, /your address/);
  record('caps', 'a fourth connection of one address', 503);
  for (const { socket } of kept) socket.destroy();
  let status = 200;
  let retry = '';
  for (let i = 0; i < 100 && status !== 429; ++i) {
    const { responses: [answer] } = await sendRaw(server.port, get.replace('\r\n\r\n', '\r\nConnection: close\r\n\r\n'));
    if (answer.status !== 503) ({ status, headers: { 'retry-after': retry } } = answer);  // the cap, until the closed ones are gone
  }
  assert.equal(status, 429);
  assert.ok(Number(retry) >= 1);
  record('caps', 'requests beyond the rate', status);
});

test('the table', async () => {
  const lines = table.map(([way, what, got]) => `${way.padEnd(7)} ${String(got).padEnd(28)} ${what}`);
  assert.ok(table.length >= 60);
  console.log(`figure: ${table.length} hostile exchanges`);
  console.log(lines.join('\n'));
  if (!full) return;
  const day = new Date().toISOString().slice(0, 10);
  writeFileSync(join(top, `tests/bench/results/hostile-${day}.txt`),
    `Hostile requests and what each got, ${day}: way, first status (or closed without one), what was sent.\n\n${lines.join('\n')}\n`);
});
