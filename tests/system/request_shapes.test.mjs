// request_shapes: framing that proxies and servers read differently, foreign hosts and origins, sizes and deadlines: refused
// by the gate before any handler runs, with the connection closed.
import assert from 'node:assert/strict';
import net from 'node:net';
import test from 'node:test';
import { sendRaw } from './harness/http.mjs';
import { startServer } from './harness/server.mjs';
import { maker, requestShapes } from './harness/shapes.mjs';
import { within } from './harness/wait.mjs';

const { post, get, host, length, body, chunked } = maker();
const shapes = requestShapes();

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
