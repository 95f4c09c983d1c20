// commands: cancel, pause, resume and delete, in every state, across restarts; waiting for a change.
import assert from 'node:assert/strict';
import test from 'node:test';
import { allEvents, command, endless, finishedJob, grown, reached, show, small, submit } from './harness/jobs.mjs';
import { startServer } from './harness/server.mjs';

test('commands', async (t) => {
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '1'] });
  const status = async (id, name) => (await command(server, id, name)).status;
  const state = async (id) => (await show(server, id)).state;
  const runner = (await submit(server, endless())).id;
  await grown(server, runner, 10);

  await t.test('a running job: paused, resumed, cancelled, deleted', async () => {
    assert.equal((await server.request('DELETE', `/v1/jobs/${runner}`)).status, 409);
    assert.equal(await status(runner, 'resume'), 200, 'it is running already');
    assert.equal(await status(runner, 'pause'), 202);
    const paused = await reached(server, runner, 'paused');
    assert.equal(paused.reason, 'user');
    assert.equal(await status(runner, 'pause'), 200);
    assert.equal((await server.request('DELETE', `/v1/jobs/${runner}`)).status, 409);
    const still = (await show(server, runner)).last_seq;
    assert.equal(await status(runner, 'resume'), 202);
    await reached(server, runner, 'running');
    await grown(server, runner, still + 20);
    const late = await server.get(`/v1/jobs/${runner}/cells?at_h=9998`);
    assert.equal(late.status, 409, 'a time that a live job has not reached');
    assert.equal(late.json.type, 'urn:colony:problem:time-not-reached');

    // One runner: what comes now waits behind the endless job.
    const queued = (await submit(server, small(1, 3))).id;
    assert.equal(await state(queued), 'queued');
    assert.equal(await status(queued, 'resume'), 200);
    assert.equal((await server.request('DELETE', `/v1/jobs/${queued}`)).status, 409);
    assert.equal(await status(queued, 'pause'), 202);
    assert.equal(await state(queued), 'paused');
    assert.equal(await status(queued, 'resume'), 202);
    assert.equal(await state(queued), 'queued');
    assert.equal(await status(queued, 'cancel'), 202);
    assert.equal(await state(queued), 'cancelled');
    const ended = await allEvents(server, queued);
    assert.deepEqual(ended.map(({ kind, reason }) => [kind, reason]), [['finished', 'cancelled']], 'every terminal job ends with finished');

    assert.equal(await status(runner, 'cancel'), 202);
    const cancelled = await reached(server, runner, 'cancelled');
    assert.equal(await status(runner, 'cancel'), 200);
    for (const name of ['pause', 'resume']) assert.equal(await status(runner, name), 409, name);
    const events = await allEvents(server, runner);
    assert.deepEqual([events.at(-1).kind, events.at(-1).reason, events.length], ['finished', 'cancelled', cancelled.last_seq]);
    const deleted = await server.request('DELETE', `/v1/jobs/${runner}`);
    assert.equal(deleted.status, 204);
    for (const what of ['', '/events', '/cells', '/series', '/image', '/log']) {
      assert.equal((await server.get(`/v1/jobs/${runner}${what}`)).status, 404, what);
    }
    assert.equal((await server.request('DELETE', `/v1/jobs/${runner}`)).status, 404);
  });

  await t.test('a succeeded job: refuses commands, can be deleted', async () => {
    const { id } = await finishedJob(server, small(5, 3));
    for (const name of ['cancel', 'pause', 'resume']) {
      const response = await command(server, id, name);
      assert.deepEqual([response.status, response.json.type], [409, 'urn:colony:problem:job-terminal'], name);
    }
    assert.equal((await server.request('DELETE', `/v1/jobs/${id}`)).status, 204);
  });

  await t.test('a paused job: can be cancelled', async () => {
    const { id } = await submit(server, endless(12));
    await grown(server, id, 5);
    assert.equal(await status(id, 'pause'), 202);
    await reached(server, id, 'paused');
    assert.equal(await status(id, 'cancel'), 202);
    assert.equal(await state(id), 'cancelled');
  });

  await t.test('a pause outlives the server, and so does a queue', async () => {
    const runs = (await submit(server, endless(13))).id;
    await grown(server, runs, 5);
    const paused = (await submit(server, small(6, 3))).id;
    assert.equal(await status(paused, 'pause'), 202);
    const waits = (await submit(server, small(7, 3))).id;
    await server.stop();
    const next = await startServer(t, { data: server.data, args: ['--jobs.concurrent-max', '1'] });
    assert.equal((await show(next, paused)).state, 'paused');
    const seq = (await show(next, runs)).last_seq;
    await grown(next, runs, seq + 5);
    assert.equal((await show(next, waits)).state, 'queued');
    assert.equal((await command(next, runs, 'cancel')).status, 202);
    await reached(next, waits, 'succeeded');
  });
});
