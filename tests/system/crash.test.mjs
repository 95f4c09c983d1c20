// crash: kill -9 at any moment costs nothing: the history goes on from the stored events and comes out as if undisturbed.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { statSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { command, finishedJob, reached, show, submit, terminal } from './harness/jobs.mjs';
import { Server, assertSane, full, startServer, temporaryFolder } from './harness/server.mjs';
import { Stream } from './harness/stream.mjs';
import { seeded, within } from './harness/wait.mjs';

const killCount = full ? 50 : 10;
// Many points a search: it takes milliseconds, so that a kill can come between two events.
const spec = { name: 'killed', seed: 41, preset: 'paper', until: { cells: full ? 600 : 200 }, model: { search: { points: 8192 } } };

/** Every row of a table of the only job of DATA, as the sqlite3 shell reads it beside the running server. */
function rows(data, table) {
  const query = (sql) => execFileSync('sqlite3', ['-batch', '-noheader', `file:${join(data, 'colony.db')}?mode=ro`, sql],
    { encoding: 'utf8', maxBuffer: 1 << 30 });
  const columns = query(`select name from pragma_table_info('${table}')`).split('\n').filter((name) => name && name !== 'job_key');
  const order = columns.find((name) => name === 'seq' || name === 'time_h');
  assert.equal(order, table === 'series' ? 'time_h' : 'seq', `table ${table} has its order`);
  // quote() prints doubles to 15 digits only; their bytes are compared through a text that round-trips.
  const exact = columns.map((name) => `case typeof("${name}") when 'real' then printf('%!.17g', "${name}") else quote("${name}") end`);
  return query(`select ${exact.join(" || '|' || ")} from "${table}" order by "${order}", ${columns.map((name) => `"${name}"`).join(', ')}`)
    .split('\n').filter(Boolean);
}

/** Follows the job until a watcher has seen event `seq` (or the job ended), then the process is killed at once. */
async function killAt(server, id, seq) {
  const stream = new Stream(server.port, `/v1/jobs/${id}/events?after=${Math.max(0, seq - 1)}`);
  await within(60_000, stream.opened, 'the stream to open');
  await stream.until(`event ${seq}`, () => stream.closed || stream.events.some(({ id: seen }) => Number(seen) >= seq), 240_000);
  await server.kill();
  const seen = stream.lastId();
  stream.close();
  return seen;
}

test('kill -9', async (t) => {
  const quiet = await startServer(t);
  const reference = await finishedJob(quiet, spec);
  const expected = Object.fromEntries(['event', 'placement', 'woken', 'series'].map((table) => [table, rows(quiet.data, table)]));
  assert.ok(expected.event.length === reference.last_seq && expected.placement.length >= 2 * (spec.until.cells - 1));
  assert.equal(expected.series.length, Math.floor(reference.progress.time_h) + 1, 'a row for every whole hour');

  await t.test(`${killCount} times at random events: the same digest and the same rows`, async () => {
    const seed = Number(process.env.COLONY_TEST_SEED ?? 20261122);
    const random = seeded(seed);
    // The last third is the job's own, so that it cannot end while the last kill is on its way.
    const moments = Array.from({ length: killCount }, () => 1 + Math.floor(random() * 0.7 * reference.last_seq)).sort((a, b) => a - b);
    t.diagnostic(`seed ${seed}, kills at events ${moments.join(' ')}`);
    const data = temporaryFolder(t);
    let server = await new Server(data, []).ready();
    const { id } = await submit(server, spec);
    let kills = 0; // of a server whose job was not at its end when the next one was up
    for (const [index, moment] of moments.entries()) {
      const seen = await killAt(server, id, moment);
      server = new Server(data, []);
      if (index % 3 === 2) {
        // Once more, as soon as it listens or before: a recovery can be interrupted too.
        if (index % 2) await within(60_000, server.listening, 'colonyd to listen');
        await server.kill();
        server = new Server(data, []);
      }
      await server.ready();
      const job = await show(server, id);
      assert.ok(job.last_seq >= seen, `event ${seen} was seen by a watcher and is gone: ${job.last_seq}`);
      if (terminal.includes(job.state)) break;
      ++kills;
    }
    t.diagnostic(`${kills} kills in the middle of the job`);
    try {
      assert.equal(kills, killCount, 'the job ended before its last kill');
      const job = await reached(server, id, 'succeeded', 600_000);
      assert.deepEqual([job.digest, job.last_seq], [reference.digest, reference.last_seq]);
      for (const [table, wanted] of Object.entries(expected)) {
        const found = rows(data, table);
        const differing = wanted.findIndex((row, index) => row !== found[index]);
        assert.ok(differing < 0 && found.length === wanted.length,
          `${table}: ${found.length} rows for ${wanted.length}; first difference:\n${wanted[differing]}\n${found[differing]}`);
      }
      assert.equal(execFileSync('sqlite3', ['-batch', `file:${join(data, 'colony.db')}?mode=ro`, 'pragma integrity_check'], { encoding: 'utf8' }).trim(), 'ok');
    } finally {
      await server.stop();
    }
  });

  await t.test('right after a submission was answered: the job is there, and its key too', async () => {
    const data = temporaryFolder(t);
    const killed = await new Server(data, []).ready();
    const key = { 'Idempotency-Key': 'kept' };
    const { id } = await submit(killed, spec, key);
    await killed.kill();
    const server = await startServer(t, { data });
    const again = await server.post('/v1/jobs', spec, key);
    assert.deepEqual([again.status, again.json.id], [200, id]);
    assert.equal((await command(server, id, 'cancel')).status, 202);
    await server.kill();
    const next = await startServer(t, { data });
    await reached(next, id, 'cancelled');
  });
});

test('DATA belongs to one server', async (t) => {
  const first = await startServer(t);
  const second = new Server(first.data, []);
  second.expectedToDie = true;
  const end = await within(60_000, second.exited, 'the second server to give up');
  assert.ok(end.code !== 0 && end.signal === null, `it refuses: ${JSON.stringify(end)}`);
  assertSane(second.err);
  assert.match(second.err, /lock|in use|another/i);
  assert.equal((await first.get('/readyz')).status, 200, 'the first goes on');
  await first.kill();
  const third = await startServer(t, { data: first.data });
  assert.equal((await third.get('/readyz')).status, 200, 'a dead server leaves no lock behind');
});

test('a new DATA is private, and its database says its version', async (t) => {
  const data = join(temporaryFolder(t), 'new');
  await startServer(t, { data });
  assert.equal(statSync(data).mode & 0o777, 0o700);
  const version = execFileSync('sqlite3', ['-batch', `file:${join(data, 'colony.db')}?mode=ro`, 'pragma user_version'], { encoding: 'utf8' });
  assert.ok(Number(version) >= 1, version);
});

test('a server that cannot serve says why and ends', async (t) => {
  const data = temporaryFolder(t);
  const cases = [[['--jobs.made-up', '1'], /made-up/], [['--jobs.concurrent-max', 'many'], /concurrent/], [['--listen', '0.0.0.0:0'], /listen|loopback/]];
  for (const [args, text] of cases) {
    const server = new Server(join(data, 'new'), args);
    server.expectedToDie = true;
    const end = await within(60_000, server.exited, 'the server to give up');
    assert.ok(end.code !== 0 && end.signal === null, `${args}: ${JSON.stringify(end)}`);
    assert.match(server.err, text);
    assertSane(server.err);
  }
});
