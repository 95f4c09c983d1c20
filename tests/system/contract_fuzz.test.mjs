// contract_fuzz: each operation of /openapi.json, with requests made from its schemas and with broken ones. A 5xx, an answer that the document does not
// state, a right request called malformed or a wrong one let through fails; after every refusal everything stored is as before.
// FUZZ_SEED repeats a run. The reduced run has a seed of its own, so that a red run is the fault of what was changed; the full run draws one.
import assert from 'node:assert/strict';
import test from 'node:test';
import fc from 'fast-check';
import { Plan, nobody } from './fuzzing/plan.mjs';
import { command, finishedJob, grown, endless, reached, show, small, submit, terminal } from './harness/jobs.mjs';
import { discs } from './harness/png.mjs';
import { full, startServer } from './harness/server.mjs';
import { eventually } from './harness/wait.mjs';

const seed = Number(process.env.FUZZ_SEED ?? (full ? Date.now() % 2 ** 31 : 20261125));
const rightRuns = full ? 400 : 6;
const brokenRuns = full ? 2000 : 24;
const methods = ['get', 'post', 'patch', 'put', 'delete'];

/** Seconds each, whatever is asked: these are asked less. (Comparisons are made by the setting up and by openapi_examples as well.) */
const slow = ['compare', 'drawComparison', 'measureJob', 'getMesh'];

/** What a request that fits may still get: states, conditions and rules between fields. */
const lawful = [409, 412, 422, 428];

test('every operation, with right and with broken requests', async (t) => {
  t.diagnostic(`FUZZ_SEED=${seed}`);
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '1'] });
  const { contract } = server;
  const job = await finishedJob(server, small(3, 4));
  const { id: paused } = await submit(server, endless());
  await grown(server, paused, 5);
  assert.equal((await command(server, paused, 'pause')).status, 202);
  await reached(server, paused, 'paused');
  const picture = discs(3, 6);
  const analysis = await server.request('POST', '/v1/analyses', { body: picture, headers: { 'Content-Type': 'image/png' } });
  assert.equal(analysis.status, 201, analysis.text);
  const comparison = await server.post('/v1/comparisons', { job_id: job.id, analysis_id: analysis.json.id });
  assert.equal(comparison.status, 201, comparison.text);
  const kept = new Set([job.id, paused]);
  const figures = { operations: 0, right: 0, taken: 0, broken: 0 };

  const listed = ['/v1/jobs', '/v1/analyses', '/v1/comparisons', '/v1/tokens'].filter(
    (path) => contract.openapi.paths[path]?.get,
  );
  /** Everything that a request could have changed. */
  const everything = async () => {
    const lists = await Promise.all(listed.map((path) => server.get(path)));
    return lists.map(({ json }) => json.items.map(({ id, revision, state, last_seq }) => [id, revision, state, last_seq]));
  };
  /** What right requests made goes again: the jobs cost time, and the next comparison of everything is short. */
  const clear = async () => {
    for (const { id, state } of (await server.get('/v1/jobs?limit=500')).json.items) {
      if (kept.has(id)) continue;
      if (!terminal.includes(state)) await command(server, id, 'cancel');
      await eventually(`job ${id} to end`, async () => terminal.includes((await show(server, id)).state));
      assert.equal((await server.request('DELETE', `/v1/jobs/${id}`)).status, 204);
    }
    for (const path of listed.slice(1)) {
      for (const { id } of (await server.get(path)).json.items) {
        if (id !== analysis.json.id && id !== comparison.json.id)
          assert.equal((await server.request('DELETE', `${path}/${id}`)).status, 204);
      }
    }
  };
  const exchange = async ({ method, path, headers, body }) => {
    const response = await server.request(method, path, { headers, body });
    assert.ok(response.status < 500, `${response.status}: ${response.text}`);
    return response;
  };

  const operations = Object.entries(contract.openapi.paths).flatMap(([template, item]) =>
    methods
      .filter((method) => item[method])
      .map((method) => ({ method: method.toUpperCase(), template, operation: item[method] })),
  );
  for (const each of operations) {
    // What removes or moves a job on finds the finished one, which refuses.
    const removes = each.method === 'DELETE' || each.method === 'POST';
    const plan = new Plan(contract, each, {
      picture,
      known: {
        job_id: each.method === 'DELETE' ? [paused] : removes ? [job.id] : [job.id, paused],
        ...(each.method === 'DELETE' ? {} : { analysis_id: [analysis.json.id], comparison_id: [comparison.json.id] }),
        step: ['signal', 'mask'],
      },
    });
    const name = `${each.method} ${each.template}`;
    ++figures.operations;

    if (!plan.isStream)
      await t.test(`${name}: requests that fit`, async () => {
        const { operationId } = each.operation;
        const many = operationId === 'submitJob' ? 10 : slow.includes(operationId) ? 1 / 6 : 1;
        await fc.assert(
          fc.asyncProperty(plan.right, async (request) => {
            const response = await exchange(request);
            const absent = response.status === 404 && (request.path.includes(nobody) || /\/steps\//.test(request.path));
            assert.ok(
              response.status < 400 || lawful.includes(response.status) || absent,
              `a request that fits: ${response.status} ${response.text.slice(0, 800)}`,
            );
            ++figures.right;
            figures.taken += response.status < 300;
            if (response.status === 201 || response.status === 202) await clear();
          }),
          { seed, numRuns: Math.ceil(rightRuns * many), endOnFailure: !full },
        );
        await clear();
      });

    await t.test(`${name}: broken requests`, async () => {
      const before = await everything();
      const many = plan.media.length > 0 ? 2 : 1;
      await fc.assert(
        fc.asyncProperty(plan.broken, async (request) => {
          const response = await exchange(request);
          assert.ok(
            request.statuses.includes(response.status),
            `${request.what}: ${response.status}, not ${request.statuses}: ${response.text.slice(0, 800)}`,
          );
          assert.deepEqual(await everything(), before, `${request.what}: something was stored`);
          ++figures.broken;
        }),
        { seed, numRuns: brokenRuns * many, endOnFailure: !full },
      );
    });
  }
  t.diagnostic(
    `figure: contract fuzz: ${figures.operations} operations, ${figures.right} requests that fit (${figures.taken} taken), ${figures.broken} broken ones refused (FUZZ_SEED=${seed})`,
  );
  assert.ok(figures.operations > 30 && figures.taken > figures.right / 3, JSON.stringify(figures));
});
