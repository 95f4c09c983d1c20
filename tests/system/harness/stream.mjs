// stream: a reader of server-sent events that keeps what it saw and can be told to stop reading.
import assert from 'node:assert/strict';
import http from 'node:http';
import { cleanup } from './cleanup.mjs';
import { within } from './wait.mjs';

export class Stream {
  /** `paused`: accept the response and read nothing of its body. */
  constructor(port, path, { headers = {}, paused = false } = {}) {
    this.events = [];      // {event, id, data}
    this.comments = 0;
    this.lastEventId = '';  // what a browser would send when it reconnects
    this.retry_ms = undefined;
    this.closed = false;
    this.pending = { event: 'message', data: [] };
    this.tail = '';
    this.watchers = new Set();
    this.contract = undefined;  // set: the first events of each kind are held against their schema (all of them would make a slow reader)
    this.checked = {};
    this.fault = undefined;
    this.opened = new Promise((done, fail) => {
      this.request = http.request({ port, host: '127.0.0.1', path, agent: false, headers: { Accept: 'text/event-stream', ...headers } }, (response) => {
        this.response = response;
        this.status = response.statusCode;
        response.setEncoding('utf8');
        const end = () => {
          this.closed = true;
          this.tell();
        };
        response.on('close', end);
        response.on('error', end);
        if (!paused) this.read();
        done(this);
      });
      this.request.on('error', (error) => {
        this.closed = true;
        this.tell();
        fail(error);
      });
      this.request.end();
    });
    this.opened.catch(() => {});
  }

  read() {
    this.response.on('data', (text) => {
      const lines = (this.tail + text).split('\n');
      this.tail = lines.pop();
      for (const line of lines) this.take(line.replace(/\r$/, ''));
      this.tell();
    });
  }

  take(line) {
    if (line === '') {
      // As in the standard: a message without data is not shown, but its id counts.
      if (this.pending.id !== undefined) this.lastEventId = this.pending.id;
      if (this.pending.data.length > 0) this.keep({ ...this.pending, data: this.pending.data.join('\n') });
      this.pending = { event: 'message', data: [] };
      return;
    }
    if (line.startsWith(':')) {
      ++this.comments;
      return;
    }
    const colon = line.indexOf(':');
    const name = colon < 0 ? line : line.slice(0, colon);
    const value = colon < 0 ? '' : line.slice(colon + 1).replace(/^ /, '');
    if (name === 'event') this.pending.event = value;
    else if (name === 'data') this.pending.data.push(value);
    else if (name === 'id') this.pending.id = value;
    else if (name === 'retry') this.retry_ms = Number(value);
    else throw new Error(`not a line of an event stream: ${line}`);
  }

  keep(message) {
    this.events.push(message);
    if (!this.contract || message.id === undefined || this.checked[message.event] >= 20) return;
    this.checked[message.event] = (this.checked[message.event] ?? 0) + 1;
    try {
      const event = JSON.parse(message.data);
      this.contract.validate({ $ref: '#/components/schemas/Event' }, event, `the message ${message.id}`);
      assert.deepEqual([String(event.seq), event.kind], [message.id, message.event], 'a message and its event');
    } catch (error) {
      this.fault ??= error;
      this.close();
    }
  }

  tell() { for (const watcher of [...this.watchers]) watcher(); }

  /** Waits until `probe(this)` is true; fails if the stream closes first (unless that is what makes it true). */
  until(what, probe, limit_ms = 120_000) {
    let watcher;
    const reached = new Promise((done, fail) => {
      watcher = () => {
        if (this.fault) fail(this.fault);
        else if (probe(this)) done(this);
        else if (this.closed) fail(new Error(`the stream closed before ${what}; last: ${JSON.stringify(this.events.slice(-2))}`));
      };
      this.watchers.add(watcher);
      watcher();
    });
    return within(limit_ms, reached, what).finally(() => this.watchers.delete(watcher));
  }

  untilClosed() { return this.until('the stream to close', (stream) => stream.closed); }

  /** The events of the history: those with an id. */
  history() { return this.events.filter(({ id }) => id !== undefined); }
  lastId() { return Number(this.history().at(-1)?.id ?? 0); }
  find(name) { return this.events.find(({ event }) => event === name); }
  close() { this.request.destroy(); }
}

/** Opens a stream for a test; it is closed at the test's end. */
export async function openStream(t, server, path, options) {
  const stream = new Stream(server.port, path, options);
  if (/\/events(\?|$)/.test(path)) stream.contract = server.contract;
  cleanup(t, () => {
    stream.close();
    if (stream.fault) throw stream.fault;
  });
  return within(60_000, stream.opened, `the stream ${path} to open`);
}
