// model: random commands against a real server with restarts, held against a model of the job state machine (model/jobs.mjs). What must hold: every answer
// is one that some possible state gives; a finished job never changes again; no confirmed submission, command or event is lost, by kill -9 either.
// FUZZ_SEED repeats a run (with one seed instead of several); a failure prints the commands that led to it.
import assert from 'node:assert/strict';
import test from 'node:test';
import fc from 'fast-check';
import { full, startServer, temporaryFolder } from './harness/server.mjs';
import { Model, World, stepsFor } from './model/commands.mjs';

const seeds = process.env.FUZZ_SEED
  ? [Number(process.env.FUZZ_SEED)]
  : full
    ? Array.from({ length: 40 }, (_, k) => (Date.now() + 7919 * k) % 2 ** 31)
    : [1, 2, 3];
const length = full ? 300 : 60;

test('commands at random, with restarts', async (t) => {
  const sum = {};
  const { contract } = await startServer(t);
  const steps = stepsFor(
    new Set(
      Object.values(contract.openapi.paths)
        .flatMap((item) => Object.values(item))
        .map(({ operationId }) => operationId),
    ),
  );
  for (const seed of seeds) {
    await t.test(`FUZZ_SEED=${seed}`, async (t) => {
      // One run of many commands: shrinking it would start many servers, and what has been printed says what led to the fault.
      await fc.assert(
        fc.asyncProperty(fc.array(fc.oneof(...steps), { minLength: length, maxLength: length }), async (commands) => {
          const world = await new World(temporaryFolder(t)).start();
          const model = new Model();
          try {
            await fc.asyncModelRun(() => ({ model, real: world }), commands);
            for (const job of model.jobs) job.seen((await world.server.get(`/v1/jobs/${job.id}`)).json, 'at the end');
          } finally {
            await world.stop();
          }
          for (const [name, count] of Object.entries(model.done)) sum[name] = (sum[name] ?? 0) + count;
        }),
        { seed, numRuns: 1, endOnFailure: true },
      );
    });
  }
  t.diagnostic(
    `figure: model test: ${seeds.length} seeds; ${Object.entries(sum)
      .map(([name, count]) => `${count} ${name}`)
      .join(', ')}`,
  );
  if (process.env.FUZZ_SEED) return;
  for (const name of [
    'submit',
    'submit, killed meanwhile',
    'cancel',
    'pause',
    'resume',
    'delete',
    'list',
    'events',
    'kill -9',
    'SIGTERM',
  ])
    assert.ok(sum[name] > 0, `${name} was never tried`);
});
