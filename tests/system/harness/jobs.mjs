// jobs: specs that the suites share, and waiting for what becomes of them.
import assert from 'node:assert/strict';
import { eventually } from './wait.mjs';

export const terminal = ['succeeded', 'failed', 'cancelled'];

/** Ends by itself within seconds. */
export const small = (seed = 7, cells = 24) => ({ name: 'small', seed, preset: 'paper', until: { cells } });

/** Does not end while a test looks at it: no generation limit, and bounds far beyond what a test waits for. */
export const endless = (seed = 11) => ({
  name: 'endless', seed, preset: 'paper', until: { cells: 900_000, time_h: 9_999 }, model: { division: { generation_limit: null } },
});

export async function submit(server, spec, headers) {
  const response = await server.post('/v1/jobs', spec, headers);
  assert.equal(response.status, 201, response.text);
  assert.equal(response.headers.location, `/v1/jobs/${response.json.id}`);
  return response.json;
}

/** cancel, pause or resume: a POST without a body, but with the content type that every POST must have. */
export function command(server, id, name) {
  return server.post(`/v1/jobs/${id}/${name}`, undefined, { 'Content-Type': 'application/json' });
}

export async function show(server, id) {
  const response = await server.get(`/v1/jobs/${id}`);
  assert.equal(response.status, 200, response.text);
  return response.json;
}

/** Waits until the job's state is one of these; a terminal state not among them fails at once. */
export function reached(server, id, states, limit_ms = 240_000) {
  const wanted = [states].flat();
  return eventually(`job ${id} to be ${wanted.join(' or ')}`, async () => {
    const job = await show(server, id);
    if (wanted.includes(job.state)) return job;
    assert.ok(!terminal.includes(job.state), `job ${id} is ${job.state} (${job.reason}), not ${wanted.join(' or ')}`);
    return undefined;
  }, limit_ms);
}

/** Waits until a live job has stored at least this many events. */
export function grown(server, id, seq) {
  return eventually(`job ${id} to reach event ${seq}`, async () => {
    const job = await show(server, id);
    assert.ok(job.last_seq >= seq || !terminal.includes(job.state), `job ${id} ended at event ${job.last_seq}`);
    return job.last_seq >= seq && job;
  });
}

export async function finishedJob(server, spec) {
  const { id } = await submit(server, spec);
  return reached(server, id, 'succeeded');
}

/** Every event, by JSON pages. */
export async function allEvents(server, id, pageLimit = 1000) {
  const events = [];
  for (;;) {
    const after = events.at(-1)?.seq ?? 0;
    const { json } = await server.get(`/v1/jobs/${id}/events?after=${after}&limit=${pageLimit}`);
    events.push(...json.items);
    if (json.items.length < pageLimit) return events;
  }
}

/** Rows of a CSV text (RFC 4180) as objects of strings. */
export function parseCsv(text) {
  const rows = [[]];
  let field = '';
  let quoted = false;
  for (let at = 0; at < text.length; ++at) {
    const ch = text[at];
    if (quoted) {
      if (ch === '"' && text[at + 1] === '"') field += text[++at];
      else if (ch === '"') quoted = false;
      else field += ch;
    } else if (ch === '"') quoted = true;
    else if (ch === ',') {
      rows.at(-1).push(field);
      field = '';
    } else if (ch === '\n') {
      rows.at(-1).push(field.replace(/\r$/, ''));
      field = '';
      rows.push([]);
    } else field += ch;
  }
  assert.deepEqual([rows.pop(), field, quoted], [[], '', false], 'the last line of a CSV text ends');
  const [header, ...lines] = rows;
  return lines.map((line) => {
    assert.equal(line.length, header.length, 'every CSV row has as many fields as the header');
    return Object.fromEntries(header.map((name, index) => [name, line[index]]));
  });
}
