// leaving: clients that go away before their answer, and stored data that is damaged: what the others notice, and what the log says.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import net from 'node:net';
import { join } from 'node:path';
import test from 'node:test';
import tls from 'node:tls';
import { send, sendRaw } from './harness/http.mjs';
import { finishedJob, small } from './harness/jobs.mjs';
import { startServer, temporaryFolder } from './harness/server.mjs';
import { makeCertificate, sendTls } from './harness/tls.mjs';
import { eventually, within } from './harness/wait.mjs';

const logged = (server) => server.err.split('\n').slice(0, -1).map((line) => JSON.parse(line));
const requests = (server, path) => logged(server).filter((line) => line.event === 'request' && line.path.endsWith(path));

/** Asks on a connection of its own, and says what status came (undefined: none yet). */
function asked(port, path) {
  const state = { socket: net.connect(port, '127.0.0.1') };
  state.socket.on('connect', () => state.socket.write(`GET ${path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n`));
  state.socket.on('data', (bytes) => { state.status ??= Number(/^HTTP\/1\.1 (\d{3})/.exec(bytes.toString('latin1'))?.[1]); });
  state.socket.on('error', () => {});
  return state;
}

test('pictures for clients who left', async (t) => {
  const server = await startServer(t, { args: ['--log.format', 'json'] });
  const job = await finishedJob(server, small(7, 60));
  // More than are drawn at a time (2) and wait (32). Each would take seconds.
  const clients = Array.from({ length: 40 }, () => asked(server.port, `/v1/jobs/${job.id}/image?width_px=8192`));
  await eventually('those beyond the queue to be refused', () => clients.filter(({ status }) => status === 503).length >= 6);
  const health = [];
  const ask = async () => health.push((await server.get('/healthz')).status);
  await ask();
  for (const { socket } of clients) socket.destroy();
  await eventually('all to be given up', async () => {
    await ask();
    return requests(server, '/image').length === clients.length;
  });
  assert.ok(health.every((status) => status === 200));
  const later = await server.get(`/v1/jobs/${job.id}/image?width_px=64`);
  assert.equal(later.status, 200);
  await eventually('its line', () => requests(server, '/image').length === clients.length + 1);
  const statuses = requests(server, '/image').map(({ status }) => status);
  assert.ok(statuses.filter((status) => status === 499).length >= 32, `${statuses}`);
  assert.equal(statuses.indexOf(200), clients.length, 'not one was drawn that nobody waited for');
});

// The one before it tells when the picture's header has been read. Then the bytes come, and then the client goes.
for (const speaks of ['plain', 'TLS']) {
  test(`bytes behind a request do not hide that its client has left (${speaks})`, async (t) => {
    const isPlain = speaks === 'plain';
    const { certificate, key } = makeCertificate(temporaryFolder(t));
    const server = await startServer(t, { args: ['--log.format', 'json', ...(isPlain ? [] : ['--tls.certificate', certificate, '--tls.key', key])] });
    const ask = (method, path, json) => (isPlain ? send(server.port, method, path, { json }) : sendTls(server.port, certificate, method, path, { json }));
    const { json: { id } } = await ask('POST', '/v1/jobs', small(7, 60));
    await eventually('the job to end', async () => (await ask('GET', `/v1/jobs/${id}`)).json.state === 'succeeded');
    let expected = 0;
    for (const size of [20_000, 70_000]) {
      for (const leave of ['resetAndDestroy', 'destroy']) {
        const socket = net.connect(server.port, '127.0.0.1');
        const over = isPlain ? socket : tls.connect({ socket, rejectUnauthorized: false });
        let answer = '';
        over.on('data', (bytes) => { answer += bytes.toString('latin1'); });
        for (const one of [socket, over]) one.on('error', () => {});  // the server may be the first to close
        over.write(['/healthz', `/v1/jobs/${id}/image?width_px=8192`]
          .map((path) => `GET ${path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n`).join(''));
        await eventually('the first answer', () => answer.startsWith('HTTP/1.1 200 '));
        await within(60_000, new Promise((done) => over.write('x'.repeat(size), done)), 'the bytes to be on their way');
        socket[leave]();
        ++expected;
        const lines = await eventually('it to be given up', () => requests(server, '/image').length === expected && requests(server, '/image'));
        assert.equal(lines.at(-1).status, 499, `${size} bytes, ${leave}`);
        assert.equal(lines.at(-1).peer_left, true);
      }
    }
  });
}

test('what is honestly asked behind a slow request is answered', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small());
  const get = (path) => `GET /v1/jobs/${job.id}${path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n`;
  const { responses } = await sendRaw(server.port, get('/image?width_px=3000') + get('') + get('/cells'), { count: 3 });
  assert.deepEqual(responses.map(({ status }) => status), [200, 200, 200]);
  assert.equal(responses[0].headers['content-type'], 'image/png');
  assert.equal(responses[1].json.id, job.id);
});

test('a client that only stops sending gets its picture', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small());
  const socket = net.connect({ port: server.port, host: '127.0.0.1', allowHalfOpen: true });
  let answer = '';
  socket.on('data', (bytes) => { answer += bytes.toString('latin1'); });
  socket.end(`GET /v1/jobs/${job.id}/image?width_px=3000 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n`);
  await within(60_000, new Promise((done) => socket.on('end', done)), 'the picture');
  const [head, body] = answer.replace(/^HTTP\/1\.1 100 Continue\r\n\r\n/, '').split('\r\n\r\n');
  assert.match(head, /^HTTP\/1\.1 200 OK\r\n/);
  assert.equal(body.slice(1, 4), 'PNG');
});

test('damaged data is a 500 whose reason stands in the log', async (t) => {
  const data = temporaryFolder(t);
  const before = await startServer(t, { data });
  const job = await finishedJob(before, small());
  await before.stop();
  execFileSync('sqlite3', ['-batch', join(data, 'colony.db'), `delete from event where seq = ${job.last_seq}`]);
  const server = await startServer(t, { data, args: ['--log.format', 'json'] });
  for (const path of ['cells', 'series']) {
    const response = await send(server.port, 'GET', `/v1/jobs/${job.id}/${path}`, { headers: { 'X-Request-Id': `ask-${path}` } });
    assert.equal(response.status, 500);
    assert.deepEqual([response.json.detail, response.json.errors], ["the server's log has more under this request_id", undefined]);
    assert.equal(response.json.request_id, `ask-${path}`);
    const failure = await eventually('its line', () => logged(server).find(({ event, request_id }) => event === 'failure' && request_id === `ask-${path}`));
    assert.equal(failure.level, 'error');
    assert.match(failure.message, new RegExp(`job ${job.id} does not fold at event ${job.last_seq}\\b`));
  }
});
