// pictures: what is seen and measured of a job, and pictures that people send: analysed, compared, refused.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import validator from 'gltf-validator';
import { finishedJob, small } from './harness/jobs.mjs';
import { discs, greyPng, pngFacts } from './harness/png.mjs';
import { assertSane, cleanEnvironment, cliBinary, startServer, temporaryFolder } from './harness/server.mjs';
import { eventually, within } from './harness/wait.mjs';

const sendPicture = (server, body, query = '', type = 'image/png') =>
  server.request('POST', `/v1/analyses${query}`, { body, headers: { 'Content-Type': type } });

function colony(server, args) {
  const child = spawn(cliBinary, ['--server', server.url, ...args], { env: cleanEnvironment() });
  let out = '', err = '';
  child.stdout.on('data', (bytes) => { out += bytes; });
  child.stderr.on('data', (bytes) => { err += bytes; });
  return within(120_000, new Promise((done) => child.on('close', (code) => done({ code, out, err }))), `colony ${args[0]}`)
    .then((run) => { assertSane(run.err); return run; });
}

/** A little-endian TIFF of one strip that says it is width x height. */
function tiff(width, height, data) {
  const entries = [[256, 4, width], [257, 4, height], [258, 3, 8], [259, 3, 1], [262, 3, 1], [273, 4, 8], [277, 3, 1], [278, 4, height], [279, 4, data.length]];
  const at = 8 + data.length;
  const out = Buffer.alloc(at + 2 + 12 * entries.length + 4);
  out.write('II*\0', 'latin1');
  out.writeUInt32LE(at, 4);
  data.copy(out, 8);
  out.writeUInt16LE(entries.length, at);
  entries.forEach(([tag, type, value], i) => {
    const entry = at + 2 + 12 * i;
    out.writeUInt16LE(tag, entry);
    out.writeUInt16LE(type, entry + 2);
    out.writeUInt32LE(1, entry + 4);
    if (type === 3) out.writeUInt16LE(value, entry + 8);
    else out.writeUInt32LE(value, entry + 8);
  });
  return out;
}

test('of cells that lie on each other it is said how many are hidden', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, { preset: 'tumour', seed: 1, until: { cells: 200 } });
  const { json } = await server.get(`/v1/jobs/${job.id}/analysis?width_px=1024`);
  assert.equal(json.cell_count, 200, 'all of the colony');
  assert.ok(json.visible_cell_count < 190, `${json.visible_cell_count} are seen`);
  const { measured_count: measured, partly_hidden_count: partly, area_px: area } = json.cells;
  assert.ok(partly > 0 && measured + partly <= json.visible_cell_count);
  assert.ok(area.min >= 20);
  assert.ok(json.cells.circularity.max < 1.09, `${json.cells.circularity.max}: no slivers`);
  assert.match(json.neighbours.not_judged, /^the table is of a sheet/);
  const words = json.verdict.join(' ');
  assert.match(words, new RegExp(`Of the colony's 200 cells, ${200 - json.visible_cell_count} are hidden under others`));
  assert.doesNotMatch(words, /against Gibson's table p/);
  // One cell alone: figures, and nothing that follows from them.
  const lone = (await server.get(`/v1/jobs/${job.id}/analysis?at_h=0&width_px=512`)).json;
  assert.equal(lone.findings.walls.finding, 'too_few');
  assert.equal(lone.fractal.walls.finding, 'too_few');
  assert.doesNotMatch(lone.verdict.join(' '), /consistent with scaling|they tile it/);
});

test('a job is seen, measured and compared', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small());
  const base = `/v1/jobs/${job.id}`;

  await t.test('in every style, and as OME-TIFF', async () => {
    const pictures = new Set();
    for (const style of ['shaded', 'contours', 'brightfield', 'phase', 'labels']) {
      const { body, status } = await server.get(`${base}/image?style=${style}&width_px=200`);
      assert.equal(status, 200);
      const facts = pngFacts(body);
      assert.equal(facts.width, 200);
      assert.ok(facts.rowsBytes > facts.width * facts.height);
      pictures.add(body.toString('base64'));
    }
    assert.equal(pictures.size, 5);
    const ome = await server.get(`${base}/image?width_px=200`, { Accept: 'image/tiff' });
    assert.match(ome.body.toString('latin1'), /<OME [\s\S]*PhysicalSizeX[\s\S]*<\/OME>/);
    const wide = await server.get(`${base}/image?width_px=8193`);
    assert.equal(wide.status, 422);
  });

  await t.test('as a mesh that the Khronos validator accepts', async () => {
    for (const query of ['?triangles_max=20000', '?nuclei=false&at_h=0']) {
      const { body, status } = await server.get(`${base}/mesh${query}`);
      assert.equal(status, 200);
      const report = await validator.validateBytes(new Uint8Array(body), { maxIssues: 100 });
      assert.equal(report.issues.numErrors + report.issues.numWarnings, 0, JSON.stringify(report.issues.messages.slice(0, 5)));
      assert.ok(report.info.totalTriangleCount > 100 && report.info.totalTriangleCount <= 200_000);
    }
  });

  await t.test('as a lineage whose leaves are its cells', async () => {
    const newick = (await server.get(`${base}/lineage`, { Accept: 'text/x-newick' })).text;
    const named = [...newick.matchAll(/[(,](\d+):/g)].map(([, id]) => Number(id)).sort((a, b) => a - b);
    assert.deepEqual(named, Array.from({ length: 24 }, (_, i) => i + 1));
    const table = (await server.get(`${base}/lineage`)).json;
    assert.equal(table.items.length, 24);
    assert.equal(table.items.reduce((sum, item) => sum + item.daughter_ids.length, 0), 23);
  });

  await t.test('with controls beside each answer', async () => {
    const { json, status } = await server.get(`${base}/analysis`);
    assert.equal(status, 200);
    assert.equal(json.cell_count, 24);
    assert.deepEqual(json.controls.map(({ name }) => name), ['without_noise', 'hexagonal', 'random_discs']);
    assert.ok(json.verdict.length > 0);
    assert.deepEqual((await server.get(`${base}/analysis`)).json, json, 'asked twice, the same to the last digit');
    assert.match(json.verdict.join(' '), /What follows for the cell walls/);
    const table = (await server.get(`${base}/analysis`, { Accept: 'text/csv' })).text.trim().split('\r\n');
    assert.equal(table.length, 25, 'a line a cell and the head');
    assert.match(table[0], /^cell_id,area_px,area_um2,/);
  });

  await t.test('against a picture, pixels per cell matched', async () => {
    const analysis = (await sendPicture(server, discs(6, 9), '?pipeline=nuclei&um_per_px=0.5')).json;
    const made = await server.post('/v1/comparisons', { job_id: job.id, analysis_id: analysis.id, name: 'discs' });
    assert.equal(made.status, 201, made.text);
    const { simulated, real } = made.json.result;
    assert.ok(Math.abs(simulated.object_area_mean_px / real.object_area_mean_px - 1) < 0.02);
    assert.equal(simulated.object_kind, 'nuclei', 'nuclei with nuclei');
    assert.match(made.json.result.verdict[0], /^Matched by area: a nucleus of the colony/);
    assert.equal(made.headers.location, made.json.links.self);
    const figure = await server.get(made.json.links.figure);
    assert.ok(pngFacts(figure.body).width > 1000);
    assert.equal((await server.get('/v1/comparisons')).json.items.length, 1);
    assert.equal((await server.request('DELETE', made.json.links.self)).status, 204);
    assert.equal((await server.get(made.json.links.self)).status, 404);
  });

  await t.test('by the command line', async () => {
    const folder = temporaryFolder(t);
    const page = join(folder, 'report.html');
    const reported = await colony(server, ['report', job.id, '-o', page]);
    assert.equal(reported.code, 0, reported.err);
    const html = readFileSync(page, 'utf8');
    assert.ok(html.includes(job.digest));
    assert.doesNotMatch(html, /(src|href)\s*=\s*"(?!data:)/i, 'nothing is loaded from anywhere');
    assert.doesNotMatch(html, /<script|@import|url\(/i);
    assert.equal(html.match(/<svg/g).length, html.match(/<\/svg>/g).length);
    const half = job.progress.time_h / 2;
    assert.equal((await colony(server, ['report', job.id, '--at-h', String(half), '-o', page])).code, 0);
    const then = (await server.get(`${base}/analysis?at_h=${half}`)).json;
    assert.ok(then.cell_count < 24);
    assert.match(readFileSync(page, 'utf8'), new RegExp(`<th>digest</th><td><code>${then.digest}`), 'the page says of which moment it is');
    const picture = join(folder, 'discs.png');
    writeFileSync(picture, discs(6, 9));
    const analyzed = await colony(server, ['analyze', picture, '--pipeline', 'nuclei', '--steps', join(folder, 'steps')]);
    assert.equal(analyzed.code, 0, analyzed.err);
    assert.match(analyzed.out, /36 nuclei/);
    assert.match(analyzed.out, /pipeline nuclei, asked for/);
    assert.match(analyzed.out, /threshold \d+: outlines of the nuclei D0 \d/);
    const id = /analysis (\S+)/.exec(analyzed.out)[1];
    const compared = await colony(server, ['compare', job.id, id, '--figure', join(folder, 'figure.png')]);
    assert.equal(compared.code, 0, compared.err);
    assert.ok(pngFacts(readFileSync(join(folder, 'figure.png'))).height > 1000);
    const measured = await colony(server, ['measure', job.id, '--um-per-px', '0.2']);
    assert.equal(measured.code, 0, measured.err);
    assert.match(measured.out, /Gibson's table/, 'sides, held against it or why not');
    const objects = join(folder, 'objects.csv'), sheet = join(folder, 'analysis.html');
    assert.equal((await colony(server, ['analyze', picture, '--objects', objects, '--html', sheet])).code, 0);
    assert.equal(readFileSync(objects, 'utf8').trim().split('\r\n').length, 37);
    assert.match(readFileSync(sheet, 'utf8'), /Against the threshold/);
    assert.match((await colony(server, ['analysis', id.slice(-8)])).out, /objects: 36/);
    assert.equal((await colony(server, ['delete-analysis', id.slice(-8)])).code, 0);
    const orphan = (await server.get('/v1/comparisons')).json.items[0];
    assert.equal(orphan.links.figure, null);
    assert.equal((await colony(server, ['delete-comparison', orphan.id])).code, 0);
    assert.match((await colony(server, ['lineage', job.id])).out, /;\n$/);
    assert.equal((await colony(server, ['mesh', job.id, '-o', join(folder, 'm.glb')])).code, 0);
    const text = join(folder, 'text.png');
    writeFileSync(text, 'this is a text');
    assert.equal((await colony(server, ['analyze', text])).code, 2);
  });
});

test('bad pictures are refused with a reason, and nothing is kept', async (t) => {
  const server = await startServer(t);
  const good = discs(4, 8);
  const rows = [
    ['nothing', Buffer.alloc(0), 400, /empty/],
    ['a text called .png', Buffer.from('this is a text'), 400, /PNG, TIFF or JPEG/],
    ['a truncated PNG', good.subarray(0, good.length - 200), 400, /./],
    ['a PNG with a broken chunk', Buffer.concat([good.subarray(0, 45), Buffer.from([1, 2, 3]), good.subarray(48)]), 400, /./],
    ['no foreground', greyPng(64, 64, () => 0), 422, /./],
    ['all white', greyPng(64, 64, () => 255), 422, /./],
    ['one pixel', greyPng(1, 1, () => 9), 422, /./],
    ['1 x 50,000', greyPng(1, 50_000, (x, y) => y % 2 * 255), 422, /./],
    ['a TIFF that says it is huge', tiff(60_000, 60_000, Buffer.alloc(16)), 422, /./, 'image/tiff'],
    ['a TIFF of less than it says', tiff(4000, 4000, Buffer.alloc(16)), 400, /./, 'image/tiff'],
  ];
  for (const [what, bytes, status, detail, type] of rows) {
    const answer = await sendPicture(server, bytes, '', type);
    assert.equal(answer.status, status, `${what}: ${answer.text}`);
    assert.match(answer.json.detail, detail, what);
  }
  for (const type of ['text/plain', 'application/x-www-form-urlencoded', 'multipart/form-data; boundary=x', 'application/json', 'image/gif']) {
    assert.equal((await sendPicture(server, good, '', type)).status, 415, type);
  }
  assert.equal((await sendPicture(server, good, '', 'image/jpeg')).status, 422);
  for (const query of ['?channel=7', '?um_per_px=0', '?threshold=255', '?pipeline=magic', '?foreground=grey', '?colour=1', '?split=2', '?window_radius_px=51']) {
    assert.equal((await sendPicture(server, good, query)).status, 422, query);
  }
  const large = await server.request('POST', '/v1/analyses', { body: Buffer.alloc(33_554_433), headers: { 'Content-Type': 'image/png' } });
  assert.equal(large.status, 413);
  assert.deepEqual((await server.get('/v1/analyses')).json, { items: [], next: null });
});

test('a large picture is worked on later, through a kill', async (t) => {
  const data = temporaryFolder(t);
  const first = await startServer(t, { data });
  const sent = await sendPicture(first, discs(51, 10), '?pipeline=nuclei&name=large');
  assert.equal(sent.status, 202, sent.text);
  await first.kill();
  const second = await startServer(t, { data });
  const row = await eventually('the analysis to be done', async () => {
    const { json } = await second.get(sent.json.links.self);
    return json.state === 'succeeded' || json.state === 'failed' ? json : undefined;
  });
  assert.equal(row.state, 'succeeded', row.detail);
  assert.equal(row.result.segmentation.object_count, 51 * 51);
  for (const { name } of row.result.steps.slice(0, 2)) {
    assert.equal(pngFacts((await second.get(`${row.links.self}/steps/${name}`)).body).width, 2040);
  }
});
