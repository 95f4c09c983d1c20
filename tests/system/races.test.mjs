// races: what happens at the same time comes to one result. Rounds are many and short; none waits for a moment, the moments are where they fall.
import assert from 'node:assert/strict';
import test from 'node:test';
import { allEvents, command, endless, finishedJob, show, small, submit, terminal } from './harness/jobs.mjs';
import { full, startServer } from './harness/server.mjs';
import { openStream } from './harness/stream.mjs';
import { eventually, seeded } from './harness/wait.mjs';

const seed = Number(process.env.COLONY_TEST_SEED ?? 20261125);
const total = async (server) => Object.values(await server.counts()).reduce((sum, count) => sum + count, 0);

test('submissions at once with one Idempotency-Key', async (t) => {
  const server = await startServer(t, { args: ['--jobs.queued-max', '10000'] });
  const rounds = full ? 500 : 40;

  await t.test(`the same body: one job, ${rounds} times`, async () => {
    for (let round = 0; round < rounds; ++round) {
      const before = await total(server);
      const key = { 'Idempotency-Key': `same ${round}` };
      const answers = await Promise.all(
        Array.from({ length: 2 + (round % 5) }, () => server.post('/v1/jobs', small(round, 1), key)),
      );
      assert.deepEqual(answers.map(({ status }) => status).sort(), [...answers.slice(1).map(() => 200), 201]);
      assert.equal(new Set(answers.map(({ json }) => json.id)).size, 1);
      assert.equal(await total(server), before + 1);
    }
  });

  await t.test(`another body: one job, and the others are refused, ${rounds} times`, async () => {
    for (let round = 0; round < rounds; ++round) {
      const before = await total(server);
      const key = { 'Idempotency-Key': `other ${round}` };
      const answers = await Promise.all([1, 2, 3].map((cells) => server.post('/v1/jobs', small(round, cells), key)));
      assert.deepEqual(answers.map(({ status }) => status).sort(), [201, 422, 422]);
      assert.equal(await total(server), before + 1);
    }
  });
});

test('an edit and a deletion at once with one If-Match: one is done, and the other told so', async (t) => {
  const server = await startServer(t);
  const rounds = full ? 300 : 40;
  const outcomes = {};
  for (let round = 0; round < rounds; ++round) {
    const { id } = await finishedJob(server, small(round, 1));
    const { etag } = (await server.get(`/v1/jobs/${id}`)).headers;
    const edits = () => server.request('PATCH', `/v1/jobs/${id}`, {
      headers: { 'Content-Type': 'application/merge-patch+json', 'If-Match': etag },
      body: '{"labels":{"keep":"true"}}',
    });
    const removes = () => server.request('DELETE', `/v1/jobs/${id}`, { headers: { 'If-Match': etag } });
    const sent = round % 2 ? [edits(), removes()] : [removes(), edits()].reverse(); // begun in either order
    const [edit, removal] = await Promise.all(sent);
    const outcome = `${edit.status} ${removal.status}`;
    assert.ok(['200 412', '404 204'].includes(outcome), `round ${round}: ${outcome}`);
    assert.equal((await server.get(`/v1/jobs/${id}`)).status, edit.status, 'what was kept is there');
    outcomes[outcome] = (outcomes[outcome] ?? 0) + 1;
  }
  t.diagnostic(JSON.stringify(outcomes));
});

test('a cancel while the watcher reconnects is not lost', async (t) => {
  let server = await startServer(t, { args: ['--jobs.concurrent-max', '2'] });
  const rounds = full ? 100 : 8;
  for (let round = 0; round < rounds; ++round) {
    // Every fourth time the process is killed as soon as the cancel is answered.
    const killed = round % 4 === 3;
    await t.test(`round ${round}${killed ? ', and then kill -9' : ''}`, async () => {
      const { id } = await submit(server, endless(round));
      const first = await openStream(t, server, `/v1/jobs/${id}/events`);
      await first.until('some events', (stream) => stream.lastId() >= 5 + round);
      const seen = first.lastId();
      first.close();
      const resumed = { headers: { 'Last-Event-ID': String(seen) } };
      const cancelled = command(server, id, 'cancel');
      let second = round % 2 ? await openStream(t, server, `/v1/jobs/${id}/events`, resumed) : undefined;
      assert.equal((await cancelled).status, 202);
      if (killed) {
        await server.kill();
        server = await startServer(t, { data: server.data, args: ['--jobs.concurrent-max', '2'] });
        second = undefined;
      }
      second ??= await openStream(t, server, `/v1/jobs/${id}/events`, resumed);
      await second.untilClosed();
      const history = second.history().filter(({ data }) => data);
      history.forEach((message, index) => assert.equal(Number(message.id), seen + index + 1, 'no gap'));
      assert.deepEqual([JSON.parse(history.at(-1).data).kind, JSON.parse(history.at(-1).data).reason], ['finished', 'cancelled']);
      assert.equal(JSON.parse(second.find('end').data).state, 'cancelled');
      const third = await openStream(t, server, `/v1/jobs/${id}/events`, { headers: { 'Last-Event-ID': second.lastEventId } });
      assert.equal(third.status, 204, 'nothing is left');
      assert.equal((await show(server, id)).state, 'cancelled');
    });
  }
});

test('a finished job never changes', async (t) => {
  t.diagnostic(`COLONY_TEST_SEED=${seed}`);
  const random = seeded(seed);
  let server = await startServer(t, { args: ['--jobs.concurrent-max', '2'] });
  const rounds = full ? 300 : 30;
  const ended = new Map();

  await t.test(`commands around its end, ${rounds} times`, async () => {
    const reasons = {};
    for (let round = 0; round < rounds; ++round) {
      const { id } = await submit(server, small(round, 1 + Math.floor(random() * 100)));
      const views = []; // of one client, one after the other: the order in which they were true
      const looks = async () => {
        for (let k = 0; k < 10; ++k) views.push((await show(server, id)).state);
      };
      const commands = async () => {
        for (let k = 0; k < 4; ++k) {
          const name = ['pause', 'resume', 'cancel', 'resume', 'pause'][Math.floor(random() * (round % 2 ? 5 : 2))];
          const { status } = await command(server, id, name);
          assert.ok([200, 202, 409].includes(status), `${name}: ${status}`);
        }
      };
      await Promise.all([looks(), commands(), commands()]);
      const job = await eventually(`job ${id} to end`, async () => {
        const view = await show(server, id);
        if (view.state === 'paused') await command(server, id, 'resume');
        return terminal.includes(view.state) && view;
      });
      const first = views.findIndex((state) => terminal.includes(state));
      if (first >= 0) assert.deepEqual([...new Set(views.slice(first))], [job.state], `it was ${views}, now ${job.state}`);
      const events = await allEvents(server, id);
      assert.deepEqual(
        events.map(({ seq }) => seq),
        events.map((_, index) => index + 1),
      );
      const finished = events.filter(({ kind }) => kind === 'finished');
      assert.deepEqual(
        [finished.length, events.at(-1).kind, job.last_seq],
        [1, 'finished', events.length],
        'one end, and it is the last event',
      );
      assert.equal(finished[0].reason, job.reason);
      assert.ok(
        job.state === 'cancelled' ? job.reason === 'cancelled' : job.state === 'succeeded',
        `${job.state}, ${job.reason}`,
      );
      reasons[job.state] = (reasons[job.state] ?? 0) + 1;
      ended.set(id, job);
    }
    t.diagnostic(`ended: ${JSON.stringify(reasons)}`);
    assert.ok(reasons.succeeded > 0 && reasons.cancelled > 0, 'both ends were seen');
  });

  await t.test('commands afterwards, SIGTERM and kill -9 change nothing', async () => {
    for (const end of ['stop', 'kill']) {
      for (const [id, job] of ended) {
        await Promise.all(
          ['cancel', 'pause', 'resume'].map(async (name) => {
            const { status } = await command(server, id, name);
            assert.equal(status, name === 'cancel' && job.state === 'cancelled' ? 200 : 409, name);
          }),
        );
      }
      await server[end]();
      server = await startServer(t, { data: server.data });
      for (const [id, job] of ended) assert.deepEqual(await show(server, id), job);
    }
  });
});
