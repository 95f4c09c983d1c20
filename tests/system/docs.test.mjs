// docs: what the page to read tells people to do works as it stands there, with tokens and without.
import assert from 'node:assert/strict';
import net from 'node:net';
import test from 'node:test';
import { cleanup } from './harness/cleanup.mjs';
import { allEvents, command, endless, finishedJob, small, submit } from './harness/jobs.mjs';
import { createToken, startServer, temporaryFolder } from './harness/server.mjs';

const plain = (html) => html.replaceAll('&lt;', '<').replaceAll('&gt;', '>').replaceAll('&quot;', '"').replaceAll('&#39;', "'").replaceAll('&amp;', '&');

/** The reader of streams as /docs prints it, but that it comes back at once: what is tried is that it does, not when. */
function readerOf(page) {
  const [, html] = /<pre><code id="read-stream">([^]*?)<\/code><\/pre>/.exec(page);
  return new Function('setTimeout', `${plain(html)}; return readStream;`)((run) => setImmediate(run));
}

/** A way to the server whose first connections break off after so many bytes of answer, in the middle of a message or of a character. */
async function breakingWay(t, server, cuts) {
  const sockets = new Set();
  const way = net.createServer((from) => {
    const to = net.connect(server.port, '127.0.0.1');
    let left = cuts.shift() ?? Infinity;
    for (const socket of [from, to]) {
      sockets.add(socket);
      socket.on('error', () => {});
      socket.on('close', () => { from.destroy(); to.destroy(); });
    }
    from.pipe(to);
    to.on('data', (bytes) => {
      if (left <= 0) return;
      from.write(bytes.subarray(0, left));
      left -= bytes.length;
      if (left <= 0) from.destroySoon();
    });
  });
  await new Promise((done) => way.listen(0, '127.0.0.1', done));
  cleanup(t, () => {
    for (const socket of sockets) socket.destroy();
    way.close();
  });
  return `http://127.0.0.1:${way.address().port}`;
}

test('with tokens', async (t) => {
  const data = temporaryFolder(t);
  const token = createToken(data, 'root', 'admin');
  const server = await startServer(t, { data, token, args: ['--auth.mode', 'required'] });
  const page = await server.get('/docs', { Authorization: null });
  assert.equal(page.status, 200);
  const readStream = readerOf(page.text);

  await t.test('the page shows its own address, and a token in each example that needs one', () => {
    assert.ok(page.text.includes(`BASE='${server.url}'`));
    const examples = [...page.text.matchAll(/<h4>Example<\/h4>\n<pre><code>([^]*?)<\/code><\/pre>/g)].map(([, html]) => plain(html));
    assert.ok(examples.length > 30);
    for (const example of examples) {
      const isOpen = /\$BASE\/(healthz|readyz|openapi\.json|docs|docs\.css)"$/.test(example);
      assert.equal(example.includes('-H "Authorization: Bearer $TOKEN"'), !isOpen, example);
    }
  });

  await t.test('its reader of streams gets every event once, through connections that break off', async () => {
    const job = await finishedJob(server, small(31, 40));
    const way = await breakingWay(t, server, [700, 2000, 5000, 12_345]);
    const events = [];
    await readStream(`${way}/v1/jobs/${job.id}/events`, token, (message) => events.push(message));
    const history = events.filter(({ event }) => event !== 'progress' && event !== 'end');
    assert.deepEqual(history.map(({ data: text }) => JSON.parse(text)), await allEvents(server, job.id));
    assert.deepEqual(history.map(({ id }) => Number(id)), history.map((_, index) => index + 1));
    assert.equal(JSON.parse(events.at(-1).data).last_seq, job.last_seq);
    assert.equal(events.at(-1).event, 'end');
  });

  await t.test('an error of who handles comes out, and what it was given is not lost', async () => {
    const job = await finishedJob(server, small(33, 8));
    const url = `${server.url}/v1/jobs/${job.id}/events`;
    for (const fails of [() => { throw new Error('of the page'); }, () => Promise.reject(new Error('of the page'))]) {
      const seen = [];
      let failed;
      const handle = (message) => {
        if (message.event === 'progress' || message.event === 'end') return undefined;
        if (seen.length === 2 && failed === undefined) {
          failed = message.id;
          return fails();
        }
        return seen.push(message);
      };
      await assert.rejects(readStream(url, token, handle), /^Error: of the page$/);
      assert.equal(failed, '3');
      await readStream(`${url}?after=${seen.at(-1).id}`, token, handle);
      assert.deepEqual(seen.map(({ data }) => JSON.parse(data)), await allEvents(server, job.id), 'each once');
    }
  });

  await t.test('it says what asking again cannot mend, and ends when it is told to', async () => {
    const { id } = await submit(server, endless(3));
    await assert.rejects(readStream(`${server.url}/v1/jobs/${id}/events`, 'colony_wrong', assert.fail), /^Error: 401: /);
    await assert.rejects(readStream(`${server.url}/v1/jobs/01890000-0000-7000-8000-000000000000/events`, token, assert.fail), /^Error: 404: /);
    const abort = new AbortController();
    await readStream(`${server.url}/v1/stream`, token, ({ event }) => { if (event === 'ready') abort.abort(); }, abort.signal);
    assert.equal((await command(server, id, 'cancel')).status, 202);
  });
});

test('without tokens the page asks for none, and its reader needs none', async (t) => {
  const server = await startServer(t);
  const page = await server.get('/docs');
  assert.ok(!page.text.includes('Bearer $TOKEN'));
  const job = await finishedJob(server, small(32, 4));
  const events = [];
  await readerOf(page.text)(`${server.url}/v1/jobs/${job.id}/events`, '', (message) => events.push(message));
  assert.equal(events.at(-1).event, 'end');
});
