// commands: what is done at random to a real server and to the model of it (jobs.mjs), and what must then agree.
import assert from 'node:assert/strict';
import fc from 'fast-check';
import { allEvents, command, endless, small } from '../harness/jobs.mjs';
import { Server } from '../harness/server.mjs';
import { Job } from './jobs.mjs';

const args = ['--jobs.concurrent-max', '1', '--jobs.threads-per-job', '1'];

/** The server and its data folder, over restarts. */
export class World {
  constructor(data) {
    this.data = data;
  }

  async start() {
    this.server = await new Server(this.data, args).ready(this.contract);
    this.contract = this.server.contract;
    return this;
  }

  async stop() {
    await this.server.stop();
  }

  async restart(kill) {
    await (kill ? this.server.kill() : this.server.stop());
    await this.start();
  }
}

/** What must be true of the server: its jobs in the order they came, keys in use. */
export class Model {
  constructor() {
    this.jobs = [];
    this.gone = [];
    this.keys = new Map();
    this.done = {};
  }

  pick(n) {
    return this.jobs[n % this.jobs.length];
  }
  add(id, spec, facts = {}) {
    assert.ok(!this.jobs.some((job) => job.id === id) && !this.gone.includes(id), `${id} is new`);
    const job = new Job(id, { ends: spec.name !== 'endless', body: JSON.stringify(spec), ...facts });
    this.jobs.push(job);
    return job;
  }
}

class Step {
  constructor(name, does, needsJob, details = '') {
    Object.assign(this, { name, does, needsJob, details });
  }
  check(model) {
    return !this.needsJob || model.jobs.length > 0;
  }
  async run(model, world) {
    await this.does(model, world);
    model.done[this.name] = (model.done[this.name] ?? 0) + 1;
  }
  toString() {
    return `${this.name}(${this.details})`;
  }
}

const look = async (world, job) => {
  const { status, json, text } = await world.server.get(`/v1/jobs/${job.id}`);
  assert.equal(status, 200, `${job} is lost: ${text}`);
  job.seen(json);
};

function submitted(model, spec, key, response) {
  const used = key && model.keys.get(key);
  const what = `submit with ${key ?? 'no key'} -> ${response.status}: ${response.text.slice(0, 300)}`;
  if (used && used.body !== JSON.stringify(spec)) {
    assert.deepEqual([response.status, response.json.type], [422, 'urn:colony:problem:idempotency-key-reused'], what);
    return;
  }
  assert.equal(response.status, used ? 200 : 201, what);
  if (used) assert.equal(response.json.id, used.id, what);
  const job = used ?? model.add(response.json.id, spec);
  job.seen(response.json, what);
  if (key) model.keys.set(key, job);
}

const specs = fc.oneof(
  {
    weight: 3,
    arbitrary: fc
      .tuple(fc.integer({ min: 1, max: 3 }), fc.integer({ min: 1, max: 12 }))
      .map(([seed, cells]) => small(seed, cells)),
  },
  { weight: 2, arbitrary: fc.integer({ min: 1, max: 3 }).map((seed) => endless(seed)) },
);
const keys = fc.constantFrom('a', 'b', 'c d');
const headersOf = (key) => (key ? { 'Idempotency-Key': key } : undefined);

const submit = fc.tuple(specs, fc.option(keys, { nil: undefined })).map(
  ([spec, key]) =>
    new Step(
      'submit',
      async (model, world) => {
        submitted(model, spec, key, await world.server.post('/v1/jobs', spec, headersOf(key)));
      },
      false,
      `${JSON.stringify(spec)}, ${key}`,
    ),
);

/** Killed while the submission is on its way: it may or may not have been taken; asked again it is there once. */
const submitKilled = fc.tuple(specs, fc.nat({ max: 6 })).map(
  ([spec, wait_ms]) =>
    new Step(
      'submit, killed meanwhile',
      async (model, world) => {
        const key = `killed ${model.jobs.length + model.gone.length} ${model.done['submit, killed meanwhile'] ?? 0}`;
        const lost = world.server.post('/v1/jobs', spec, headersOf(key)).catch(() => undefined);
        // Any moment is right; these are spread over what a submission takes.
        await new Promise((go) => {
          setTimeout(go, wait_ms);
        });
        await world.restart(true);
        const first = await lost;
        const again = await world.server.post('/v1/jobs', spec, headersOf(key));
        if (first) assert.equal(again.json.id, first.json.id, 'a confirmed submission was lost');
        assert.ok([200, 201].includes(again.status), again.text);
        const job = model.add(again.json.id, spec);
        job.seen(again.json);
        model.keys.set(key, job);
      },
      false,
      `${JSON.stringify(spec)}, ${wait_ms} ms`,
    ),
);

const onJob = (name, does) => fc.nat().map((n) => new Step(name, (model, world) => does(model, world, model.pick(n)), true, n));

const commanded = (name) =>
  onJob(name, async (model, world, job) => job.commanded(name, await command(world.server, job.id, name)));

const remove = onJob('delete', async (model, world, job) => {
  const { status, json, text } = await world.server.request('DELETE', `/v1/jobs/${job.id}`);
  const what = `delete -> ${status} ${text}`;
  if (status === 409) {
    assert.equal(json.type, 'urn:colony:problem:job-not-terminal');
    assert.ok(job.mayStay, `${what}: ${job}`);
    return;
  }
  assert.equal(status, 204, what);
  assert.ok(job.mayBeRemoved, `${what}: ${job}`);
  model.jobs.splice(model.jobs.indexOf(job), 1);
  model.gone.push(job.id);
  job.remove(model.jobs);
  for (const [key, one] of model.keys) if (one === job) model.keys.delete(key);
  assert.equal((await world.server.get(`/v1/jobs/${job.id}`)).status, 404);
});

const show = onJob('show', (model, world, job) => look(world, job));

const events = fc.tuple(fc.nat(), fc.nat()).map(
  ([n, m]) =>
    new Step(
      'events',
      async (model, world) => {
        const job = model.pick(n);
        // Of a long history only what is new, and a little before it.
        const after = Math.max(0, job.last - (m % 50));
        const { json } = await world.server.get(`/v1/jobs/${job.id}/events?after=${after}&limit=100000`);
        job.history(json.items, after);
      },
      true,
      `${n}, ${m}`,
    ),
);

const list = fc.integer({ min: 1, max: 4 }).map(
  (limit) =>
    new Step(
      'list',
      async (model, world) => {
        const found = [];
        let cursor = '';
        do {
          const { status, json, headers, text } = await world.server.get(`/v1/jobs?limit=${limit}${cursor}`);
          assert.equal(status, 200, text);
          assert.ok(json.items.length <= limit);
          assert.equal(headers.link !== undefined, json.next !== null, 'Link says what `next` says');
          found.push(...json.items);
          cursor = json.next ? `&cursor=${json.next}` : undefined;
        } while (cursor !== undefined);
        assert.deepEqual(
          found.map(({ id }) => id),
          model.jobs.map(({ id }) => id).reverse(),
          'all jobs, newest first, each once',
        );
        for (const json of found) model.jobs.find(({ id }) => id === json.id).seen(json, 'a list');
        const counts = await world.server.counts();
        assert.equal(
          Object.values(counts).reduce((sum, count) => sum + count, 0),
          model.jobs.length,
          'the counts count every job',
        );
      },
      false,
      limit,
    ),
);

/** A fork of what is stored by now; its first events are the origin's. */
const fork = fc.tuple(fc.nat(), fc.nat(), fc.integer({ min: 1, max: 3 })).map(
  ([n, m, seed]) =>
    new Step(
      'fork',
      async (model, world) => {
        const job = model.pick(n);
        // What ends soon has at most 12 cells; `finished` is never part of a fork.
        const endlessly = !job.ends;
        const stored = job.last - (job.ended ? 1 : 0);
        if (stored < 1 && job.kind === 'colony') return;
        const seq = 1 + (m % Math.max(1, stored));
        const body = { at_seq: seq, seed, name: 'fork', until: endlessly ? endless().until : { cells: 16 } };
        const response = await world.server.post(`/v1/jobs/${job.id}/fork`, body);
        if (job.kind === 'verify') {
          assert.equal(response.status, 422, response.text);
          return;
        }
        assert.equal(response.status, 201, `a fork of ${job} at ${seq}: ${response.text}`);
        assert.deepEqual([response.json.origin.job_id, response.json.origin.at_seq], [job.id, seq]);
        const made = model.add(response.json.id, body, { ends: !endlessly, last: seq });
        made.seen(response.json, 'a fork');
        const at = async ({ id }) => (await world.server.get(`/v1/jobs/${id}/events?after=${seq - 1}&limit=1`)).json.items[0];
        assert.deepEqual(await at(made), await at(job), 'the last event of both');
      },
      true,
      `${n}, ${m}, ${seed}`,
    ),
);

const verify = onJob('verify', async (model, world, job) => {
  const response = await command(world.server, job.id, 'verify');
  assert.equal(response.status, job.kind === 'verify' ? 422 : 201, response.text);
  if (response.status === 201)
    model.add(response.json.id, { name: 'verify' }, { kind: 'verify', target: job }).seen(response.json, 'a verification');
});

const edit = fc.tuple(fc.nat(), fc.constantFrom('', 'a name', 'another \u{1F9EB}'), fc.boolean()).map(
  ([n, name, stale]) =>
    new Step(
      'edit',
      async (model, world) => {
        const job = model.pick(n);
        const patch = (headers = {}) =>
          world.server.request('PATCH', `/v1/jobs/${job.id}`, {
            body: JSON.stringify({ name }),
            headers: { 'Content-Type': 'application/merge-patch+json', ...headers },
          });
        if (job.ended && stale) {
          const refused = await patch({ 'If-Match': `"${job.ended.revision + 1}.0"` });
          assert.equal(refused.status, 412, refused.text);
        }
        const { status, json, text } = await patch(job.ended ? { 'If-Match': `"${job.ended.revision}.0"` } : {});
        assert.equal(status, 200, text);
        job.edited(json, { name });
      },
      true,
      `${n}, ${JSON.stringify(name)}`,
    ),
);

const missing = fc.nat().map(
  (n) =>
    new Step(
      'a job that was deleted',
      async (model, world) => {
        if (model.gone.length === 0) return;
        const id = model.gone[n % model.gone.length];
        assert.equal((await world.server.get(`/v1/jobs/${id}`)).status, 404);
        assert.equal((await command(world.server, id, 'cancel')).status, 404);
        assert.equal((await world.server.request('DELETE', `/v1/jobs/${id}`)).status, 404);
      },
      false,
      n,
    ),
);

const restart = fc.boolean().map(
  (kill) =>
    new Step(
      kill ? 'kill -9' : 'SIGTERM',
      async (model, world) => {
        await world.restart(kill);
        for (const job of model.jobs) await look(world, job);
      },
      false,
    ),
);

/** Each with the operation that it needs. */
const further = { forkJob: [fork], verifyJob: [verify], editJob: [edit] };

/** `operations`: the ids of those that the server's document has. */
export const stepsFor = (operations) => [
  ...common,
  ...Object.entries(further).flatMap(([id, steps]) => (operations.has(id) ? steps : [])),
];

const common = [
  submit,
  submit,
  submitKilled,
  ...['cancel', 'pause', 'pause', 'resume', 'resume'].map(commanded),
  remove,
  show,
  show,
  events,
  list,
  missing,
  restart,
];
