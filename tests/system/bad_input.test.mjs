// bad_input: everything that must be refused is refused with a problem document that points at its fault, and stores nothing.
import assert from 'node:assert/strict';
import test from 'node:test';
import { send, sendRaw } from './harness/http.mjs';
import { finishedJob, small } from './harness/jobs.mjs';
import { startServer } from './harness/server.mjs';

const withModel = (model, rest = {}) => JSON.stringify({ preset: 'paper', until: { cells: 10 }, model, ...rest });
const spec = (change) => JSON.stringify({ preset: 'paper', until: { cells: 10 }, ...change });
const nested = (depth) => `{"preset": "paper", "until": {"cells": 10}, "model": ${'{"a":'.repeat(depth)}1${'}'.repeat(depth)}}`;

/** [what, body, statuses, pointers: each must be among the problem's; or a regex for the detail]. */
const bodies = [
  ['an empty body', '', [400]],
  ['malformed JSON', '{"preset": "paper", "until": }', [400], /\b\d+\b/],
  ['JSON cut short', '{"preset": "paper"', [400], /\b\d+\b/],
  ['text after the JSON', `${spec({})} x`, [400], /\b\d+\b/],
  ['a zero byte after the JSON', `${spec({})}\0 x`, [400], /zero byte/],
  ['NaN', '{"preset": "paper", "until": {"time_h": NaN}}', [400], /\b\d+\b/],
  ['Infinity', '{"preset": "paper", "until": {"time_h": Infinity}}', [400], /\b\d+\b/],
  ['a comment', '{"preset": "paper", /* c */ "until": {"cells": 10}}', [400]],
  ['bytes that are not UTF-8', Buffer.from([0x7b, 0x22, 0xff, 0xfe, 0x22, 0x3a, 0x31, 0x7d]), [400]],
  ['a number beyond double', '{"preset": "paper", "until": {"time_h": 1e999}}', [400, 422]],
  ['a duplicate key', '{"preset": "paper", "until": {"cells": 10, "cells": 20}}', [400, 422], ['/until/cells']],
  ['a duplicate key at the top', '{"preset": "paper", "preset": "clonogenic", "until": {"cells": 10}}', [400, 422], ['/preset']],
  ['U+0000 in a string', '{"preset": "paper", "name": "a\\u0000b", "until": {"cells": 10}}', [400, 422], ['/name']],
  ['depth 33', nested(33), [400, 422]],
  ['depth 100', nested(100), [400, 422]],
  ['depth 200000', '['.repeat(200_000), [400, 422]],
  ['an array', '[]', [422], ['']],
  ['a string', '"paper"', [422], ['']],
  ['null', 'null', [422], ['']],
  ['an unknown field', spec({ colour: 'red' }), [422], ['/colour']],
  ['an unknown field in model', withModel({ cycle: { mean_h: 12, median_h: 12 } }), [422], ['/model/cycle/median_h']],
  ['an unknown group in model', withModel({ weather: {} }), [422], ['/model/weather']],
  ['an unknown field with odd characters', spec({ 'a/b~c': 1 }), [422], ['/a~1b~0c']],
  ['a string where a number is due', withModel({ cycle: { mean_h: '12' } }), [422], ['/model/cycle/mean_h']],
  ['a number where a string is due', spec({ name: 7 }), [422], ['/name']],
  ['a number where a boolean is due', withModel({ division: { inhibition: 1 } }), [422], ['/model/division/inhibition']],
  ['null where a number is due', withModel({ cycle: { mean_h: null } }), [422], ['/model/cycle/mean_h']],
  ['an array where an object is due', spec({ model: [] }), [422], ['/model']],
  ['a fraction where an integer is due', withModel({ search: { population: 32.5 } }), [422], ['/model/search/population']],
  ['a seed that is no integer', spec({ seed: 1.5 }), [422], ['/seed']],
  ['a negative seed', spec({ seed: -1 }), [422], ['/seed']],
  ['a seed of 2^53', '{"preset": "paper", "seed": 9007199254740992, "until": {"cells": 10}}', [422], ['/seed']],
  ['a seed beyond 64 bits', '{"preset": "paper", "seed": 99999999999999999999999, "until": {"cells": 10}}', [422], ['/seed']],
  ['negative cells', spec({ until: { cells: -5 } }), [422], ['/until/cells']],
  ['zero cells', spec({ until: { cells: 0 } }), [422], ['/until/cells']],
  ['absurdly many cells', spec({ until: { cells: 1e15 } }), [422], ['/until/cells']],
  ['fewer cells than founders', spec({ until: { cells: 4 }, model: { founders: { count: 5, radius_um: 500 } } }), [422], ['/until/cells']],
  ['a negative time', spec({ until: { time_h: -1 } }), [422], ['/until/time_h']],
  ['an absurd time', spec({ until: { time_h: 1e300 } }), [422], ['/until/time_h']],
  ['a negative radius', withModel({ dish: { radius_um: -100 } }), [422], ['/model/dish/radius_um']],
  ['an absurd cycle', withModel({ cycle: { mean_h: 1e12 } }), [422], ['/model/cycle/mean_h']],
  ['a negative cycle', withModel({ cycle: { mean_h: -12 } }), [422], ['/model/cycle/mean_h']],
  ['no bound', '{"preset": "paper"}', [422], ['/until']],
  ['an empty bound', spec({ until: {} }), [422], ['/until']],
  ['an unknown preset', spec({ preset: 'made-up' }), [422], ['/preset']],
  ['a noise amplitude out of range', withModel({ noise: { amplitude: 0.46 } }), [422], ['/model/noise/amplitude']],
  ['a noise frequency too high', withModel({ noise: { frequency: 8.5 } }), [422], ['/model/noise/frequency']],
  ['a noise frequency too low', withModel({ noise: { frequency: 1.9 } }), [422], ['/model/noise/frequency']],
  ['a noise phase out of range', withModel({ noise: { phase: 7 } }), [422], ['/model/noise/phase']],
  ['a pair of amplitude and frequency that tears cells', withModel({ noise: { amplitude: 0.42, frequency: 6 } }), [422], ['/model/noise/amplitude']],
  ['a cycle shorter than settling', withModel({ cycle: { mean_h: 3, sd_h: 0.5 } }), [422], [/^\/model\/(cycle|division)/]],
  ['a standard deviation above a quarter of the mean', withModel({ cycle: { mean_h: 12, sd_h: 3.5 } }), [422], ['/model/cycle/sd_h']],
  ['a range upside down', withModel({ cell: { elongation: [1.7, 1] } }), [422], ['/model/cell/elongation']],
  ['a range of one', withModel({ cell: { elongation: [1] } }), [422], ['/model/cell/elongation']],
  ['points that are no power of two', withModel({ search: { points: 100 } }), [422], ['/model/search/points']],
  ['fitness_good below fitness_min', withModel({ contact: { fitness_min: 0.9, fitness_good: 0.8 } }), [422], ['/model/contact/fitness_good']],
  ['an unknown rule', withModel({ contact: { rule: 'product' } }), [422], ['/model/contact/rule']],
  ['an unknown kind of layers', withModel({ layers: 'two' }), [422], ['/model/layers']],
  ['moves where there are layers', withModel({ layers: 'multi', motility: { rate_per_h: 0.1 } }), [422], ['/model/motility/rate_per_h']],
  ['moves beyond the highest rate', withModel({ motility: { rate_per_h: 2.5 } }), [422], ['/model/motility/rate_per_h']],
  ['moves more often than the window allows', withModel({ motility: { rate_per_h: 1 } }), [422], ['/model/window_h']],
  ['founders that overlap', withModel({ founders: { positions_um: [[0, 0], [500, 0], [0.5, 0]] } }), [422], ['/model/founders/positions_um/2']],
  ['a founder outside the dish', withModel({ founders: { positions_um: [[0, 0], [500, 0]] }, dish: { radius_um: 200 } }), [422],
    ['/model/founders/positions_um/1']],
  ['more founders than have room', withModel({ founders: { count: 5000, radius_um: 30 } }, { until: { time_h: 1 } }), [422], ['/model/founders']],
  ['too many founders', withModel({ founders: { count: 100_001 } }), [422], ['/model/founders/count']],
  ['no founder', withModel({ founders: { count: 0 } }), [422], ['/model/founders/count']],
  ['a founder of one coordinate', withModel({ founders: { positions_um: [[0]] } }), [422], ['/model/founders/positions_um/0']],
  ['labels that are no strings', spec({ labels: { plate: 7 } }), [422], ['/labels/plate']],
  ['several faults at once', spec({ seed: -1, colour: 'red', model: { noise: { amplitude: 9 }, cycle: { mean_h: 'x' } } }), [422],
    ['/seed', '/colour', '/model/noise/amplitude', '/model/cycle/mean_h']],
];

const id = '01890000-0000-7000-8000-000000000000';

/** [what, method, path, headers, body, statuses, parameters]. */
const requests = (known) => [
  ['an unknown job', 'GET', `/v1/jobs/${id}`, {}, undefined, [404]],
  ['an id that is none', 'GET', '/v1/jobs/..%2f..%2fetc', {}, undefined, [400, 404]],
  ['an unknown path', 'GET', '/v1/made-up', {}, undefined, [404]],
  ...['events', 'cells', 'series', 'image', 'log'].map((what) => [`${what} of an unknown job`, 'GET', `/v1/jobs/${id}/${what}`, {}, undefined, [404]]),
  ...['cancel', 'pause', 'resume'].map((what) => [`${what} of an unknown job`, 'POST', `/v1/jobs/${id}/${what}`, { 'Content-Type': 'application/json' }, '', [404]]),
  ['deleting an unknown job', 'DELETE', `/v1/jobs/${id}`, {}, undefined, [404]],
  ['a wrong method', 'DELETE', '/v1/jobs', {}, undefined, [405]],
  ['another wrong method', 'POST', '/v1/jobs/counts', { 'Content-Type': 'application/json' }, '{}', [404, 405]],
  ['a method of no standard', 'BREW', '/v1/jobs', {}, undefined, [400, 405, 501]],
  ['no content type', 'POST', '/v1/jobs', {}, spec({}), [415]],
  ['a form content type', 'POST', '/v1/jobs', { 'Content-Type': 'application/x-www-form-urlencoded' }, spec({}), [415]],
  ['a text content type', 'POST', '/v1/jobs', { 'Content-Type': 'text/plain' }, spec({}), [415]],
  ['a media type there is not', 'GET', `/v1/jobs/${known}/events`, { Accept: 'application/x-made-up' }, undefined, [406]],
  ['a picture as text', 'GET', `/v1/jobs/${known}/image`, { Accept: 'text/csv' }, undefined, [406]],
  ['a made-up cursor', 'GET', '/v1/jobs?cursor=bm90aGluZw', {}, undefined, [400, 422], ['cursor']],
  ['an unknown state', 'GET', '/v1/jobs?state=asleep', {}, undefined, [400, 422], ['state']],
  ['a limit of zero', 'GET', '/v1/jobs?limit=0', {}, undefined, [400, 422], ['limit']],
  ['a limit too high', 'GET', '/v1/jobs?limit=501', {}, undefined, [400, 422], ['limit']],
  ['a limit that is no number', 'GET', '/v1/jobs?limit=ten', {}, undefined, [400, 422], ['limit']],
  ['a label without a value', 'GET', '/v1/jobs?label=plate', {}, undefined, [400, 422], ['label']],
  ['an unknown parameter', 'GET', '/v1/jobs?colour=red', {}, undefined, [400, 422], ['colour']],
  ['a parameter twice', 'GET', '/v1/jobs?limit=5&limit=6', {}, undefined, [400, 422], ['limit']],
  ['a dry_run that is neither', 'POST', '/v1/jobs?dry_run=perhaps', { 'Content-Type': 'application/json' }, spec({}), [400, 422], ['dry_run']],
  ['a negative after', 'GET', `/v1/jobs/${known}/events?after=-1`, {}, undefined, [400, 422], ['after']],
  ['an unknown kind', 'GET', `/v1/jobs/${known}/events?kind=exploded`, {}, undefined, [400, 422], ['kind']],
  ['too many events a page', 'GET', `/v1/jobs/${known}/events?limit=100001`, {}, undefined, [400, 422], ['limit']],
  ['a Last-Event-ID that is none', 'GET', `/v1/jobs/${known}/events`, { Accept: 'text/event-stream', 'Last-Event-ID': 'x' }, undefined, [400, 422]],
  ['at_h NaN', 'GET', `/v1/jobs/${known}/cells?at_h=NaN`, {}, undefined, [400, 422], ['at_h']],
  ['at_h negative', 'GET', `/v1/jobs/${known}/cells?at_h=-1`, {}, undefined, [400, 422], ['at_h']],
  ['too many points', 'GET', `/v1/jobs/${known}/series?points=10001`, {}, undefined, [400, 422], ['points']],
  ['no points', 'GET', `/v1/jobs/${known}/series?points=0`, {}, undefined, [400, 422], ['points']],
  ['a style there is not', 'GET', `/v1/jobs/${known}/image?style=cubist`, {}, undefined, [400, 422], ['style']],
  ['a picture too wide', 'GET', `/v1/jobs/${known}/image?width_px=1000000`, {}, undefined, [400, 413, 422], ['width_px']],
  ['a scale too fine', 'GET', `/v1/jobs/${known}/image?um_per_px=0.000001`, {}, undefined, [400, 413, 422], ['um_per_px']],
  ['a scale of zero', 'GET', `/v1/jobs/${known}/image?um_per_px=0`, {}, undefined, [400, 422], ['um_per_px']],
  ['a scale and a width', 'GET', `/v1/jobs/${known}/image?um_per_px=1&width_px=100`, {}, undefined, [400, 422]],
  ['an idempotency key too long', 'POST', '/v1/jobs', { 'Content-Type': 'application/json', 'Idempotency-Key': 'k'.repeat(2000) }, spec({}), [400, 422, 431]],
];

const faults = (problem) => (problem.errors ?? []).map((error) => error.pointer ?? error.parameter);

test('bad input', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small(1, 4));
  const before = await server.counts();
  const unchanged = async () => assert.deepEqual(await server.counts(), before, 'nothing is stored');

  for (const [what, body, statuses, expected] of bodies) {
    await t.test(`a spec with ${what}`, async () => {
      for (const path of ['/v1/jobs', '/v1/jobs?dry_run=true']) {
        const response = await server.request('POST', path, { body, headers: { 'Content-Type': 'application/json' } });
        assert.ok(statuses.includes(response.status), `${response.status}: ${response.text}`);
        if (expected instanceof RegExp) assert.match(JSON.stringify([response.json.detail, response.json.errors]), expected, 'the byte offset');
        else for (const pointer of expected ?? []) {
          const fits = pointer instanceof RegExp ? (fault) => pointer.test(fault) : (fault) => fault === pointer;
          assert.ok(faults(response.json).some(fits), `nothing points at ${pointer}: ${response.text}`);
        }
      }
      await unchanged();
    });
  }

  for (const [what, method, path, headers, body, statuses, parameters] of requests(job.id)) {
    await t.test(`a request with ${what}`, async () => {
      // Node's client knows no made-up methods; those go over a plain socket.
      const response = method === 'BREW' ? (await rawExchange(server, `BREW ${path} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n`))
        : await send(server.port, method, path, { headers, body });
      assert.ok(statuses.includes(response.status), `${response.status}: ${response.text}`);
      if (method === 'BREW') server.contract.checkProblem(response, what);
      else server.contract.check(method, path, response, { gate: response.status === 431 });
      for (const parameter of parameters ?? []) assert.ok(faults(response.json).includes(parameter), `nothing names ${parameter}: ${response.text}`);
      if (response.status === 405) assert.ok(response.headers.allow);
      await unchanged();
    });
  }
});

async function rawExchange(server, bytes) {
  const { responses, closed } = await sendRaw(server.port, bytes);
  assert.equal(responses.length, 1, `one answer (closed: ${closed})`);
  return responses[0];
}
