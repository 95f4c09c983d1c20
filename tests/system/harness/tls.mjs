// tls: a certificate for a test, and requests over TLS that trust it alone.
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import https from 'node:https';
import { join } from 'node:path';
import { within } from './wait.mjs';

/** Made anew for each test, for localhost and 127.0.0.1: {certificate, key} are paths. */
export function makeCertificate(folder) {
  const certificate = join(folder, 'certificate.pem');
  const key = join(folder, 'key.pem');
  execFileSync('openssl', ['req', '-x509', '-newkey', 'ec', '-pkeyopt', 'ec_paramgen_curve:prime256v1', '-nodes', '-keyout', key,
    '-out', certificate, '-days', '2', '-subj', '/CN=localhost', '-addext', 'subjectAltName=DNS:localhost,IP:127.0.0.1'], { stdio: 'ignore' });
  return { certificate, key };
}

/** One request over TLS; gives {status, headers, text, json}. `onData` sees pieces as they come. */
export function sendTls(port, certificate, method, path, { headers = {}, json, onData } = {}) {
  const payload = json === undefined ? undefined : JSON.stringify(json);
  const answer = new Promise((done, fail) => {
    const request = https.request({
      port, host: '127.0.0.1', method, path, agent: false, ca: readFileSync(certificate),
      headers: { ...(payload === undefined ? {} : { 'Content-Type': 'application/json', 'Content-Length': Buffer.byteLength(payload) }), ...headers },
    }, (response) => {
      const pieces = [];
      response.on('data', (piece) => {
        pieces.push(piece);
        onData?.(piece.toString(), request);
      });
      response.on('error', fail);
      response.on('end', () => {
        const text = Buffer.concat(pieces).toString('utf8');
        const isJson = /json/.test(response.headers['content-type'] ?? '') && !/ndjson/.test(response.headers['content-type']);
        done({ status: response.statusCode, headers: response.headers, text, json: isJson && text ? JSON.parse(text) : undefined });
      });
    });
    request.on('error', fail);
    request.end(payload);
  });
  return within(60_000, answer, `the answer to ${method} ${path} over TLS`);
}
