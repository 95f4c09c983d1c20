// stream: server-sent events of a live job: no gap, no repetition, an end, and nobody waits for a slow reader.
import assert from 'node:assert/strict';
import test from 'node:test';
import { allEvents, command, endless, finishedJob, grown, reached, show, small, submit } from './harness/jobs.mjs';
import { startServer } from './harness/server.mjs';
import { openStream } from './harness/stream.mjs';

const dense = (from, to) => Array.from({ length: to - from + 1 }, (_, index) => String(from + index));
const ids = (stream) => stream.history().map(({ id }) => id);

test('the event stream', async (t) => {
  const server = await startServer(t);

  await t.test('follows a live job to its end without a gap', async () => {
    const { id } = await submit(server, small(21, 40));
    const stream = await openStream(t, server, `/v1/jobs/${id}/events`);
    assert.deepEqual([stream.status, stream.response.headers['content-type'].split(';')[0]], [200, 'text/event-stream']);
    await stream.untilClosed();
    assert.equal(stream.retry_ms, 2000);
    const job = await show(server, id);
    const end = stream.events.at(-1);
    assert.equal(end.event, 'end');
    const said = JSON.parse(end.data);
    assert.deepEqual([said.state, said.reason, said.last_seq], ['succeeded', 'cells', job.last_seq]);
    assert.equal(stream.lastEventId, String(job.last_seq));
    assert.deepEqual(ids(stream), dense(1, job.last_seq));
    const events = await allEvents(server, id);
    assert.deepEqual(stream.history().map(({ data }) => JSON.parse(data)), events, 'the same facts as the stored ones');
    assert.deepEqual(stream.history().map(({ event }) => event), events.map(({ kind }) => kind));
  });

  await t.test('resumes by Last-Event-ID with exactly the rest, and 204 when nothing is left', async () => {
    const job = await finishedJob(server, small(22, 16));
    const path = `/v1/jobs/${job.id}/events`;
    const middle = Math.floor(job.last_seq / 2);
    const rest = await openStream(t, server, path, { headers: { 'Last-Event-ID': String(middle) } });
    await rest.untilClosed();
    assert.deepEqual(ids(rest), dense(middle + 1, job.last_seq));
    assert.equal(rest.events.at(-1).event, 'end');
    const greater = await openStream(t, server, `${path}?after=${middle + 2}`, { headers: { 'Last-Event-ID': String(middle) } });
    await greater.untilClosed();
    assert.deepEqual(ids(greater), dense(middle + 3, job.last_seq), 'of Last-Event-ID and after the greater wins');
    const none = await server.get(path, { Accept: 'text/event-stream', 'Last-Event-ID': String(job.last_seq) });
    assert.equal(none.status, 204);
  });

  await t.test('cut in the middle of a live job and opened again it misses nothing', async () => {
    const { id } = await submit(server, small(23, 60));
    const seen = [];
    for (let cuts = 0; ; ++cuts) {
      const stream = await openStream(t, server, `/v1/jobs/${id}/events`, { headers: { 'Last-Event-ID': String(seen.at(-1) ?? 0) } });
      if (stream.status === 204) break;
      const enough = 15;
      await stream.until('a few more events', ({ closed }) => closed || stream.history().length >= enough);
      seen.push(...ids(stream));
      const ended = stream.find('end');
      stream.close();
      if (ended) break;
      assert.ok(cuts < 1000);
    }
    const job = await reached(server, id, 'succeeded');
    assert.deepEqual(seen, dense(1, job.last_seq));
  });

  await t.test('kind=progress is a stream of progress alone', async () => {
    const { id } = await submit(server, small(24, 60));
    const stream = await openStream(t, server, `/v1/jobs/${id}/events?kind=progress`);
    await stream.untilClosed();
    assert.deepEqual([...new Set(stream.events.map(({ event }) => event))].sort(), ['end', 'progress']);
    assert.equal(stream.history().length, 0, 'progress has no id');
    const cells = stream.events.filter(({ event }) => event === 'progress').map(({ data }) => {
      const progress = JSON.parse(data);
      return (progress.progress ?? progress).cells;
    });
    assert.equal(cells.at(-1), 60);
    assert.ok(cells.every((count, index) => Number.isInteger(count) && (index === 0 || count >= cells[index - 1])), String(cells));
    // What a browser does by itself after the connection closed: it must be told that there is nothing more.
    const again = await server.get(`/v1/jobs/${id}/events?kind=progress`, { Accept: 'text/event-stream', 'Last-Event-ID': stream.lastEventId });
    assert.equal(again.status, 204);
  });

  await t.test('a reader that does not read holds up neither the job nor other readers', async () => {
    // Twenty thousand founders are some 15 MB of events: more than the buffers of a connection hold.
    const spec = { name: 'wide', preset: 'paper', seed: 5, until: { time_h: 0.1 }, model: { founders: { count: 20_000, radius_um: 20_000 } } };
    const { id } = await submit(server, spec);
    const path = `/v1/jobs/${id}/events`;
    const lazy = await openStream(t, server, path, { paused: true });
    const brisk = await openStream(t, server, path);
    const job = await reached(server, id, 'succeeded');
    await brisk.untilClosed();
    assert.ok(brisk.events.reduce((sum, { data }) => sum + data.length, 0) > 12e6);
    assert.deepEqual(ids(brisk), dense(1, job.last_seq));
    // Now it reads: what it got is a true beginning, and reconnecting gives the rest, however often it was cut.
    lazy.read();
    await lazy.untilClosed();
    assert.deepEqual(ids(lazy), dense(1, lazy.lastId()));
    if (!lazy.find('end')) {
      const rest = await openStream(t, server, path, { headers: { 'Last-Event-ID': String(lazy.lastId()) } });
      await rest.untilClosed();
      assert.deepEqual(ids(rest), dense(lazy.lastId() + 1, job.last_seq));
    }
  });

  await t.test('ends when the job is cancelled', async () => {
    const { id } = await submit(server, endless(25));
    const stream = await openStream(t, server, `/v1/jobs/${id}/events`);
    await stream.until('a first event', () => stream.history().length > 0);
    assert.equal((await command(server, id, 'cancel')).status, 202);
    await stream.untilClosed();
    assert.equal(JSON.parse(stream.events.at(-1).data).state, 'cancelled');
    assert.deepEqual(ids(stream), dense(1, (await show(server, id)).last_seq));
  });

  await t.test('shows a pause at once, with and without events', async () => {
    const { id } = await submit(server, endless(26));
    const streams = await Promise.all(['', '?kind=progress'].map((query) => openStream(t, server, `/v1/jobs/${id}/events${query}`)));
    const says = (state) => (stream) => {
      const last = stream.events.filter(({ event }) => event === 'progress').at(-1);
      return last !== undefined && JSON.parse(last.data).state === state;
    };
    await grown(server, id, 30);
    for (const stream of streams) await stream.until('progress of a running job', says('running'));
    await command(server, id, 'pause');
    const job = await reached(server, id, 'paused');
    for (const stream of streams) {
      await stream.until('the pause to be shown', says('paused'));
      await stream.until('the last seq to be shown', ({ events }) =>
        JSON.parse(events.findLast(({ event }) => event === 'progress').data).last_seq === job.last_seq);
      // A paused job is silent: without a wake of its own the stream would go on only with the sign of life.
      assert.equal(stream.comments, 0);
      stream.close();
    }
    await command(server, id, 'cancel');
  });

  await t.test('of an unknown job is refused', async () => {
    const response = await server.get('/v1/jobs/01890000-0000-7000-8000-000000000000/events', { Accept: 'text/event-stream' });
    assert.equal(response.status, 404);
  });
});

test('SIGTERM with twenty open streams', async (t) => {
  const server = await startServer(t);
  const { id } = await submit(server, endless(31));
  await grown(server, id, 10);
  const streams = [];
  for (let i = 0; i < 20; ++i) {
    streams.push(await openStream(t, server, `/v1/jobs/${id}/events${i % 4 === 3 ? '?kind=progress' : ''}`, { paused: i % 10 === 9 }));
  }
  const readers = streams.filter((_, index) => index % 10 !== 9);
  for (const stream of readers) await stream.until('a first event', () => stream.events.length > 0);
  // stop() holds the server to 10 s and to exit status 0.
  await server.stop();
  for (const stream of readers) {
    await stream.untilClosed();
    assert.equal(stream.events.at(-1).event, 'bye', JSON.stringify(stream.events.slice(-2)).slice(0, 500));
    assert.deepEqual(ids(stream), dense(1, stream.lastId()));
  }

  await t.test('leaves a job that goes on where the streams were cut', async () => {
    const next = await startServer(t, { data: server.data });
    const stream = await openStream(t, next, `/v1/jobs/${id}/events`, { headers: { 'Last-Event-ID': String(readers[0].lastId()) } });
    await stream.until('ten more events', () => stream.history().length >= 10);
    assert.deepEqual(ids(stream), dense(readers[0].lastId() + 1, stream.lastId()));
    stream.close();
  });
});
