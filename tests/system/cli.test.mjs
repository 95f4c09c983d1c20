// cli: the real `colony` program against the real server, as a person and as a script use it.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { allEvents, command, endless, finishedJob, grown, reached, show, small, submit } from './harness/jobs.mjs';
import { assertSane, cleanEnvironment, cliBinary, startServer, temporaryFolder } from './harness/server.mjs';
import { eventually, within } from './harness/wait.mjs';

const exit = { done: 0, failed: 1, usage: 2, unreachable: 3, refused: 4, cancelled: 5, interrupted: 130 };

/** Starts the program with nothing of the surroundings but what is given; {out, err} grow, `ended` gives the exit status. */
function start(args, { server, cwd, input, env = {} } = {}) {
  assert.ok(existsSync(cliBinary), `${cliBinary} is not built`);
  const child = spawn(cliBinary, args, { cwd, env: { ...cleanEnvironment(), HOME: cwd ?? '/nonexistent', ...(server ? { COLONY_SERVER: server.url } : {}), ...env } });
  const run = { child, out: Buffer.alloc(0), err: '' };
  child.stdout.on('data', (bytes) => { run.out = Buffer.concat([run.out, bytes]); });
  child.stderr.on('data', (bytes) => { run.err += bytes; });
  child.stdin.on('error', () => {});
  child.stdin.end(input ?? '');
  run.ended = within(240_000, new Promise((done, fail) => {
    child.on('error', fail);
    child.on('close', (code, signal) => done(code ?? signal));
  }), `colony ${args.join(' ')}`).catch((error) => {
    child.kill('SIGKILL');
    throw error;
  });
  return run;
}

async function colony(args, options) {
  const run = start(args, options);
  run.code = await run.ended;
  assertSane(run.err);  // a sanitizer's exit status is that of a failed job
  return run;
}

test('the command line', async (t) => {
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '2'] });
  const cwd = temporaryFolder(t);
  const at = { server, cwd };
  const ok = async (...args) => {
    const run = await colony(args, at);
    assert.equal(run.code, exit.done, `colony ${args.join(' ')}\n${run.out}${run.err}`);
    return run;
  };
  const json = async (...args) => JSON.parse((await ok(...args, '--json')).out.toString());

  await t.test('submit --watch follows a job to success, in plain lines when not at a terminal', async () => {
    const run = await ok('submit', '--preset', 'paper', '--seed', '3', '--until-cells', '12', '--set', 'model.cycle.mean_h=10',
      '--name', 'by hand', '--label', 'plate=7', '--watch');
    const text = `${run.out}${run.err}`;
    assert.match(text, /succeeded/);
    assert.match(text, /12 cells/);
    assert.doesNotMatch(text, /\x1b|\r/, 'no terminal control');
    const { json: page } = await server.get('/v1/jobs?name=by%20hand');
    assert.deepEqual([page.items.length, page.items[0].spec.model.cycle.mean_h, page.items[0].labels], [1, 10, { plate: '7' }]);
    assert.equal(page.items[0].spec.seed, 3);
  });

  await t.test('a spec from a file and from standard input; flags win', async () => {
    writeFileSync(join(cwd, 'spec.json'), JSON.stringify(small(5, 3)));
    const quiet = await ok('submit', 'spec.json', '--seed', '6', '--quiet');
    const job = await show(server, quiet.out.toString().trim());
    assert.deepEqual([job.spec.seed, job.spec.until.cells], [6, 3]);
    const piped = await colony(['submit', '-', '--quiet'], { ...at, input: JSON.stringify(small(8, 3)) });
    assert.equal(piped.code, exit.done, piped.err);
    assert.equal((await show(server, piped.out.toString().trim())).spec.seed, 8);
  });

  await t.test('a refused spec: exit 4 and the field on standard error', async () => {
    // Jobs of before may still be running: how many there are is what must not change.
    const stored = async () => Object.values(await server.counts()).reduce((sum, count) => sum + count, 0);
    const before = await stored();
    const run = await colony(['submit', '--preset', 'paper', '--until-cells', '5', '--set', 'model.noise.amplitude=0.9', '--set', 'model.made_up=1'], at);
    assert.equal(run.code, exit.refused, run.err);
    assert.match(run.err, /model[./]noise[./]amplitude/);
    assert.match(run.err, /model[./]made_up/);
    assert.equal(run.out.length, 0);
    assert.equal(await stored(), before);
    assert.equal((await colony(['show', '01890000-0000-7000-8000-000000000000'], at)).code, exit.refused);
  });

  await t.test('wrong usage: exit 2', async () => {
    const cases = [['submit', '--colour', 'red'], ['made-up'], ['show'], ['submit'], ['submit', '--set', 'no-equals-sign'], ['submit', 'absent.json'],
      ['submit', '--preset', 'paper', '--seed', 'x', '--until-cells', '5'], ['show', 'zz']];
    for (const args of cases) {
      const run = await colony(args, at);
      assert.equal(run.code, exit.usage, `colony ${args.join(' ')}: ${run.err}`);
      assert.notEqual(run.err, '');
    }
    const help = await colony(['--help'], { cwd });
    assert.equal(help.code, exit.done);
    for (const name of ['submit', 'list', 'show', 'watch', 'events', 'cells', 'series', 'image', 'cancel', 'pause', 'resume', 'delete', 'founders']) {
      assert.match(help.out.toString(), new RegExp(`\\b${name}\\b`));
    }
  });

  await t.test('no server there: exit 3, naming the address', async () => {
    // A port that was ours a moment ago and that nobody listens on.
    const gone = await startServer(t);
    await gone.stop();
    const run = await colony(['list', '--server', gone.url], { cwd });
    assert.equal(run.code, exit.unreachable, run.err);
    assert.match(run.err, new RegExp(`127\\.0\\.0\\.1:${gone.port}`));
  });

  await t.test('a job cancelled elsewhere: watch ends with exit 5', async () => {
    const { id } = await submit(server, endless(3));
    await grown(server, id, 5);
    const watching = start(['watch', id], at);
    await eventually('the watcher to say something', () => watching.out.length + watching.err.length > 0);
    assert.equal((await ok('cancel', id)).code, exit.done);
    assert.equal(await watching.ended, exit.cancelled, watching.err);
  });

  await t.test('an interrupted watch: exit 130, and the job goes on', async () => {
    const { id } = await submit(server, endless(4));
    await grown(server, id, 5);
    const watching = start(['watch', id], at);
    await eventually('the watcher to say something', () => watching.out.length + watching.err.length > 0);
    watching.child.kill('SIGINT');
    assert.equal(await watching.ended, exit.interrupted, watching.err);
    assert.equal((await show(server, id)).state, 'running');
    assert.equal((await command(server, id, 'cancel')).status, 202);
  });

  await t.test('the server restarts under a watcher, who sees the end all the same', async () => {
    const data = temporaryFolder(t);
    const first = await startServer(t, { data });
    const { id } = await submit(first, small(17, 150));
    await grown(first, id, 20);
    const watching = start(['watch', id], { server: first, cwd });
    await eventually('the watcher to say something', () => watching.out.length + watching.err.length > 0);
    const { port } = first;
    await first.stop();
    const second = await startServer(t, { data, args: ['--listen', `127.0.0.1:${port}`] });
    assert.equal(await watching.ended, exit.done, watching.err);
    assert.equal((await show(second, id)).state, 'succeeded');
  });

  await t.test('--json parses everywhere, and a unique end of an id is enough', async () => {
    const job = await finishedJob(server, small(9, 6));
    const suffix = job.id.slice(-12);
    assert.equal((await json('show', suffix)).id, job.id);
    assert.ok((await json('list')).items.some(({ id }) => id === job.id));
    assert.equal((await json('list', '--state', 'succeeded', '--limit', '1')).items.length, 1);
    assert.equal((await json('submit', '--preset', 'paper', '--until-cells', '2', '--seed', '1')).spec.until.cells, 2);
    assert.equal((await json('submit', '--preset', 'paper', '--until-cells', '2', '--seed', '1', '--dry-run')).spec.model.cycle.mean_h, 12);
    const { id } = await submit(server, endless(5));
    await grown(server, id, 3);
    assert.equal((await json('pause', id)).id, id);
    await reached(server, id, 'paused');
    assert.equal((await json('resume', id)).id, id);
    assert.equal((await json('cancel', id)).id, id);
    await reached(server, id, 'cancelled');
    await ok('delete', id);
    assert.equal((await server.get(`/v1/jobs/${id}`)).status, 404);
  });

  await t.test('events, cells and series are the server\'s own rows', async () => {
    const job = await finishedJob(server, small(9, 6));
    const events = await allEvents(server, job.id);
    const parsed = (run) => {
      const text = run.out.toString();
      try {
        return JSON.parse(text).items;
      } catch {
        return text.split('\n').filter(Boolean).map((line) => JSON.parse(line));
      }
    };
    assert.deepEqual(parsed(await ok('events', job.id, '--json')), events);
    assert.deepEqual(parsed(await ok('cells', job.id, '--json')), (await server.get(`/v1/jobs/${job.id}/cells`)).json.items);
    assert.deepEqual(parsed(await ok('series', job.id, '--json')), (await server.get(`/v1/jobs/${job.id}/series`)).json.items);
    assert.deepEqual(parsed(await ok('events', job.id, '--ndjson')), events);
    assert.deepEqual(parsed(await ok('events', job.id, '--ndjson', '--kind', 'divided')), events.filter(({ kind }) => kind === 'divided'));
    for (const what of ['events', 'cells', 'series']) {
      const csv = (await server.get(`/v1/jobs/${job.id}/${what}`, { Accept: 'text/csv' })).text;
      assert.equal((await ok(what, job.id, '--csv')).out.toString(), csv, what);
      assert.notEqual((await ok(what, job.id)).out.length, 0, `${what} as a table`);
    }
    const { id } = await submit(server, small(10, 40));
    const followed = await ok('events', id, '--follow', '--ndjson');
    assert.deepEqual(parsed(followed), await allEvents(server, id), 'followed live to the end');
  });

  await t.test('image writes a file that appears whole or not at all', async () => {
    const job = await finishedJob(server, small(9, 6));
    await ok('image', job.id, '-o', 'colony.png');
    const png = readFileSync(join(cwd, 'colony.png'));
    assert.deepEqual(png.subarray(0, 8).toString('latin1'), '\x89PNG\r\n\x1a\n');
    assert.ok(png.equals((await server.get(`/v1/jobs/${job.id}/image`)).body));
    const folder = join(cwd, 'pictures');
    mkdirSync(folder);
    assert.equal((await colony(['image', '01890000-0000-7000-8000-000000000000', '-o', join(folder, 'none.png')], at)).code, exit.refused);
    assert.deepEqual(readdirSync(folder), []);
  });
});

test('founders from a colony-tracking table', async (t) => {
  const server = await startServer(t);
  const cwd = temporaryFolder(t);

  await t.test('of a small table: positions in um, origin in the middle, y up', async () => {
    const rows = ['"track","time","Y","X","Area"', '1,3,10,20,30', '1,0,100,100,30', '2,0,300,100,31', '3,0,200,400,29', '2,3,0,0,5'];
    writeFileSync(join(cwd, 'tracks.csv'), `${rows.join('\n')}\n`);
    const run = await colony(['founders', 'tracks.csv', '--um-per-px', '2', '--until-time', '3', '--seed', '1', '-o', 'spec.json'], { cwd });
    assert.equal(run.code, exit.done, run.err);
    const spec = JSON.parse(readFileSync(join(cwd, 'spec.json'), 'utf8'));
    // The mean position is (200, 200) px.
    assert.deepEqual(spec.model.founders.positions_um, [[-200, 200], [-200, -200], [400, 0]]);
    assert.deepEqual([spec.until.time_h, spec.seed], [3, 1]);
    const grow = await colony(['submit', 'spec.json', '--watch'], { server, cwd });
    assert.equal(grow.code, exit.done, grow.err);
  });

  await t.test('of a wrong table: exit 2 and the line', async () => {
    writeFileSync(join(cwd, 'wrong.csv'), 'track,time,y,x\n1,0,5,5\n2,0,five,6\n');
    const run = await colony(['founders', 'wrong.csv', '--um-per-px', '2', '--until-time', '3', '--seed', '1'], { cwd });
    assert.equal(run.code, exit.usage);
    assert.match(run.err, /wrong\.csv:3/);
  });

  const tracks = join(process.env.COLONY_DATA ?? '', 'h3122_clonogenic_tracks.csv');
  const absent = process.env.COLONY_DATA && existsSync(tracks) ? false : 'the real data is absent (COLONY_DATA)';
  await t.test('of 340 real colonies', { skip: absent }, async () => {
    const run = await colony(['founders', tracks, '--um-per-px', '3.2', '--until-time', '2', '--seed', '1', '--dish-radius-um', '4500',
      '-o', 'real.json'], { cwd });
    assert.equal(run.code, exit.done, run.err);
    const spec = JSON.parse(readFileSync(join(cwd, 'real.json'), 'utf8'));
    const count = spec.model.founders.positions_um.length;
    assert.ok(count > 300 && count <= 340, String(count));
    const job = await finishedJob(server, spec);
    assert.equal((await server.get(`/v1/jobs/${job.id}/cells?at_h=0`)).json.items.length, count);
  });
});
