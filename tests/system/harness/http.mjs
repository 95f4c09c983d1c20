// http: requests as a client would send them, and as no client should.
import http from 'node:http';
import net from 'node:net';
import { within } from './wait.mjs';

const answerMax_ms = 60_000;

export const mediaType = (headers) => (headers['content-type'] ?? '').split(';')[0].trim().toLowerCase();

function complete(status, headers, body) {
  const text = body.toString('utf8');
  const json = /^application\/(\w+\+)?json$/.test(mediaType(headers)) && body.length > 0 ? JSON.parse(text) : undefined;
  return { status, headers, body, text, json };
}

/** One request on a connection of its own. `json` is sent as application/json; `body` as it is. */
export function send(port, method, path, { headers = {}, json, body } = {}) {
  const payload = json !== undefined ? JSON.stringify(json) : body;
  const answer = new Promise((done, fail) => {
    const request = http.request({
      port, host: '127.0.0.1', method, path, agent: false,
      headers: {
        ...(json !== undefined ? { 'Content-Type': 'application/json' } : {}),
        ...(payload !== undefined ? { 'Content-Length': Buffer.byteLength(payload) } : {}),
        ...headers,
      },
    }, (response) => {
      const pieces = [];
      response.on('data', (piece) => pieces.push(piece));
      response.on('error', fail);
      response.on('end', () => {
        try {
          done(complete(response.statusCode, response.headers, Buffer.concat(pieces)));
        } catch (error) {
          fail(error);
        }
      });
    });
    request.on('error', fail);
    request.end(payload);
  });
  return within(answerMax_ms, answer, `the answer to ${method} ${path}`);
}

/** The complete responses in `bytes`, in order (Content-Length, chunked, or to the end when closed). */
export function parseResponses(bytes, closed, { isHead = false, foreign = false } = {}) {
  const found = [];
  let at = 0;
  for (;;) {
    const headEnd = bytes.indexOf('\r\n\r\n', at);
    if (headEnd < 0) return found;
    const lines = bytes.subarray(at, headEnd).toString('latin1').split('\r\n');
    const status = Number(/^HTTP\/1\.1 (\d{3})/.exec(lines[0])?.[1]);
    if (!status && foreign) return found;  // another server may answer a line of nothing with a page of nothing (HTTP/0.9)
    if (!status) throw new Error(`not an HTTP response: ${lines[0]}`);
    const headers = {};
    for (const line of lines.slice(1)) headers[line.slice(0, line.indexOf(':')).toLowerCase()] = line.slice(line.indexOf(':') + 1).trim();
    let from = headEnd + 4;
    let body;
    if (isHead && found.length === 0) {
      body = Buffer.alloc(0);
    } else if (headers['content-length'] !== undefined) {
      const length = Number(headers['content-length']);
      if (bytes.length < from + length) return found;
      body = bytes.subarray(from, from + length);
      from += length;
    } else if ((headers['transfer-encoding'] ?? '').toLowerCase() === 'chunked') {
      const pieces = [];
      for (;;) {
        const sizeEnd = bytes.indexOf('\r\n', from);
        if (sizeEnd < 0) return found;
        const size = parseInt(bytes.subarray(from, sizeEnd).toString('latin1'), 16);
        if (bytes.length < sizeEnd + 2 + size + 2) return found;
        pieces.push(bytes.subarray(sizeEnd + 2, sizeEnd + 2 + size));
        from = sizeEnd + 2 + size + 2;
        if (size === 0) break;
      }
      body = Buffer.concat(pieces);
    } else {
      if (!closed && status !== 204 && status !== 304) return found;
      body = bytes.subarray(from);
      from = bytes.length;
    }
    found.push(complete(status, headers, body));
    at = from;
  }
}

/**
 * Sends exactly these bytes and collects what comes back until the server closes, or until `count` responses are there.
 * Gives {responses, closed, socket}; `closed` says that the server ended the connection. `isHead`: the first is a HEAD; `foreign`: another
 * server's; `keep`: the socket stays open, and is the caller's.
 */
export function sendRaw(port, bytes, { count = Infinity, limit_ms = answerMax_ms, isHead = false, foreign = false, keep = false } = {}) {
  let socket;
  const exchange = new Promise((done, fail) => {
    socket = net.connect(port, '127.0.0.1');
    let received = Buffer.alloc(0);
    const finish = (closed) => {
      try {
        const responses = parseResponses(received, closed, { isHead, foreign });
        if (closed || responses.length >= count) done({ responses, closed, socket });
      } catch (error) {
        fail(error);
      }
    };
    socket.on('connect', () => socket.write(bytes));
    socket.on('data', (piece) => {
      received = Buffer.concat([received, piece]);
      if (count !== Infinity) finish(false);
    });
    // A server that refuses without reading all may reset the connection; what arrived before counts.
    socket.on('error', (error) => (['ECONNRESET', 'EPIPE'].includes(error.code) ? undefined : fail(error)));
    socket.on('close', () => finish(true));
  });
  return within(limit_ms, exchange, 'a raw exchange to end').finally(() => keep || socket.destroy());
}
