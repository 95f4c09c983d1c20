// http_semantics: tags, preconditions, waiting, editing, links, the stream of a page, a base path: over real sockets.
import assert from 'node:assert/strict';
import test from 'node:test';
import { command, endless, finishedJob, grown, parseCsv, reached, small, submit } from './harness/jobs.mjs';
import { send } from './harness/http.mjs';
import { startServer } from './harness/server.mjs';
import { openStream } from './harness/stream.mjs';

const mergePatch = { 'Content-Type': 'application/merge-patch+json' };
const patch = (server, id, change, headers = {}) => server.request('PATCH', `/v1/jobs/${id}`, {
  body: JSON.stringify(change), headers: { ...mergePatch, ...headers },
});
/** The target of Link rel=next, or undefined. */
const nextOf = (response) => /^<([^>]+)>; rel="next"$/.exec(response.headers.link ?? '')?.[1];

test('what an answer is a function of', async (t) => {
  const server = await startServer(t);
  const job = await finishedJob(server, small(31, 20));
  const self = `/v1/jobs/${job.id}`;
  const derived = ['/events?limit=10', '/cells', '/cells?at_h=20', '/series?points=20', '/lineage', '/image?width_px=64',
    '/mesh?triangles_max=20000', '/analysis?width_px=128'];

  await t.test('names it by a tag, and 304 says that it is the same', async () => {
    for (const path of derived) {
      const first = await server.get(self + path);
      assert.equal(first.status, 200, path);
      assert.match(first.headers.etag, /^"[0-9a-f]{32}"$/, path);
      assert.equal(first.headers['cache-control'], 'private, no-cache');
      const again = await server.get(self + path, { 'If-None-Match': `"x", W/${first.headers.etag}` });
      assert.deepEqual([again.status, again.body.length, again.headers.etag], [304, 0, first.headers.etag], path);
      assert.equal(again.headers['content-type'], undefined);
      assert.equal(again.headers['content-length'], undefined);
      const head = await server.request('HEAD', self + path);
      assert.deepEqual([head.status, head.headers.etag, head.headers['content-type']], [200, first.headers.etag, first.headers['content-type']], path);
      assert.equal((await server.get(self + path, { 'If-Match': '"x"' })).status, 412);
    }
    const tags = await Promise.all(derived.map(async (path) => (await server.get(self + path)).headers.etag));
    assert.equal(new Set(tags).size, derived.length);
  });

  await t.test('the forms of one list have tags of their own, and Vary says so', async () => {
    const json = await server.get(`${self}/cells`, { Accept: 'application/json' });
    const csv = await server.get(`${self}/cells`, { Accept: 'text/csv;q=0.9, application/json;q=0.1' });
    assert.equal(parseCsv(csv.text).length, json.json.items.length);
    assert.notEqual(json.headers.etag, csv.headers.etag);
    assert.deepEqual([json.headers.vary, csv.headers.vary], ['Accept', 'Accept']);
    assert.equal((await server.get(`${self}/cells`, { Accept: 'text/csv', 'If-None-Match': json.headers.etag })).status, 200);
    const refused = await server.get(`${self}/cells`, { Accept: 'image/png' });
    assert.equal(refused.status, 406);
    for (const media of ['application/json', 'text/csv', 'application/x-ndjson']) assert.ok(refused.json.detail.includes(media));
  });

  await t.test('a restart changes no tag', async () => {
    const other = await startServer(t);
    const same = await finishedJob(other, small(31, 20));
    const [one, two] = await Promise.all([server.get(`${self}/image?width_px=64`), other.get(`/v1/jobs/${same.id}/image?width_px=64`)]);
    assert.equal(one.headers.etag, two.headers.etag, 'the same history, the same picture, wherever it was grown');
    assert.deepEqual(one.body, two.body);
  });

  await t.test('an unreadable precondition is told, not passed over', async () => {
    for (const name of ['If-Match', 'If-None-Match']) {
      const response = await server.get(self, { [name]: 'abc' });
      assert.equal(response.status, 400);
      assert.equal(response.json.errors[0].parameter, name);
    }
  });
});

test('waiting for a job', async (t) => {
  const server = await startServer(t);

  await t.test('hundreds wait without holding up anybody, and hear of the next revision', async () => {
    const { id } = await submit(server, endless(33));
    await grown(server, id, 5);
    const { headers: { etag }, json: { revision } } = await server.get(`/v1/jobs/${id}`);
    const wait = { 'If-None-Match': etag, Prefer: 'wait=60' };
    let answered = 0;
    const waiting = Array.from({ length: 200 }, () => server.get(`/v1/jobs/${id}`, wait).then((response) => {
      ++answered;
      return response;
    }));
    await grown(server, id, 40); // these requests are served, and commits of events answer nobody
    assert.equal((await server.get('/healthz')).status, 200);
    assert.equal(answered, 0);
    await patch(server, id, { name: 'called' });
    for (const response of await Promise.all(waiting)) {
      assert.deepEqual([response.status, response.json.name, response.json.revision], [200, 'called', revision + 1]);
      assert.equal(response.headers['preference-applied'], 'wait=60');
    }
    await command(server, id, 'cancel');
    await reached(server, id, 'cancelled');
  });

  await t.test('ends after N s with 304, or with what has grown', async () => {
    const done = await finishedJob(server, small(34, 8));
    const { headers: { etag } } = await server.get(`/v1/jobs/${done.id}`);
    const same = await server.get(`/v1/jobs/${done.id}`, { 'If-None-Match': etag, Prefer: 'wait=1' });
    assert.deepEqual([same.status, same.headers.etag, same.headers['preference-applied']], [304, etag, 'wait=1']);
    const { json: { revision } } = await server.get(`/v1/jobs/${done.id}`);
    const grownSince = await server.get(`/v1/jobs/${done.id}`, { 'If-None-Match': `"${revision}.1"`, Prefer: 'wait=0' });
    assert.equal(grownSince.status, 200);
  });
});

test('editing', async (t) => {
  const server = await startServer(t);

  await t.test('changes name and labels in any state; lists follow; nothing else moves', async () => {
    const { id } = await submit(server, { ...endless(36), name: 'one', labels: { plate: '7', dye: 'none' } });
    await grown(server, id, 3);
    const edited = await patch(server, id, { name: 'two', labels: { plate: '8', dye: null } });
    assert.equal(edited.status, 200);
    assert.deepEqual([edited.json.name, edited.json.labels], ['two', { plate: '8' }]);
    const found = await server.get('/v1/jobs?label=plate:8&name=two');
    assert.deepEqual(found.json.items.map((job) => job.id), [id]);
    assert.deepEqual((await server.get('/v1/jobs?label=plate:7')).json.items, []);
    await grown(server, id, edited.json.last_seq + 5);
    assert.equal((await server.get(`/v1/jobs/${id}`)).json.name, 'two', 'the runner does not bring the old name back');
    await command(server, id, 'cancel');
    const ended = await reached(server, id, 'cancelled');
    const after = await patch(server, id, { name: null, labels: null });
    assert.deepEqual([after.json.name, after.json.labels, after.json.state], ['', {}, 'cancelled']);
    assert.equal(after.json.revision, ended.revision + 1);
    assert.equal(after.json.digest, ended.digest);
    const log = await server.get(`/v1/jobs/${id}/log`);
    assert.ok(log.text.includes('renamed to'));
  });

  await t.test('with If-Match one of two wins, and an event in between does not count', async () => {
    const job = await finishedJob(server, small(37, 8));
    const { headers: { etag } } = await server.get(`/v1/jobs/${job.id}`);
    const both = await Promise.all(['a', 'b'].map((name) => patch(server, job.id, { name }, { 'If-Match': etag })));
    assert.deepEqual(both.map(({ status }) => status).sort(), [200, 412]);
    const winner = both.find(({ status }) => status === 200);
    assert.equal((await server.get(`/v1/jobs/${job.id}`)).json.name, winner.json.name);
    assert.equal((await patch(server, job.id, { name: 'c' }, { 'If-Match': `"${winner.json.revision}.0"` })).status, 200);
    assert.equal((await patch(server, job.id, { name: 'd' }, { 'If-Match': `W/"${winner.json.revision + 1}.0"` })).status, 412);
    const same = await patch(server, job.id, { name: 'c' });
    assert.equal(same.json.revision, winner.json.revision + 1, 'what is so already is no change');
    assert.equal((await server.request('DELETE', `/v1/jobs/${job.id}`, { headers: { 'If-Match': etag } })).status, 412);
  });

  await t.test('refuses what is wrong, and then nothing has changed', async () => {
    const job = await finishedJob(server, small(38, 8));
    const many = Object.fromEntries(Array.from({ length: 33 }, (_, n) => [`k${n}`, 'v']));
    for (const wrong of [{ state: 'failed' }, { labels: many }, { labels: { BAD: 'x' } }, { name: 'x'.repeat(201) }, [], { spec: null }]) {
      const response = await patch(server, job.id, wrong);
      assert.equal(response.status, 422, JSON.stringify(wrong));
    }
    const other = await server.request('PATCH', `/v1/jobs/${job.id}`, { json: { name: 'x' } });
    assert.deepEqual([other.status, other.headers['accept-patch']], [415, 'application/merge-patch+json']);
    assert.equal((await server.get(`/v1/jobs/${job.id}`)).json.revision, job.revision);
    assert.equal((await patch(server, '01890000-0000-7000-8000-00000000ffff', {})).status, 404);
  });
});

test('lists, methods, ids of requests', async (t) => {
  const server = await startServer(t);
  const jobs = [];
  for (let seed = 41; seed < 46; ++seed) jobs.push(await finishedJob(server, { ...small(seed, 4), labels: { set: 'a b&c' } }));

  await t.test('Link rel=next leads through every job once, the query kept', async () => {
    const seen = [];
    let target = '/v1/jobs?limit=2&state=succeeded&label=set:a%20b%26c';
    while (target) {
      const page = await server.get(target);
      assert.equal(page.status, 200);
      seen.push(...page.json.items.map((job) => job.id));
      target = nextOf(page);
      assert.equal(target === undefined, page.json.next === null);
    }
    assert.deepEqual(seen, jobs.map((job) => job.id).reverse());
  });

  await t.test('and through every event, of a filter too', async () => {
    for (const filter of ['', '&kind=divided,settled', '&cell_id=1']) {
      const whole = await server.get(`/v1/jobs/${jobs[0].id}/events?limit=100000${filter}`);
      assert.equal(nextOf(whole), undefined);
      const seen = [];
      let target = `/v1/jobs/${jobs[0].id}/events?limit=3${filter}`;
      while (target) {
        const page = await server.get(target);
        seen.push(...page.json.items);
        target = nextOf(page);
        assert.equal(target === undefined, page.json.next === null, 'body and Link say the same');
      }
      assert.deepEqual(seen, whole.json.items);
    }
  });

  await t.test('a list has the tag of its bytes', async () => {
    const first = await server.get('/v1/jobs');
    assert.equal((await server.get('/v1/jobs', { 'If-None-Match': first.headers.etag })).status, 304);
    await patch(server, jobs[0].id, { name: 'changed' });
    assert.equal((await server.get('/v1/jobs', { 'If-None-Match': first.headers.etag })).status, 200);
  });

  await t.test('every resource answers OPTIONS with its methods, HEAD like GET, and 405 with Allow', async () => {
    const openapi = (await server.get('/openapi.json')).json;
    for (const [template, item] of Object.entries(openapi.paths)) {
      const path = template.replace('{job_id}', jobs[0].id).replace(/\{\w+\}/g, 'none');
      const methods = Object.keys(item).map((name) => name.toUpperCase());
      const options = await send(server.port, 'OPTIONS', path);
      assert.equal(options.status, 204, path);
      const allowed = options.headers.allow.split(', ').sort();
      assert.deepEqual(allowed, [...methods, 'OPTIONS', ...(methods.includes('GET') ? ['HEAD'] : [])].sort(), path);
      if (methods.includes('PATCH')) assert.equal(options.headers['accept-patch'], 'application/merge-patch+json');
      if (methods.includes('POST')) assert.ok(options.headers['accept-post']);
      const put = await send(server.port, 'PUT', path);
      assert.deepEqual([put.status, put.headers.allow], [405, options.headers.allow], path);
      if (!methods.includes('GET') || item.get.operationId === 'streamJobs') continue;
      const [get, head] = [await server.get(path), await server.request('HEAD', path)];
      assert.equal(head.status, get.status, path);
      assert.equal(head.body.length, 0);
      assert.equal(head.headers['content-type'], get.headers['content-type'], path);
      assert.equal(head.headers.etag, get.headers.etag, path);
    }
  });

  await t.test('a fine id of a request comes back, in problems too; a wild one is replaced', async () => {
    const fine = await server.get('/v1/jobs/none', { 'X-Request-Id': 'page-7.a_B' });
    assert.deepEqual([fine.headers['x-request-id'], fine.json.request_id], ['page-7.a_B', 'page-7.a_B']);
    assert.equal((await server.get('/healthz', { 'X-Request-Id': 'page-8' })).headers['x-request-id'], 'page-8');
    for (const wild of ['a b', 'x'.repeat(65), '<script>', '"']) {
      const { headers, json } = await server.get('/v1/jobs/none', { 'X-Request-Id': wild });
      assert.match(headers['x-request-id'], /^[0-9a-f]{32}$/);
      assert.equal(json.request_id, headers['x-request-id']);
    }
    await server.stop();
    assert.ok(server.out.includes('page-7.a_B') || server.err.includes('page-7.a_B'), 'and stands in the log');
  });
});

test('the stream of a page', async (t) => {
  const server = await startServer(t);
  const names = (stream) => stream.events.map(({ event, data }) => `${event} ${JSON.parse(data).id ?? ''}`.trim());

  await t.test('state first, then what changes: new, growing, renamed, ended, deleted', async () => {
    const old = await finishedJob(server, small(51, 4));
    const all = await openStream(t, server, '/v1/stream?jobs=all');
    assert.equal(all.response.headers['content-type'], 'text/event-stream');
    await all.until('the state', () => all.find('ready'));
    assert.deepEqual(names(all), ['ready'], 'nothing has not ended');
    const { id } = await submit(server, endless(52));
    await all.until('progress', () => names(all).includes(`progress ${id}`));
    assert.ok(names(all).indexOf(`job ${id}`) < names(all).indexOf(`progress ${id}`), 'a job is told before its progress');
    await patch(server, id, { name: 'renamed' });
    await all.until('the new name', () => all.events.some(({ event, data }) => event === 'job' && JSON.parse(data).name === 'renamed'));
    await patch(server, old.id, { name: 'ended and renamed' });
    await all.until('the name of an ended job', () => names(all).includes(`job ${old.id}`));
    await command(server, id, 'cancel');
    await all.until('its end', () => all.events.some(({ event, data }) => event === 'job' && JSON.parse(data).state === 'cancelled'));
    await server.request('DELETE', `/v1/jobs/${id}`);
    await all.until('that it is gone', () => names(all).includes(`deleted ${id}`));
    for (const { event, data } of all.events) {
      if (event === 'job') server.contract.validate({ $ref: '#/components/schemas/Job' }, JSON.parse(data), 'a job of the stream');
    }
    const revisions = all.events.filter(({ event, data }) => event === 'job' && JSON.parse(data).id === id).map(({ data }) => JSON.parse(data).revision);
    assert.deepEqual(revisions, [...new Set(revisions)].sort((a, b) => a - b), 'no revision twice, none backwards');
    all.close();
  });

  await t.test('a reconnect gets the whole state again; a job that went meanwhile is told', async () => {
    // One after the other: a small machine grows one colony at a time.
    const gone = await finishedJob(server, small(54, 4));
    const { id } = await submit(server, endless(53));
    const path = `/v1/stream?jobs=${id},${gone.id}`;
    const first = await openStream(t, server, path);
    await first.until('the state', () => first.find('ready'));
    first.close();
    await server.request('DELETE', `/v1/jobs/${gone.id}`);
    const second = await openStream(t, server, path);
    await second.until('the state', () => second.find('ready'));
    assert.ok(names(second).includes(`job ${id}`));
    assert.ok(names(second).includes(`deleted ${gone.id}`));
    await command(server, id, 'cancel');
    second.close();
  });

  await t.test('says bye when the server drains', async () => {
    const draining = await startServer(t);
    const stream = await openStream(t, draining, '/v1/stream');
    await stream.until('the state', () => stream.find('ready'));
    await draining.stop();
    await stream.untilClosed();
    assert.equal(stream.events.at(-1).event, 'bye');
  });
});

test('behind a base path', async (t) => {
  const server = await startServer(t, { args: ['--server.base-path', '/colony/lab'] });
  const base = '/colony/lab';
  const answer = await send(server.port, 'POST', `${base}/v1/jobs`, { json: small(61, 8) });
  assert.equal(answer.status, 201);
  assert.equal(answer.headers.location, `${base}/v1/jobs/${answer.json.id}`);
  for (const [name, link] of Object.entries(answer.json.links)) assert.ok(link.startsWith(`${base}/v1/jobs/${answer.json.id}`), name);
  const followed = await send(server.port, 'GET', answer.json.links.self);
  assert.equal(followed.status, 200);
  await send(server.port, 'POST', `${base}/v1/jobs`, { json: small(62, 8) });
  const page = await send(server.port, 'GET', `${base}/v1/jobs?limit=1`);
  const next = nextOf(page);
  assert.ok(next.startsWith(`${base}/v1/jobs?limit=1&cursor=`));
  assert.equal((await send(server.port, 'GET', next)).json.items.length, 1);
  const openapi = (await send(server.port, 'GET', `${base}/openapi.json`)).json;
  assert.equal(openapi.servers[0].url, base);
  const docs = await send(server.port, 'GET', `${base}/docs`);
  for (const [, href] of docs.text.matchAll(/(?:href|src)="([^"#][^"]*)"/g)) {
    assert.equal((await send(server.port, 'GET', href)).status, 200, href);
  }
  assert.equal((await send(server.port, 'GET', '/v1/jobs')).status, 404);
});

test('the page to read', async (t) => {
  const server = await startServer(t);
  const docs = await server.get('/docs');
  assert.equal(docs.headers['content-type'], 'text/html; charset=utf-8');
  assert.match(docs.headers['content-security-policy'], /default-src 'none'.*style-src 'self'/);
  for (const danger of ['<script', 'style=', 'http-equiv', '<img']) assert.ok(!docs.text.includes(danger), danger);
  assert.doesNotMatch(docs.text, /<[^>]*\son\w+=/);
  const openapi = (await server.get('/openapi.json')).json;
  for (const item of Object.values(openapi.paths)) {
    for (const operation of Object.values(item)) assert.ok(docs.text.includes(`id="${operation.operationId}"`), operation.operationId);
  }
  assert.equal((await server.get('/docs.css')).headers['content-type'], 'text/css; charset=utf-8');
});
