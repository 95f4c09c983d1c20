// jobs: one job's way from submission to its results, as a client sees it.
import assert from 'node:assert/strict';
import test from 'node:test';
import { allEvents, finishedJob, parseCsv, reached, show, small, submit } from './harness/jobs.mjs';
import { startServer } from './harness/server.mjs';

const jobKeys = ['id', 'kind', 'name', 'labels', 'state', 'reason', 'submitted_by', 'created_at', 'started_at', 'finished_at',
  'revision', 'last_seq', 'digest', 'engine_version', 'origin', 'spec', 'progress', 'links'];
const progressKeys = ['time_h', 'cells', 'active', 'passive', 'senescent', 'fraction', 'cells_per_s', 'eta_s'];
const cellKeys = ['cell_id', 'parent_id', 'generation', 'ordinal', 'activity', 'x_um', 'y_um', 'z_um', 'nucleus_x_um', 'nucleus_y_um',
  'nucleus_z_um', 'nucleus_radius_um', 'a_um', 'b_um', 'c_um', 'w1_rad', 'w2_rad', 'w3_rad', 'noise_u', 'noise_v', 'noise_w', 'born_h',
  'due_h', 'settle_due_h', 'move_due_h', 'free_share', 'try_count', 'volume_um3', 'deformed_volume_um3'];
const seriesKeys = ['time_h', 'cell_count', 'active_count', 'passive_count', 'senescent_count', 'volume_mean_um3', 'volume_sd_um3',
  'radius_um', 'area_um2', 'density_per_mm2'];
const eventKeys = {
  founded: ['cell'],
  divided: ['cells', 'plane', 'direction', 'fitness', 'evaluation_count', 'corrected', 'woken'],
  inhibited: ['fitness', 'free_share', 'try_count', 'due_h'],
  settled: ['nucleus_um', 'nearest_membrane_um', 'deformed_volume_um3', 'due_h'],
  senesced: [],
  finished: ['reason', 'cell_count'],
};
const hasKeys = (object, keys, what) => assert.deepEqual(keys.filter((key) => !(key in object)), [], `${what} lacks these`);
const lines = (text) => text.split('\n').filter(Boolean).map((line) => JSON.parse(line));

test('a finished job', async (t) => {
  const server = await startServer(t);
  const spec = { ...small(), labels: { plate: '7', 'lab-room': 'B 2' } };
  const submitted = await submit(server, spec);
  assert.equal(submitted.kind, 'colony');
  assert.deepEqual(submitted.labels, spec.labels);
  assert.ok(['queued', 'running', 'succeeded'].includes(submitted.state));
  const job = await reached(server, submitted.id, 'succeeded');
  const base = `/v1/jobs/${job.id}`;
  const events = await allEvents(server, job.id);
  const cells = (await server.get(`${base}/cells`)).json.items;

  await t.test('has the fields of the interface', () => {
    hasKeys(job, jobKeys, 'the job');
    hasKeys(job.progress, progressKeys, 'its progress');
    assert.match(job.id, /^[0-9a-f]{8}-[0-9a-f]{4}-7[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}$/);
    assert.match(job.digest, /^[0-9a-f]{32}$/);
    assert.equal(job.reason, 'cells');
    assert.equal(job.progress.cells, 24);
    assert.equal(job.progress.fraction, 1);
    assert.equal(job.progress.active + job.progress.passive + job.progress.senescent, 24);
    assert.ok(job.created_at <= job.started_at && job.started_at <= job.finished_at);
    assert.equal(job.spec.seed, 7);
    assert.equal(job.spec.model.cycle.mean_h, 12, 'the stored spec is complete, defaults included');
    assert.ok(job.revision >= 3);
  });

  await t.test('has a dense history that ends with finished', () => {
    assert.deepEqual(events.map(({ seq }) => seq), events.map((_, index) => index + 1));
    assert.equal(events.length, job.last_seq);
    assert.equal(events[0].kind, 'founded');
    for (const event of events) {
      hasKeys(event, ['seq', 'time_h', 'kind', 'cell_id', 'digest', ...eventKeys[event.kind]], `event ${event.seq} (${event.kind})`);
      assert.equal(event.cell_id === null, event.kind === 'finished');
    }
    for (let i = 1; i < events.length; ++i) assert.ok(events[i].time_h >= events[i - 1].time_h);
    const last = events.at(-1);
    assert.deepEqual([last.kind, last.reason, last.cell_count, last.digest], ['finished', 'cells', 24, job.digest]);
    assert.equal(events.filter(({ kind }) => kind === 'divided').length, 23, 'one division for every cell but the founder');
  });

  await t.test('gives the same events as JSON, NDJSON and CSV', async () => {
    const ndjson = await server.get(`${base}/events`, { Accept: 'application/x-ndjson' });
    assert.deepEqual(lines(ndjson.text), events);
    const csv = parseCsv((await server.get(`${base}/events`, { Accept: 'text/csv' })).text);
    assert.equal(csv.length, events.length);
    csv.forEach((row, index) => {
      const event = events[index];
      for (const name of ['seq', 'time_h', 'kind', 'cell_id', 'digest']) {
        const value = event[name] === null ? '' : String(event[name]);
        if (name === 'seq' || name === 'time_h') assert.equal(Number(row[name]), event[name]);
        else assert.equal(row[name], value, `${name} of row ${index + 1}`);
      }
      for (const name of ['fitness', 'free_share', 'deformed_volume_um3'].filter((key) => key in row && typeof event[key] === 'number')) {
        assert.equal(Number(row[name]), event[name], `${name} is printed to round-trip`);
      }
    });
  });

  await t.test('pages and filters its events', async () => {
    assert.deepEqual(await allEvents(server, job.id, 7), events);
    const divided = (await server.get(`${base}/events?kind=divided`)).json.items;
    assert.deepEqual(divided, events.filter(({ kind }) => kind === 'divided'));
    const one = (await server.get(`${base}/events?cell_id=2`)).json.items;
    assert.ok(one.length > 0 && one.every((event) => event.cell_id === 2 || JSON.stringify(event).includes('"cell_id":2')));
    const tail = lines((await server.get(`${base}/events?after=${job.last_seq - 3}`, { Accept: 'application/x-ndjson' })).text);
    assert.deepEqual(tail, events.slice(-3));
    const none = (await server.get(`${base}/events?after=${job.last_seq}`)).json;
    assert.deepEqual(none, { items: [], next: null });
  });

  await t.test('gives the colony at any time', async () => {
    assert.equal(cells.length, 24);
    for (const cell of cells) hasKeys(cell, cellKeys, 'a cell');
    assert.deepEqual(cells.map(({ cell_id: id }) => id), cells.map((_, index) => index + 1));
    const csv = await server.get(`${base}/cells`, { Accept: 'text/csv' });
    const columns = csv.text.split(/\r?\n/)[0].split(',');
    assert.deepEqual(columns.slice(0, cellKeys.length), cellKeys);
    assert.deepEqual(columns, Object.keys(cells[0]));
    parseCsv(csv.text).forEach((row, index) => {
      for (const key of columns) {
        const value = cells[index][key];
        if (typeof value === 'number') assert.equal(Number(row[key]), value, `${key} of cell ${index + 1}`);
        else assert.equal(row[key], value ?? '', `${key} of cell ${index + 1}`);
      }
    });
    assert.deepEqual(lines((await server.get(`${base}/cells`, { Accept: 'application/x-ndjson' })).text), cells);
    assert.equal((await server.get(`${base}/cells?at_h=0`)).json.items.length, 1);
    const half = job.progress.time_h / 2;
    const then = (await server.get(`${base}/cells?at_h=${half}`)).json.items.length;
    assert.equal(then, 1 + events.filter((event) => event.kind === 'divided' && event.time_h <= half).length);
    assert.deepEqual((await server.get(`${base}/cells?at_h=99999`)).json.items, cells, 'beyond the end: the final state');
  });

  await t.test('gives its growth curve in equal steps', async () => {
    const rows = (await server.get(`${base}/series?points=11`)).json.items;
    assert.equal(rows.length, 11);
    for (const row of rows) hasKeys(row, seriesKeys, 'a row of the series');
    assert.equal(rows[0].time_h, 0);
    assert.equal(rows.at(-1).cell_count, 24);
    rows.forEach((row, index) => {
      assert.ok(Math.abs(row.time_h - index * job.progress.time_h / 10) < 1e-9 * job.progress.time_h + 1e-12);
      assert.equal(row.cell_count, row.active_count + row.passive_count + row.senescent_count);
      const divisions = events.filter((event) => event.kind === 'divided' && event.time_h <= row.time_h).length;
      assert.equal(row.cell_count, 1 + divisions, `cells at ${row.time_h} h`);
      assert.ok(Math.abs(row.radius_um - Math.sqrt(row.area_um2 / Math.PI)) < 1e-6 * row.radius_um);
    });
    assert.equal((await server.get(`${base}/series`)).json.items.length, 200);
  });

  await t.test('gives pictures', async () => {
    const width = (png) => png.body.readUInt32BE(16);
    const image = (query, headers) => server.get(`${base}/image${query}`, headers);
    const pictures = [];
    for (const style of ['shaded', 'contours']) {
      const png = await image(`?style=${style}&width_px=300`);
      assert.equal(png.status, 200);
      assert.equal(png.body.subarray(0, 8).toString('latin1'), '\x89PNG\r\n\x1a\n');
      assert.equal(png.body.subarray(-8, -4).toString('latin1'), 'IEND');
      assert.equal(width(png), 300);
      pictures.push(png.body.toString('base64'));
    }
    assert.notEqual(pictures[0], pictures[1]);
    assert.equal(width(await image('')), 1024);
    const early = await image('?width_px=300&at_h=0');
    assert.notEqual(early.body.toString('base64'), pictures[0]);
    assert.ok((await image('?width_px=300&at_h=0')).body.equals(early.body), 'the same question has the same answer');
    const scaled = await image('?um_per_px=0.5&at_h=0');
    assert.equal(scaled.status, 200);
  });

  await t.test('keeps a log', async () => {
    const log = lines((await server.get(`${base}/log`)).text);
    assert.ok(log.length >= 1);
    for (const line of log) hasKeys(line, ['at', 'level', 'message'], 'a log line');
  });

  await t.test('answers HEAD like GET, without the body', async () => {
    const head = await server.request('HEAD', base);
    assert.deepEqual([head.status, head.body.length], [200, 0]);
    assert.equal(head.headers['content-type'], (await server.get(base)).headers['content-type']);
  });

  await t.test('comes out the same from the same spec and seed, and differently from another seed', async () => {
    const twin = await finishedJob(server, spec);
    assert.equal(twin.digest, job.digest);
    assert.deepEqual(await allEvents(server, twin.id), events);
    const other = await finishedJob(server, { ...spec, seed: 8 });
    assert.notEqual(other.digest, job.digest);
  });

  await t.test('outlives the server', async () => {
    await server.stop();
    const next = await startServer(t, { data: server.data });
    assert.deepEqual(await show(next, job.id), job);
    assert.deepEqual(await allEvents(next, job.id), events);
  });
});

test('submission', async (t) => {
  const server = await startServer(t);

  await t.test('a dry run answers with the complete spec and an estimate, and stores nothing', async () => {
    const before = await server.counts();
    const response = await server.post('/v1/jobs?dry_run=true', small());
    assert.equal(response.status, 200);
    assert.equal(response.json.spec.model.cycle.mean_h, 12);
    assert.equal(response.json.spec.until.time_h, 10_000, 'cells alone imply a bound in time');
    assert.ok(JSON.stringify(response.json).includes('estimate'));
    assert.deepEqual(await server.counts(), before);
    const bad = await server.post('/v1/jobs?dry_run=true', { ...small(), seed: -1 });
    assert.equal(bad.status, 422);
  });

  await t.test('the same key and body is the same job; another body is refused', async () => {
    const key = { 'Idempotency-Key': 'plate-7-well-B2' };
    const first = await server.post('/v1/jobs', small(), key);
    const again = await server.post('/v1/jobs', small(), key);
    assert.deepEqual([first.status, again.status], [201, 200]);
    assert.equal(again.json.id, first.json.id);
    const other = await server.post('/v1/jobs', small(8), key);
    assert.equal(other.status, 422);
    const { json: page } = await server.get('/v1/jobs');
    assert.equal(page.items.length, 1);
  });

  await t.test('the same key from several at once makes one job', async () => {
    const answers = await Promise.all(Array.from({ length: 8 }, () => server.post('/v1/jobs', small(9), { 'Idempotency-Key': 'at-once' })));
    assert.equal(new Set(answers.map(({ json }) => json.id)).size, 1);
    assert.deepEqual(answers.map(({ status }) => status).sort(), [200, 200, 200, 200, 200, 200, 200, 201]);
  });

  await t.test('generation_limit ends a colony with all cells senescent', async () => {
    const job = await finishedJob(server, { preset: 'paper', seed: 2, until: { time_h: 500 }, model: { division: { generation_limit: 2 } } });
    assert.equal(job.reason, 'all_senescent');
    assert.ok(job.progress.cells <= 4 && job.progress.senescent === job.progress.cells);
  });

  await t.test('a bound in time ends a colony then', async () => {
    const job = await finishedJob(server, { preset: 'paper', seed: 2, until: { time_h: 30 } });
    assert.equal(job.reason, 'time');
    assert.ok(job.progress.time_h <= 30);
  });

  await t.test('the cells of a young colony move, and those that cannot are told too', async () => {
    const job = await finishedJob(server, { preset: 'young-colony', seed: 3, until: { cells: 25 } });
    const places = new Map();
    let made = 0, moved = 0;
    for (const event of await allEvents(server, job.id)) {
      for (const cell of event.cells ?? (event.cell ? [event.cell] : [])) {
        if (event.kind === 'moved') {
          const [x, y] = places.get(cell.cell_id);
          const step = Math.hypot(cell.x_um - x, cell.y_um - y);
          assert.ok(step === 0 || Math.abs(step - 3) < 1e-9, `a step of ${step} um`);
          assert.ok(cell.move_due_h >= event.time_h + 1);
          moved += 1;
          made += step > 0 ? 1 : 0;
        }
        places.set(cell.cell_id, [cell.x_um, cell.y_um]);
      }
    }
    assert.ok(made > 5 && moved >= made, `${made} of ${moved}`);
    const { json } = await server.get(`/v1/jobs/${job.id}/cells`);
    assert.deepEqual(json.items.map((cell) => [cell.x_um, cell.y_um]), json.items.map((cell) => places.get(cell.cell_id)));
    assert.ok(json.items.every((cell) => cell.move_due_h > 0));
  });

  await t.test('several founders over a disc, and at given positions', async () => {
    const disc = await finishedJob(server, { preset: 'clonogenic', seed: 4, until: { time_h: 5 }, model: { founders: { count: 12, radius_um: 300 } } });
    const events = await allEvents(server, disc.id);
    assert.equal(events.filter(({ kind }) => kind === 'founded').length, 12);
    const positions = [[0, 0], [100, -50.5], [-200, 30]];
    const given = await finishedJob(server, { preset: 'paper', seed: 4, until: { time_h: 1 }, model: { founders: { positions_um: positions } } });
    const { json } = await server.get(`/v1/jobs/${given.id}/cells?at_h=0`);
    assert.deepEqual(json.items.map((cell) => [cell.x_um, cell.y_um]), positions);
  });
});

test('lists', async (t) => {
  const server = await startServer(t, { args: ['--jobs.concurrent-max', '1'] });
  const ids = [];
  for (let i = 0; i < 7; ++i) {
    const labels = { parity: i % 2 ? 'odd' : 'even' };
    ids.unshift((await submit(server, { ...small(i, 2), name: `job ${i}`, labels })).id);
  }
  for (const id of ids) await reached(server, id, 'succeeded');
  const idsOf = (response) => response.json.items.map(({ id }) => id);

  await t.test('are newest first and come in pages by an opaque cursor', async () => {
    assert.deepEqual(idsOf(await server.get('/v1/jobs')), ids);
    const seen = [];
    let path = '/v1/jobs?limit=3';
    for (let pages = 1; path; ++pages) {
      const page = await server.get(path);
      seen.push(...idsOf(page));
      assert.ok(pages <= 3);
      const next = page.json.next;
      assert.equal(/rel="?next"?/.test(page.headers.link ?? ''), next !== null);
      path = next === null ? undefined : `/v1/jobs?limit=3&cursor=${encodeURIComponent(next)}`;
    }
    assert.deepEqual(seen, ids);
  });

  await t.test('are filtered by state, kind, name and label', async () => {
    assert.deepEqual(idsOf(await server.get('/v1/jobs?state=succeeded')), ids);
    assert.deepEqual(idsOf(await server.get('/v1/jobs?state=failed')), []);
    assert.deepEqual(idsOf(await server.get('/v1/jobs?kind=colony')), ids);
    assert.deepEqual(idsOf(await server.get('/v1/jobs?name=job%203')), [ids[3]]);
    assert.deepEqual(idsOf(await server.get('/v1/jobs?label=parity:odd')), [ids[1], ids[3], ids[5]]);
    assert.deepEqual(idsOf(await server.get('/v1/jobs?label=parity:odd&name=job%204')), []);
  });

  await t.test('are counted by state', async () => {
    const counts = await server.counts();
    assert.equal(JSON.stringify(counts).match(/"succeeded":7\b/g)?.length, 1);
    for (const state of ['queued', 'running', 'paused', 'failed', 'cancelled']) assert.match(JSON.stringify(counts), new RegExp(`"${state}":0\\b`));
  });
});
