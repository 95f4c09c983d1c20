// security: who is let in, over what, and what is written down about it.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { once } from 'node:events';
import { chmodSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { join } from 'node:path';
import test from 'node:test';
import tls from 'node:tls';
import { finishedJob, small } from './harness/jobs.mjs';
import { assertSane, cleanEnvironment, cliBinary, createToken, refusedStart, startServer, temporaryFolder } from './harness/server.mjs';
import { openStream } from './harness/stream.mjs';
import { makeCertificate, sendTls } from './harness/tls.mjs';
import { eventually, within } from './harness/wait.mjs';

const required = ['--auth.mode', 'required'];
const bearer = (token) => ({ Authorization: `Bearer ${token}` });
const made = async (server, name, scope, expires_h = 1) => (await server.post('/v1/tokens', { name, scope, expires_h })).json;

/** Nothing secret in what a server said, at any level. */
function assertNoSecrets(server, ...tokens) {
  for (const token of tokens) assert.ok(!`${server.err}${server.out}`.includes(token.slice(7, 20)), 'a token is in the log');
  assert.doesNotMatch(server.err, /authorization|bearer/i);
}

test('tokens: scopes, revocation, actors, and a log without secrets', async (t) => {
  const data = temporaryFolder(t);
  const root = createToken(data, 'root', 'admin');
  const server = await startServer(t, { data, token: root, args: [...required, '--log.format', 'json'] });
  const ann = await made(server, 'ann', 'submit');
  const bob = await made(server, 'bob', 'submit');
  const eve = await made(server, 'eve', 'read');

  await t.test('each scope does what it may and no more', async () => {
    const tries = [
      [eve, 'GET', '/v1/jobs', 200], [eve, 'GET', '/v1/tokens', 403], [eve, 'POST', '/v1/jobs', 403], [eve, 'DELETE', `/v1/tokens/${ann.id}`, 403],
      [ann, 'GET', '/v1/jobs', 200], [ann, 'POST', '/v1/tokens', 403], [ann, 'POST', '/v1/jobs?dry_run=true', 200]];
    for (const [who, method, path, status] of tries) {
      const response = await server.request(method, path, { headers: bearer(who.token), ...(method === 'POST' ? { json: small() } : {}) });
      assert.equal(response.status, status, `${who.name} ${method} ${path}`);
      if (status === 403) assert.match(response.headers['www-authenticate'], /insufficient_scope/);
    }
    for (const path of ['/v1/jobs', '/v1/tokens', '/v1/service-info', '/v1/schema/job', '/v1/made-up']) {
      const response = await server.request('GET', path, { headers: { Authorization: null }, gate: true });
      assert.equal(response.status, 401, path);
    }
    for (const path of ['/healthz', '/readyz', '/openapi.json']) assert.equal((await server.get(path, { Authorization: null })).status, 200, path);
  });

  await t.test('an idempotency key belongs to who used it', async () => {
    const key = { 'Idempotency-Key': 'same' };
    const ids = [];
    for (const who of [ann, bob, ann]) {
      const response = await server.post('/v1/jobs', small(3), { ...key, ...bearer(who.token) });
      ids.push(response.json.id);
      assert.equal(response.json.submitted_by, who.name);
    }
    assert.equal(ids[0], ids[2]);
    assert.notEqual(ids[0], ids[1]);
  });

  await t.test('the log of a job says who did what', async () => {
    const { json: job } = await server.post('/v1/jobs', { until: { cells: 100_000 }, model: { division: { generation_limit: null } } }, bearer(ann.token));
    const read = async () => (await server.get(`/v1/jobs/${job.id}/log`)).text.trim().split('\n').map((line) => JSON.parse(line));
    // Else a pause may find it queued, and then the service has nothing to say.
    await eventually('the service itself, which is nobody', async () => (await read()).some(({ actor }) => actor === null));
    for (const [who, command] of [[bob, 'pause'], [ann, 'resume'], [bob, 'cancel']]) {
      assert.ok([200, 202].includes((await server.post(`/v1/jobs/${job.id}/${command}`, {}, bearer(who.token))).status));
    }
    const log = await read();
    const asked = log.filter(({ actor }) => actor !== null).map(({ actor }) => actor);
    assert.equal(asked[0], 'ann');
    assert.ok(asked.includes('bob'));
  });

  await t.test('a revoked token is worth nothing at once, also for an open stream, and after a restart', async () => {
    const mal = await made(server, 'mal', 'read');
    const { json: job } = await server.post('/v1/jobs', { until: { cells: 100_000 }, model: { division: { generation_limit: null } } });
    const shown = await server.get(`/v1/jobs/${job.id}`, bearer(mal.token));
    const waits = server.get(`/v1/jobs/${job.id}`, { ...bearer(mal.token), Prefer: 'wait=60', 'If-None-Match': shown.headers.etag });
    const stream = await openStream(t, server, `/v1/jobs/${job.id}/events?kind=progress`, { headers: bearer(mal.token) });
    await stream.until('progress', ({ events }) => events.length > 0);
    assert.equal((await server.request('DELETE', `/v1/tokens/${mal.id}`)).status, 204);
    assert.equal((await server.get('/v1/jobs', bearer(mal.token))).status, 401);
    await stream.untilClosed();
    assert.equal(stream.events.at(-1).event, 'bye');
    assert.ok([200, 401].includes((await waits).status), 'the state may have changed before');
    await server.post(`/v1/jobs/${job.id}/cancel`, {});
    await server.kill();
    const again = await startServer(t, { data, token: root, args: required });
    assert.equal((await again.get('/v1/jobs', bearer(mal.token))).status, 401);
    assert.equal((await again.get('/v1/jobs', bearer(ann.token))).status, 200);
    await again.stop();
    assertNoSecrets(again, root, ann.token, mal.token);
  });

  const lines = server.err.trim().split('\n').map((line) => JSON.parse(line));
  const requests = lines.filter(({ event }) => event === 'request');
  assert.ok(requests.length > 30);
  for (const line of requests) {
    assert.deepEqual(Object.keys(line), ['time', 'level', 'event', 'request_id', 'remote', 'method', 'path', 'status', 'duration_us', 'bytes', 'actor', 'token_id']);
    assert.doesNotMatch(line.path, /\?/);
  }
  assert.ok(requests.some(({ method, status, actor }) => method === 'DELETE' && status === 403 && actor === 'eve'), 'who tried what');
  assertNoSecrets(server, root, ann.token, bob.token, eve.token);
});

test('nothing is done for a token that ends while the body is under way', async (t) => {
  const data = temporaryFolder(t);
  const root = createToken(data, 'root', 'admin', 2);  // lasts long enough for others of its scope to be revoked
  const server = await startServer(t, { data, token: root, args: required });
  const kept = await made(server, 'kept', 'read');
  const wish = JSON.stringify({ name: 'thief', scope: 'admin', expires_h: 80_000 });
  for (const [method, path] of [['POST', '/v1/tokens'], ['DELETE', `/v1/tokens/${kept.id}`], ['POST', '/v1/jobs'], ['GET', '/v1/jobs']]) {
    for (const how of ['revoked', 'expired']) {
      const ends = await made(server, 'ends', 'admin', how === 'expired' ? 0.001 : 1);
      const socket = net.connect(server.port, '127.0.0.1');
      let answer = '';
      socket.on('data', (bytes) => { answer += bytes; });
      socket.write(`${method} ${path} HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer ${ends.token}\r\nContent-Type: application/json\r\n`
        + `Content-Length: ${wish.length}\r\nExpect: 100-continue\r\n\r\n`);
      await eventually('the header to be let in', () => answer.startsWith('HTTP/1.1 100 '));
      socket.write(wish.slice(0, 5));
      if (how === 'revoked') assert.equal((await server.request('DELETE', `/v1/tokens/${ends.id}`)).status, 204);
      await eventually('the token to end', () => how === 'revoked' || Date.now() > Date.parse(ends.expires_at));
      answer = '';
      socket.write(wish.slice(5));
      await eventually('the answer', () => answer.includes('\r\n\r\n'));
      socket.destroy();
      assert.match(answer, /^HTTP\/1\.1 401 /, `${method} ${path}, ${how}`);
    }
  }
  const { items } = (await server.get('/v1/tokens')).json;
  assert.ok(items.some(({ id }) => id === kept.id));
  assert.ok(items.every(({ name }) => name !== 'thief'));
  assert.equal((await server.get('/v1/jobs')).json.items.length, 0);
});

test('a server refuses to be reached without tokens and TLS', (t) => {
  const data = temporaryFolder(t);
  for (const [args, what] of [
    [['--listen', '0.0.0.0:0'], /auth\.mode/],
    [['--listen', '0.0.0.0:0', '--server.behind-proxy', 'true'], /auth\.mode/],
    [['--listen', '0.0.0.0:0', ...required], /in the clear/],
    [['--listen', '[::]:0', ...required], /in the clear/],
    [['--tls.certificate', 'x.pem'], /tls\.key/],
  ]) {
    const { status, stderr } = refusedStart(data, args);
    assert.equal(status, 2, args.join(' '));
    assert.match(stderr, what);
  }
  const missing = refusedStart(data, ['--listen', '127.0.0.1:0', '--tls.certificate', '/no/such', '--tls.key', '/no/such']);
  assert.equal(missing.status, 2);
  assert.match(missing.stderr, /tls\.certificate/);
});

test('a certificate and a key that are of no use are named, and a key that others can read', async (t) => {
  const data = temporaryFolder(t);
  const { certificate, key } = makeCertificate(temporaryFolder(t));
  const other = makeCertificate(temporaryFolder(t));
  const rsa = join(data, 'rsa.pem');
  execFileSync('openssl', ['genrsa', '-out', rsa, '2048'], { stdio: 'ignore' });
  const locked = join(data, 'locked.pem');
  execFileSync('openssl', ['ec', '-in', key, '-out', locked, '-aes128', '-passout', 'pass:secret'], { stdio: 'ignore' });
  const empty = join(data, 'empty.pem');
  writeFileSync(empty, '');
  for (const [wrong, setting, file, why] of [
    [{ certificate, key: other.key }, 'tls.key', other.key, `tls.certificate '${certificate}'`],
    [{ certificate, key: rsa }, 'tls.key', rsa, `tls.certificate '${certificate}'`],
    [{ certificate, key: locked }, 'tls.key', locked, 'passphrase'],
    [{ certificate, key: certificate }, 'tls.key', certificate, 'not a key'],
    [{ certificate, key: '/no/such' }, 'tls.key', '/no/such', 'No such file'],
    [{ certificate: data, key }, 'tls.certificate', data, 'directory'],
    [{ certificate: empty, key }, 'tls.certificate', empty, 'empty'],
    [{ certificate: key, key }, 'tls.certificate', key, 'not a certificate'],
  ]) {
    const { status, stderr } = refusedStart(data, ['--listen', '127.0.0.1:0', '--tls.certificate', wrong.certificate, '--tls.key', wrong.key]);
    assert.equal(status, 2, stderr);
    for (const part of [`${setting}: `, `'${file}'`, why]) assert.ok(stderr.includes(part), `${part} in ${stderr}`);
    assert.equal(stderr.split(`${setting}: cannot use`).length, 2, `said once: ${stderr}`);
  }
  for (const [mode, warns] of [[0o600, false], [0o640, false], [0o644, true], [0o660, true]]) {
    chmodSync(key, mode);
    const server = await startServer(t, { args: ['--tls.certificate', certificate, '--tls.key', key] });
    await server.stop();
    assert.equal(server.err.includes(`tls.key: others than its owner can get at '${key}' (mode 0${mode.toString(8)})`), warns, server.err);
  }
});

test('a port that is taken is no fault of the configuration', async (t) => {
  const server = await startServer(t);
  const { status, stderr } = refusedStart(temporaryFolder(t), ['--listen', `127.0.0.1:${server.port}`]);
  assert.equal(status, 1, stderr);
  assert.equal(stderr.split('cannot listen on').length, 2, stderr);
});

test('a token is made with the server stopped only', async (t) => {
  const server = await startServer(t);
  assert.throws(() => createToken(server.data, 'ann', 'admin'), ({ status, stderr }) => status === 1 && /POST \/v1\/tokens/.test(stderr));
  const elsewhere = temporaryFolder(t);
  assert.throws(() => createToken(elsewhere, 'local', 'root', -1), ({ status, stderr }) => status === 2 && /--name/.test(stderr) && /--scope/.test(stderr) && /--expires-h/.test(stderr));
});

test('TLS', async (t) => {
  const data = temporaryFolder(t);
  const { certificate, key } = makeCertificate(temporaryFolder(t));
  const token = createToken(data, 'ann', 'admin');
  const server = await startServer(t, { data, args: [...required, '--tls.certificate', certificate, '--tls.key', key, '--limits.handshake-timeout-ms', '300'] });
  const ask = (method, path, options = {}) => sendTls(server.port, certificate, method, path, { ...options, headers: { ...bearer(token), ...options.headers } });
  const connect = (options) => within(60_000, new Promise((done) => {
    const socket = tls.connect({ port: server.port, host: '127.0.0.1', rejectUnauthorized: false, ...options }, () => {
      const facts = { protocol: socket.getProtocol(), cipher: socket.getCipher().name };
      socket.destroy();
      done(facts);
    });
    socket.on('error', (error) => done({ error }));
  }), 'a handshake');

  await t.test('speaks 1.2 and 1.3 and nothing older', async () => {
    assert.equal((await connect({ maxVersion: 'TLSv1.2' })).protocol, 'TLSv1.2');
    assert.equal((await connect({})).protocol, 'TLSv1.3');
    assert.ok((await connect({ minVersion: 'TLSv1', maxVersion: 'TLSv1.1', ciphers: 'DEFAULT@SECLEVEL=0' })).error, 'TLS 1.1');
  });

  await t.test('answers, and tells browsers to stay', async () => {
    const response = await ask('GET', '/healthz');
    assert.equal(response.status, 200);
    assert.match(response.headers['strict-transport-security'], /max-age=\d+/);
    assert.equal((await sendTls(server.port, certificate, 'GET', '/v1/jobs')).status, 401);
  });

  await t.test('a history arrives whole, and large bodies both ways', async () => {
    const { json: job } = await ask('POST', '/v1/jobs', { json: small(7, 30) });
    let rest = '';
    const stream = await ask('GET', `/v1/jobs/${job.id}/events`, { headers: { Accept: 'text/event-stream' }, onData: (piece) => { rest = (rest + piece).slice(-2000); } });
    assert.match(stream.text, /event: end/);
    const ndjson = (await ask('GET', `/v1/jobs/${job.id}/events`, { headers: { Accept: 'application/x-ndjson' } })).text.trim().split('\n').map((line) => JSON.parse(line));
    assert.deepEqual(ndjson.map(({ seq }) => seq), ndjson.map((_, index) => index + 1));
    assert.equal(stream.text.match(/^id: \d+$/gm).length >= ndjson.length, true);
    const many = { name: 'x', labels: Object.fromEntries(Array.from({ length: 900 }, (_, i) => [`k${i}`, 'v'.repeat(1000)])), until: { cells: 5 } };
    assert.equal((await ask('POST', '/v1/jobs?dry_run=true', { json: many })).status, 422, 'read whole and judged');
    const picture = await ask('GET', `/v1/jobs/${job.id}/mesh`);
    assert.equal(picture.status, 200);
  });

  await t.test('whoever does not shake hands is cut off', async () => {
    for (const bytes of ['', 'GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n', '\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03']) {
      await within(60_000, new Promise((done) => {
        const socket = net.connect(server.port, '127.0.0.1', () => socket.write(Buffer.from(bytes, 'latin1')));
        socket.on('error', () => {});
        socket.on('data', () => {});
        socket.on('close', done);
      }), 'a connection without a handshake to be closed');
    }
    assert.equal((await ask('GET', '/healthz')).status, 200);
  });

  await t.test('the command line: certificates, tokens, exit codes', () => {
    const run = (args, env) => spawnSync(cliBinary, args, { env: { ...cleanEnvironment(), HOME: data, ...env }, encoding: 'utf8', timeout: 60_000 });
    const url = `https://localhost:${server.port}`;
    const right = run(['list', '--server', url, '--ca-file', certificate], { COLONY_TOKEN: token });
    assert.equal(right.status, 0, right.stderr);
    assert.equal(run(['list'], { COLONY_SERVER: url, COLONY_CA_FILE: certificate, COLONY_TOKEN: token }).status, 0);
    const distrusted = run(['list', '--server', url], { COLONY_TOKEN: token });
    assert.equal(distrusted.status, 3, distrusted.stderr);
    const nobody = run(['list', '--server', url, '--ca-file', certificate], {});
    assert.equal(nobody.status, 4);
    const clear = run(['list', '--server', 'http://lab.example'], { COLONY_TOKEN: token });
    assert.equal(clear.status, 2);
    assert.match(clear.stderr, /in the clear/);
    for (const { stdout, stderr } of [right, distrusted, nobody, clear]) {
      assert.ok(!`${stdout}${stderr}`.includes(token.slice(0, 20)));
      assertSane(stderr);
    }
  });
  assertNoSecrets(server, token);
});

test('without tokens every local user is "local"', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small());
  assert.equal(job.submitted_by, 'local');
  const log = (await server.get(`/v1/jobs/${job.id}/log`)).text.trim().split('\n').map((line) => JSON.parse(line));
  assert.equal(log[0].actor, 'local');
});

test('a log that nobody reads holds nobody up', async (t) => {
  const server = await startServer(t);
  server.child.stderr.pause();  // the pipe fills, as behind a pager or a dead collector
  for (let i = 0; i < 2000; ++i) assert.equal((await server.get('/healthz', { 'X-Request-Id': `${'x'.repeat(58)}-${i}` })).status, 200);
  const ended = once(server.child, 'exit');
  server.child.kill('SIGTERM');
  assert.deepEqual(await within(10_000, ended, 'colonyd to end though its log is stuck'), [0, null]);
  server.child.stderr.resume();
});
