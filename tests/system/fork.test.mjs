// fork: another way on from a moment of a history, and the proof that a history is what its specs make.
import assert from 'node:assert/strict';
import { execFile, execFileSync } from 'node:child_process';
import { join } from 'node:path';
import test from 'node:test';
import { cleanup } from './harness/cleanup.mjs';
import { allEvents, command, endless, finishedJob, grown, reached, show, small, submit } from './harness/jobs.mjs';
import { Server, cleanEnvironment, cliBinary, full, startServer, temporaryFolder } from './harness/server.mjs';
import { eventually } from './harness/wait.mjs';

const fork = (server, id, body, headers) => server.post(`/v1/jobs/${id}/fork`, body, headers);
const verify = (server, id, headers = {}) => server.post(`/v1/jobs/${id}/verify`, undefined, { 'Content-Type': 'application/json', ...headers });
const sql = (data, text) => execFileSync('sqlite3', ['-batch', join(data, 'colony.db'), text], { encoding: 'utf8' }).trim();

async function forked(server, id, body, headers) {
  const response = await fork(server, id, body, headers);
  assert.equal(response.status, 201, response.text);
  assert.equal(response.headers.location, `/v1/jobs/${response.json.id}`);
  return response.json;
}

async function verified(server, id) {
  const response = await verify(server, id);
  assert.equal(response.status, 201, response.text);
  assert.equal(response.json.kind, 'verify');
  return reached(server, response.json.id, 'succeeded');
}

function colony(server, args) {
  return new Promise((done) => {
    execFile(cliBinary, args, { env: { ...cleanEnvironment(), HOME: server.data, COLONY_SERVER: server.url } },
      (error, out, err) => done({ code: error ? error.code : 0, out, err }));
  });
}

test('a fork', async (t) => {
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '2', '--jobs.threads-per-job', '1'] }); // a verification beside a job without end
  const origin = await finishedJob(server, small(7, 40));
  const history = await allEvents(server, origin.id);
  const middle = history[Math.floor(history.length / 2)];

  await t.test('with the same seed and model is the same history', async () => {
    const made = await forked(server, origin.id, { at_seq: middle.seq, until: { cells: 40 }, labels: { plate: 'b' } });
    assert.deepEqual([made.kind, made.name, made.labels], ['colony', '', { plate: 'b' }]);
    assert.deepEqual([made.origin.job_id, made.origin.at_seq, made.origin.origin], [origin.id, middle.seq, null]);
    assert.deepEqual(made.origin.spec, origin.spec);
    assert.equal(made.spec.seed, origin.spec.seed);
    const job = await reached(server, made.id, 'succeeded');
    assert.equal(job.digest, origin.digest);
    assert.deepEqual(await allEvents(server, job.id), history);
    assert.deepEqual((await server.get(`/v1/jobs/${job.id}/series`)).json, (await server.get(`/v1/jobs/${origin.id}/series`)).json);
    const of = (events) => events.filter((event) => event.cell_id === 2);
    assert.deepEqual((await server.get(`/v1/jobs/${job.id}/events?cell_id=2&kind=settled`)).json.items, of(history).filter(({ kind }) => kind === 'settled'));
  });

  await t.test('with another model differs after its moment only, forks again, and is verified by each spec on its stretch', async () => {
    const between = (middle.time_h + history[middle.seq].time_h) / 2;
    const child = await forked(server, origin.id, { at_h: between, model: { cycle: { mean_h: 15 }, contact: { fitness_min: 0.6 } }, until: { cells: 60 } });
    const childJob = await reached(server, child.id, 'succeeded');
    const events = await allEvents(server, child.id);
    const { at_seq: seq } = child.origin;
    assert.equal(seq, history.filter(({ time_h: h }) => h <= between).length);
    assert.deepEqual(events.slice(0, seq), history.slice(0, seq));
    assert.notDeepEqual(events.slice(seq, seq + 30), history.slice(seq, seq + 30));
    const grandchild = await forked(server, child.id, { at_seq: childJob.last_seq, seed: 99, until: { cells: 80 } });
    assert.equal(grandchild.origin.at_seq, childJob.last_seq - 1, '`finished` is never copied');
    assert.equal(grandchild.origin.origin.job_id, origin.id);
    assert.equal(grandchild.spec.model.cycle.mean_h, 15, 'the model is that of the origin');
    const last = await reached(server, grandchild.id, 'succeeded');
    for (const job of [origin, childJob, last]) {
      const proof = await verified(server, job.id);
      assert.deepEqual(proof.result, { identical: true, events: job.last_seq, first_differing_seq: null, expected_digest: null, actual_digest: null, message: null });
      assert.deepEqual([proof.spec, proof.reason], [{ job_id: job.id, to_seq: job.last_seq }, 'identical']);
      assert.deepEqual((await allEvents(server, proof.id)).map(({ kind, reason }) => [kind, reason]), [['finished', 'identical']]);
    }
    assert.equal((await server.request('DELETE', `/v1/jobs/${origin.id}`)).status, 204);
    assert.equal((await verified(server, last.id)).result.identical, true, 'the copy needs no origin');
    assert.equal((await fork(server, origin.id, { at_seq: 5, until: { cells: 50 } })).status, 404);
  });

  await t.test('of a live job copies what is committed, and a key makes one job', async () => {
    const { id } = await submit(server, endless());
    const live = await grown(server, id, 60);
    const body = { at_seq: live.last_seq, until: { time_h: live.progress.time_h + 500, cells: live.progress.cells + 40 }, seed: 5 };
    const key = { 'Idempotency-Key': 'one fork' };
    const both = await Promise.all([fork(server, id, body, key), fork(server, id, body, key)]);
    assert.deepEqual(both.map(({ status }) => status).sort(), [200, 201]);
    assert.equal(both[0].json.id, both[1].json.id);
    assert.equal((await fork(server, id, { ...body, seed: 6 }, key)).status, 422);
    assert.equal((await fork(server, id, { ...body, at_seq: live.last_seq + 1_000_000 })).json.type, 'urn:colony:problem:time-not-reached');
    assert.equal((await fork(server, id, { at_h: 9_000, until: { cells: 900_000 } })).status, 409);
    assert.equal((await verified(server, id)).result.identical, true, 'a live job up to what it had');
    assert.equal((await command(server, id, 'cancel')).status, 202);
    assert.equal((await fork(server, id, body, key)).status, 200);
    await reached(server, both[0].json.id, 'succeeded');
  });
});

test('forks that cannot be', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, { ...small(7, 24), model: { dish: { radius_um: 400 } } });
  const at = { at_seq: 40, until: { cells: 60 } };
  const cases = [
    [{ until: { cells: 60 } }, ['']], [{ ...at, at_h: 3 }, ['']], [{ at_seq: 40 }, ['/until']], [{ ...at, at_seq: 0 }, ['/at_seq']],
    [{ ...at, at_seq: job.last_seq + 1 }, ['/at_seq']], [{ at_h: -1, until: { cells: 60 } }, ['/at_h']],
    [{ ...at, until: { cells: 2 } }, ['/until/cells']], [{ at_h: 30, until: { time_h: 30 } }, ['/until/time_h']],
    [{ ...at, preset: 'tumour' }, ['/preset']], [{ ...at, seed: -1 }, ['/seed']], [{ ...at, model: { layer: 'multi' } }, ['/model/layer']],
    [{ ...at, model: { layers: 'multi', noise: { phase: 1 }, founders: { count: 2 }, wake: { free_radius_um: 20 }, motility: { rate_per_h: 0.2 },
      cell: { nucleus_radius_um: [2, 2.5] } } },
    ['/model/cell/nucleus_radius_um', '/model/founders/count', '/model/layers', '/model/motility/rate_per_h', '/model/noise/phase', '/model/wake/free_radius_um']],
    [{ ...at, model: { cell: { pair_volume_um3: [800, 2000] } } }, ['/model/cell/pair_volume_um3']],
    [{ ...at, model: { dish: { radius_um: 20 } } }, ['/model/dish/radius_um']], [{ ...at, model: { cycle: { mean_h: 900 } } }, ['/model/cycle/mean_h']],
  ];
  for (const [body, pointers] of cases) {
    const response = await fork(server, job.id, body);
    assert.equal(response.status, 422, `${JSON.stringify(body)}: ${response.text}`);
    const found = response.json.errors.map(({ pointer, parameter }) => pointer ?? parameter);
    for (const pointer of pointers) assert.ok(found.includes(pointer), `${JSON.stringify(body)}: ${pointer} in ${found}`);
  }
  const counts = (await server.get('/v1/jobs/counts')).json;
  assert.equal(Object.values(counts).reduce((a, b) => a + b), 1, 'nothing was stored');
  const proof = await verified(server, job.id);
  for (const response of [await fork(server, proof.id, at), await verify(server, proof.id)]) assert.equal(response.status, 422, response.text);
  for (const path of ['cells', 'series', 'image', 'mesh', 'analysis', 'lineage']) {
    assert.equal((await server.get(`/v1/jobs/${proof.id}/${path}`)).status, 404, `a verification has no ${path}`);
  }
  assert.equal((await server.post(`/v1/jobs/${job.id}/verify`, { fast: true })).status, 422);
  assert.equal((await verify(server, '01890000-0000-7000-8000-000000000001')).status, 404);
});

test('a tampered history is found out, and names the event', async (t) => {
  const data = temporaryFolder(t);
  let server = await new Server(data, []).ready();
  cleanup(t, () => server.stop());
  const job = await finishedJob(server, small(7, 24));
  const divided = (await allEvents(server, job.id)).filter(({ kind }) => kind === 'divided');
  await server.stop();
  const { seq, digest } = divided[Math.floor(divided.length / 2)];
  sql(data, `update placement set volume_um3 = volume_um3 + 1e-9 where seq = ${seq} and slot = 1`);
  server = await new Server(data, []).ready();
  const proof = await verified(server, job.id);
  assert.deepEqual([proof.reason, proof.result.identical, proof.result.first_differing_seq, proof.result.events], ['different', false, seq, seq - 1]);
  assert.equal(proof.result.expected_digest, digest);
  assert.match(proof.result.actual_digest, /^[0-9a-f]{32}$/);
  assert.notEqual(proof.result.actual_digest, digest);
  const { code, out } = await colony(server, ['verify', job.id, '--watch']);
  assert.equal(code, 1, out);
  assert.match(out, new RegExp(`different: event ${seq},`));
});

test('kill -9', async (t) => {
  const data = temporaryFolder(t);
  let server = await new Server(data, []).ready();
  cleanup(t, () => server.stop());
  const spec = { name: 'long', seed: 3, preset: 'paper', until: { cells: full ? 4000 : 1200 }, model: { division: { generation_limit: null }, search: { population: 8, generations: 2, points: 64 } } };
  const origin = await finishedJob(server, spec);

  await t.test('during a fork leaves the whole fork or nothing', async (s) => {
    let whole = 0;
    for (let round = 0; round < 4; ++round) {
      const asked = fork(server, origin.id, { at_seq: origin.last_seq - 1, until: { cells: spec.until.cells + 5 }, seed: round }, { 'Idempotency-Key': `k${round}` }).catch(() => undefined);
      // Killed as soon as the copy has begun, as seen in the database, or after the answer.
      await eventually('the copy to begin', () => Number(sql(data, 'select count(*) from job')) > 1 + whole, 60_000);
      const answer = round % 2 ? await asked : undefined;
      await server.kill();
      await asked;
      server = await new Server(data, []).ready();
      const { items } = (await server.get('/v1/jobs')).json;
      for (const job of items) {
        if (job.id === origin.id) continue;
        assert.ok(job.last_seq >= origin.last_seq - 1, `a fork of ${job.last_seq} events is no whole one`);
      }
      // The same key again: the job that is there, or a new one, but never two.
      const again = await fork(server, origin.id, { at_seq: origin.last_seq - 1, until: { cells: spec.until.cells + 5 }, seed: round }, { 'Idempotency-Key': `k${round}` });
      assert.ok(answer ? again.status === 200 && again.json.id === answer.json.id : [200, 201].includes(again.status), again.text);
      s.diagnostic(`round ${round}: ${again.status === 200 ? 'whole' : 'nothing'} after the kill`);
      await reached(server, again.json.id, 'succeeded');
      ++whole;
      assert.equal((await server.get('/v1/jobs')).json.items.length, 1 + whole);
      await eventually('the rest to be swept', () => Number(sql(data, 'select count(*) from job')) === 1 + whole, 60_000);
    }
  });

  await t.test('during a verification begins it again; a job that has ended never changes', async () => {
    const { json } = await verify(server, origin.id);
    await eventually('the verification to be on its way', async () => {
      const job = await show(server, json.id);
      return job.state === 'succeeded' || (job.progress.fraction ?? 0) > 0;
    }, 60_000);
    await server.kill();
    server = await new Server(data, []).ready();
    const proof = await reached(server, json.id, 'succeeded');
    assert.equal(proof.result.events, origin.last_seq);
    for (const name of ['cancel', 'pause', 'resume']) assert.equal((await command(server, json.id, name)).status, 409);
    assert.deepEqual(await show(server, json.id), proof);
    assert.deepEqual((await show(server, origin.id)).revision, origin.revision);
  });
});

test('old histories go when there is a bound, and the log of the server says so', async (t) => {
  const data = temporaryFolder(t);
  let server = await new Server(data, []).ready();
  cleanup(t, () => server.stop());
  const oldest = await finishedJob(server, small(1, 24));
  const kept = await finishedJob(server, { ...small(2, 24), labels: { keep: 'true' } });
  await server.stop();
  server = await new Server(data, ['--jobs.keep-bytes', '4096']).ready();
  await eventually('the oldest to go', async () => (await server.get(`/v1/jobs/${oldest.id}`)).status === 404, 60_000);
  assert.equal((await server.get(`/v1/jobs/${kept.id}`)).status, 200);
  assert.match(server.err, new RegExp(`retention: job ${oldest.id} is removed`));
});

test('the command line', async (t) => {
  const server = await startServer(t);
  const origin = await finishedJob(server, small(7, 24));
  const made = await colony(server, ['fork', origin.id.slice(-8), '--at-h', '30.5', '--set', 'model.cycle.mean_h=14', '--seed', '4', '--until-h', '90', '--name', 'slower', '--watch']);
  assert.equal(made.code, 0, made.err);
  const id = /forked: ([0-9a-f-]{36})/.exec(made.out)[1];
  const shown = await colony(server, ['show', id]);
  assert.match(shown.out, new RegExp(`origin.job_id: ${origin.id}`));
  assert.match(shown.out, /origin.spec: \(--json shows it\)/);
  assert.equal((await show(server, id)).spec.model.cycle.mean_h, 14);
  const proof = await colony(server, ['verify', id, '--watch']);
  assert.deepEqual([proof.code, /identical: \d+ events found the same/.test(proof.out)], [0, true], proof.out + proof.err);
  assert.equal((await colony(server, ['fork', id, '--until-h', '99'])).code, 2);
  assert.equal((await colony(server, ['fork', id, '--at-seq', '30', '--until-cells', '1'])).code, 4);
});
