// openapi_examples: what openapi.json shows is true. Every request example is sent and gets the status it states (`x-answer`), every parameter's
// example is accepted, every other example fits its schema.
import assert from 'node:assert/strict';
import test from 'node:test';
import { command, finishedJob, small, terminal } from './harness/jobs.mjs';
import { discs } from './harness/png.mjs';
import { startServer } from './harness/server.mjs';
import { openStream } from './harness/stream.mjs';

/** Long answers, measured by their own tests; an example of them would be pages. */
const tooLong = [
  'Analysis',
  'AnalysisList',
  'Comparison',
  'ComparisonList',
  'JobAnalysis',
  'CreatedToken',
  'Health',
  'JobCounts',
  'Lineage',
  'ObjectList',
  'ServiceInfo',
  'Submission',
  'TokenList',
];
/** An opaque value has no example; no path parameter's example exists on a server, so a real one is put in its place. */
const opaque = ['cursor'];

const methods = ['get', 'post', 'patch', 'put', 'delete'];

/** Every operation of the document: {method, template, operation}. */
export function operations(document) {
  return Object.entries(document.paths).flatMap(([template, item]) =>
    methods
      .filter((method) => item[method])
      .map((method) => ({ method: method.toUpperCase(), template, operation: item[method] })),
  );
}

/** Every object of the document with the given member: [pointer, object]. Schemas' `properties` name fields, not keywords. */
function* having(member, node, pointer = '') {
  if (node === null || typeof node !== 'object') return;
  if (!Array.isArray(node) && member in node && !pointer.endsWith('/properties')) yield [pointer, node];
  for (const [name, value] of Object.entries(node)) {
    if (['example', 'examples', 'value'].includes(name) && !pointer.endsWith('/properties')) continue;
    yield* having(member, value, `${pointer}/${name}`);
  }
}

test('the examples of openapi.json', async (t) => {
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '1'] });
  const { contract } = server;
  const document = contract.openapi;
  const job = await finishedJob(server, small(3, 12));
  const picture = discs(4, 8);
  const analysis = await server.request('POST', '/v1/analyses', { body: picture, headers: { 'Content-Type': 'image/png' } });
  assert.equal(analysis.status, 201, analysis.text);
  const comparison = await server.post('/v1/comparisons', { job_id: job.id, analysis_id: analysis.json.id });
  assert.equal(comparison.status, 201, comparison.text);
  const known = { job_id: job.id, analysis_id: analysis.json.id, comparison_id: comparison.json.id, step: 'signal' };
  const pathOf = (template) =>
    template.replace(/\{(\w+)\}/g, (_, name) => {
      assert.ok(known[name], `this test knows no ${name}`);
      return known[name];
    });
  /** The body with real ids in place of stand-ins. */
  const real = (value) =>
    value !== null && typeof value === 'object' && !Array.isArray(value)
      ? Object.fromEntries(Object.entries(value).map(([name, one]) => [name, known[name] ?? one]))
      : value;
  const bodies = (operation) =>
    Object.entries(contract.resolve(operation.requestBody)?.content ?? {}).flatMap(([media, content]) =>
      Object.entries(content.examples ?? {}).map(([name, example]) => ({ media, name, example, schema: content.schema })),
    );

  await t.test('examples fit their schemas', () => {
    let count = 0;
    for (const [pointer, schema] of having('examples', document.components.schemas, '/components/schemas')) {
      for (const value of schema.examples) {
        contract.validate(schema, value, pointer);
        ++count;
      }
    }
    for (const [pointer, owner] of having('schema', document)) {
      const values = [
        ...('example' in owner ? [owner.example] : []),
        ...Object.values(owner.examples ?? {}).map(({ value }) => value),
      ];
      for (const value of values) {
        contract.validate(owner.schema, value, pointer);
        ++count;
      }
    }
    t.diagnostic(`${count} examples`);
    assert.ok(count > 60, `${count} examples`);
  });

  await t.test('every short answer, request body and parameter has one', () => {
    const referred = new Set(
      operations(document)
        .flatMap(({ operation }) => Object.values(operation.responses))
        .flatMap((answer) => Object.values(contract.resolve(answer).content ?? {}))
        .map(({ schema }) => schema?.$ref?.split('/').at(-1))
        .filter(Boolean),
    );
    const bare = [...referred].filter((name) => !document.components.schemas[name].examples && !tooLong.includes(name));
    for (const { method, template, operation } of operations(document)) {
      const json = contract.resolve(operation.requestBody)?.content ?? {};
      for (const [media, { schema, examples }] of Object.entries(json)) {
        if (media.endsWith('json') && contract.resolve(schema).maxProperties !== 0 && !examples)
          bare.push(`${method} ${template} ${media}`);
      }
      for (const parameter of (operation.parameters ?? []).map((one) => contract.resolve(one))) {
        if (parameter.in === 'query' && !('example' in parameter) && !opaque.includes(parameter.name))
          bare.push(`${method} ${template} ${parameter.name}`);
      }
    }
    assert.deepEqual(bare, []);
  });

  await t.test('every request example gets the answer it states', async () => {
    let count = 0;
    for (const { method, template, operation } of operations(document)) {
      for (const { media, name, example } of bodies(operation)) {
        const response = await server.request(method, pathOf(template), {
          body: JSON.stringify(real(example.value)),
          headers: { 'Content-Type': media },
        });
        assert.equal(response.status, example['x-answer'], `${method} ${template}, ${name}: ${response.text.slice(0, 500)}`);
        ++count;
      }
    }
    t.diagnostic(`${count} requests`);
    assert.ok(count >= 7);
    // What was submitted need not grow on.
    for (const { id, state } of (await server.get('/v1/jobs')).json.items)
      if (!terminal.includes(state)) await command(server, id, 'cancel');
  });

  await t.test('every example of a parameter is accepted', async () => {
    let count = 0;
    for (const { method, template, operation } of operations(document)) {
      for (const parameter of (operation.parameters ?? []).map((one) => contract.resolve(one))) {
        if (!('example' in parameter) || parameter.in === 'path') continue;
        const text = [parameter.example].flat().join(',');
        // Lines are drawn in one style only.
        const beside = operation.operationId === 'drawImage' && parameter.name === 'lines' ? '&style=contours' : '';
        const query = parameter.in === 'query' ? `?${parameter.name}=${encodeURIComponent(text)}${beside}` : '';
        const [body] = bodies(operation);
        const image = method === 'POST' && !body && contract.resolve(operation.requestBody).content['image/png'];
        const headers = {
          ...(method === 'GET' ? {} : { 'Content-Type': body?.media ?? (image ? 'image/png' : 'application/json') }),
          ...(parameter.in === 'header' ? { [parameter.name]: text } : {}),
        };
        const answers = Object.values(operation.responses)
          .flatMap((answer) => Object.keys(contract.resolve(answer).content ?? {}))
          .filter((media) => !media.startsWith('application/problem'));
        if (answers.every((media) => media === 'text/event-stream')) {
          assert.equal((await openStream(t, server, pathOf(template) + query)).status, 200);
          ++count;
          continue;
        }
        const response = await server.request(method, pathOf(template) + query, {
          headers,
          body: image ? picture : body && JSON.stringify(real(body.example.value)),
        });
        // A stated condition may not hold; that is an answer too.
        assert.ok(
          response.status < 400 || response.status === 412,
          `${method} ${template} ${parameter.name}=${text}: ${response.status} ${response.text.slice(0, 500)}`,
        );
        ++count;
      }
    }
    t.diagnostic(`${count} requests`);
    assert.ok(count > 30);
  });
});
