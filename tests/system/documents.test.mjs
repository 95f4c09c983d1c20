// documents: what the server says about itself: OpenAPI, schema, service information, health.
import assert from 'node:assert/strict';
import { cpus } from 'node:os';
import test from 'node:test';
import Ajv2020 from 'ajv/dist/2020.js';
import { finishedJob, small } from './harness/jobs.mjs';
import { startServer } from './harness/server.mjs';

/** The endpoints this version promises. */
const endpoints = ['POST /v1/jobs', 'GET /v1/jobs', 'GET /v1/jobs/counts', 'GET /v1/jobs/{}', 'DELETE /v1/jobs/{}', 'POST /v1/jobs/{}/cancel',
  'POST /v1/jobs/{}/pause', 'POST /v1/jobs/{}/resume', 'GET /v1/jobs/{}/events', 'GET /v1/jobs/{}/cells', 'GET /v1/jobs/{}/series',
  'GET /v1/jobs/{}/image', 'GET /v1/jobs/{}/log', 'GET /v1/schema/job', 'GET /openapi.json', 'GET /v1/service-info', 'GET /healthz', 'GET /readyz'];

test('documents', async (t) => {
  const server = await startServer(t);
  const { openapi } = server.contract;

  await t.test('openapi.json is OpenAPI 3.1 in form, and its schemas compile under 2020-12', () => {
    assert.match(openapi.openapi, /^3\.1\.\d+$/);
    assert.ok(openapi.info.title && openapi.info.version);
    const ids = new Set();
    const found = [];
    for (const [path, item] of Object.entries(openapi.paths)) {
      assert.match(path, /^\//);
      for (const method of ['get', 'post', 'put', 'patch', 'delete', 'head', 'options'].filter((name) => item[name])) {
        const operation = item[method];
        const what = `${method.toUpperCase()} ${path}`;
        found.push(what.replace(/\{[^}]*\}/g, '{}'));
        assert.ok(operation.summary || operation.description, `${what} says what it does`);
        if (operation.operationId) {
          assert.ok(!ids.has(operation.operationId), `${operation.operationId} is unique`);
          ids.add(operation.operationId);
        }
        const parameters = [...(item.parameters ?? []), ...(operation.parameters ?? [])].map((parameter) => server.contract.resolve(parameter));
        const inPath = parameters.filter((parameter) => parameter.in === 'path').map(({ name }) => `{${name}}`);
        assert.deepEqual(inPath.sort(), (path.match(/\{[^}]*\}/g) ?? []).sort(), `${what} states its path parameters`);
        for (const parameter of parameters) {
          assert.ok(['path', 'query', 'header', 'cookie'].includes(parameter.in) && parameter.name && (parameter.schema || parameter.content), what);
          if (parameter.in === 'path') assert.equal(parameter.required, true, what);
          if (parameter.schema) server.contract.validator(parameter.schema);
        }
        const body = server.contract.resolve(operation.requestBody);
        for (const { schema } of Object.values(body?.content ?? {})) if (schema) server.contract.validator(schema);
        assert.ok(Object.keys(operation.responses).length > 0, what);
        for (const [status, stated] of Object.entries(operation.responses)) {
          assert.match(status, /^([1-5](\d\d|XX)|default)$/, what);
          const response = server.contract.resolve(stated);
          assert.equal(typeof response.description, 'string', `${what} ${status} has a description`);
          for (const { schema } of Object.values(response.content ?? {})) if (schema) server.contract.validator(schema);
        }
      }
    }
    for (const endpoint of endpoints) assert.ok(found.includes(endpoint), `openapi.json has ${endpoint}`);
    const references = [...JSON.stringify(openapi).matchAll(/"\$ref":"([^"]*)"/g)].map((match) => match[1]);
    for (const reference of references) assert.ok(server.contract.resolve({ $ref: reference }), `${reference} resolves`);
  });

  await t.test('the contract check is alive: a wrong answer is caught', async () => {
    const answer = await server.get('/healthz');
    const forged = (change) => ({ ...answer, ...change });
    assert.throws(() => server.contract.check('GET', '/healthz', forged({ status: 299 })));
    assert.throws(() => server.contract.check('GET', '/healthz', forged({ headers: { 'content-type': 'application/x-made-up' }, body: Buffer.from('{}') })));
    assert.throws(() => server.contract.check('GET', '/v1/made-up', forged({})));
    const job = await finishedJob(server, small(1, 2));
    const real = await server.get(`/v1/jobs/${job.id}`);
    assert.throws(() => server.contract.check('GET', `/v1/jobs/${job.id}`, { ...real, json: { ...real.json, state: 'asleep' } }));
    const { digest, ...lacking } = real.json;
    assert.throws(() => server.contract.check('GET', `/v1/jobs/${job.id}`, { ...real, json: lacking }), `without ${digest}`);
  });

  await t.test('the schema of a job accepts and refuses what the server does', async () => {
    const { json: schema } = await server.get('/v1/schema/job');
    const ajv = new Ajv2020({ strict: false, formats: { double: true, int64: true, int32: true } });
    const valid = ajv.compile(schema);
    const specs = [
      [small(), 201], [{ preset: 'paper', until: { time_h: 1 } }, 201], [{ preset: 'paper', seed: 0, until: { cells: 1 } }, 201],
      [{ ...small(1, 2), model: { division: { generation_limit: null } } }, 201],
      [{ ...small(1, 2), model: { cycle: { mean_h: 20 } } }, 201],
      [{ ...small(), unknown: 1 }, 422], [{ ...small(), seed: -1 }, 422], [{ ...small(), seed: 1.5 }, 422], [{ ...small(), seed: 2 ** 53 }, 422],
      [{ ...small(), preset: 'made-up' }, 422], [{ ...small(), name: 5 }, 422], [{ preset: 'paper' }, 422],
      [{ ...small(), until: {} }, 422], [{ ...small(), until: { cells: 0 } }, 422], [{ ...small(), until: { time_h: -1 } }, 422],
      [{ ...small(), model: { cycle: { mean_h: 1 } } }, 422], [{ ...small(), model: { cycle: { mean_h: '12' } } }, 422],
      [{ ...small(), model: { noise: { amplitude: 0.5 } } }, 422], [{ ...small(), model: { noise: { made_up: 1 } } }, 422],
      [{ ...small(), model: { search: { points: 100 } } }, 422], [{ ...small(), model: { cell: { elongation: [1] } } }, 422],
      [{ ...small(), model: { contact: { rule: 'product' } } }, 422], [{ ...small(), labels: { a: 1 } }, 422], [[], 422],
    ];
    for (const [spec, status] of specs) {
      const response = await server.post('/v1/jobs?dry_run=true', spec);
      assert.equal(response.status, status === 201 ? 200 : status, `${JSON.stringify(spec)} -> ${response.text}`);
      assert.equal(valid(spec), status === 201, `${JSON.stringify(spec)}: schema and server disagree; schema: ${JSON.stringify(valid.errors)}`);
    }
  });

  await t.test('a job spec that the server gives back is accepted again, and means the same job', async () => {
    const { json: dry } = await server.post('/v1/jobs?dry_run=true', small());
    const { json: again } = await server.post('/v1/jobs?dry_run=true', dry.spec);
    assert.deepEqual(again.spec, dry.spec);
  });

  await t.test('service-info names version, limits and presets', async () => {
    const { json } = await server.get('/v1/service-info');
    assert.match(JSON.stringify(json), /"version":/);
    for (const word of ['paper', 'clonogenic', 'limits']) assert.ok(JSON.stringify(json).includes(word), word);
    // Where nothing is said, jobs and their threads share the cores.
    const { jobs_concurrent_max: jobs, jobs_threads_per_job: threads } = json.limits;
    assert.ok(jobs >= 1 && threads >= 1 && jobs * threads <= cpus().length, `${jobs} jobs of ${threads} threads`);
  });

  await t.test('what is said of jobs and threads stands', async () => {
    const told = await startServer(t, { args: ['--jobs.concurrent-max', '3', '--jobs.threads-per-job', '5'] });
    const { json } = await told.get('/v1/service-info');
    assert.deepEqual([json.limits.jobs_concurrent_max, json.limits.jobs_threads_per_job], [3, 5]);
  });

  await t.test('healthz and readyz answer 200', async () => {
    assert.equal((await server.get('/healthz')).status, 200);
    assert.equal((await server.get('/readyz')).status, 200);
  });
});
