// server: a real colonyd on a free loopback port, in a data folder of its own, ended by its pid.
// Promise: a server that crashes, prints a sanitizer's report or does not end cleanly fails the test that started it.
import assert from 'node:assert/strict';
import { execFileSync, spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { cleanup } from './cleanup.mjs';
import { Contract } from './contract.mjs';
import { send } from './http.mjs';
import { within } from './wait.mjs';

export const top = resolve(dirname(fileURLToPath(import.meta.url)), '../../..');
export const full = process.env.COLONY_TEST_FULL === '1';
const serverBinary = process.env.COLONYD ?? join(top, 'build/release/bin/colonyd');
export const cliBinary = process.env.COLONY ?? join(top, 'build/release/bin/colony');

/** SIGTERM to the end of the process, as promised to operators. */
const drainMax_ms = 10_000;
const startMax_ms = 60_000;

// A test that dies must not leave servers behind.
const alive = new Set();
process.on('exit', () => { for (const child of alive) child.kill('SIGKILL'); });

export function temporaryFolder(t) {
  const folder = mkdtempSync(join(tmpdir(), 'colony-system-'));
  cleanup(t, () => rmSync(folder, { recursive: true, force: true }));
  return folder;
}

/** Nothing of the surroundings may configure the programs under test. */
export function cleanEnvironment() {
  return Object.fromEntries(Object.entries(process.env)
    .filter(([name]) => !name.startsWith('COLONY_') && !/proxy$/i.test(name) && !name.startsWith('NODE_')));
}

/** What no program of ours may say, however it ended: a kill or a refusal must not hide a sanitizer's report that came first. */
export function assertSane(stderr) {
  assert.doesNotMatch(stderr, /Sanitizer|runtime error:|terminate called|check failed/);
}

export class Server {
  constructor(data, args, token) {
    assert.ok(existsSync(serverBinary), `${serverBinary} is not built`);
    this.data = data;
    this.token = token;  // sent with every request of ours
    this.out = '';
    this.err = '';
    this.expectedToDie = false;
    const listen = args.includes('--listen') ? [] : ['--listen', '127.0.0.1:0'];
    this.child = spawn(serverBinary, [...listen, '--data', data, ...args],
      { stdio: ['ignore', 'pipe', 'pipe'], env: { ...cleanEnvironment(), HOME: data } });
    alive.add(this.child);
    this.child.stderr.on('data', (bytes) => { this.err += bytes; });
    this.exited = new Promise((done) => {
      this.child.on('close', (code, signal) => {
        alive.delete(this.child);
        done({ code, signal });
      });
    });
    this.listening = new Promise((done, fail) => {
      this.child.on('error', fail);
      this.child.stdout.on('data', (bytes) => {
        this.out += bytes;
        const match = /^listening on (https?):\/\/127\.0\.0\.1:(\d+)(\/\S*)?\n/m.exec(this.out);
        if (!match) return;
        this.isEncrypted = match[1] === 'https';
        this.base = match[3] ?? '';
        done(Number(match[2]));
      });
      this.exited.then(({ code, signal }) => fail(new Error(`colonyd ended (${code ?? signal}) before it listened:\n${this.err}`)));
    });
    this.listening.catch(() => {});
  }

  get pid() { return this.child.pid; }
  get url() { return `http://127.0.0.1:${this.port}`; }

  /** `contract`: of the same program, from before; the document is then not asked for again. */
  async ready(contract) {
    this.port = await within(startMax_ms, this.listening, 'colonyd to listen');
    if (contract) {
      this.contract = contract;
      return this;
    }
    if (this.isEncrypted) return this;  // the test asks for itself
    const openapi = await send(this.port, 'GET', `${this.base}/openapi.json`);
    assert.equal(openapi.status, 200);
    this.contract = new Contract(openapi.json);
    return this;
  }

  /** One request; the answer is held against the OpenAPI document the server itself gives. */
  async request(method, path, options = {}) {
    const wanted = { ...(this.token ? { Authorization: `Bearer ${this.token}` } : {}), ...options.headers };
    const headers = Object.fromEntries(Object.entries(wanted).filter(([, value]) => value !== null));  // null: not even the token
    const response = await send(this.port, method, this.base + path, { ...options, headers });
    this.contract.check(method, path, response, options);
    return response;
  }

  get(path, headers) { return this.request('GET', path, { headers }); }
  post(path, json, headers) { return this.request('POST', path, { json, headers }); }

  async counts() { return (await this.get('/v1/jobs/counts')).json; }

  /** Ends it as an operator would; it must go in time, with status 0 and nothing terrible on stderr. */
  async stop() {
    if (this.child.exitCode === null && this.child.signalCode === null) this.child.kill('SIGTERM');
    const end = await within(drainMax_ms, this.exited, 'colonyd to end after SIGTERM').catch((error) => {
      this.child.kill('SIGKILL');
      throw error;
    });
    assertSane(this.err);
    if (this.expectedToDie) return;
    assert.deepEqual(end, { code: 0, signal: null }, `colonyd did not end cleanly:\n${this.err.slice(-4000)}`);
  }

  /** As a power failure would. */
  async kill() {
    this.expectedToDie = true;
    this.child.kill('SIGKILL');
    const end = await within(drainMax_ms, this.exited, 'a killed process to end');
    assertSane(this.err);
    assert.deepEqual(end, { code: null, signal: 'SIGKILL' });
  }
}

/** A token made with the server stopped. */
export function createToken(data, name, scope, expires_h = 1) {
  return execFileSync(serverBinary, ['token', 'create', '--name', name, '--scope', scope, '--expires-h', String(expires_h), '--data', data],
    { env: { ...cleanEnvironment(), HOME: data }, encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] }).trim();
}

/** A server that is expected not to start: its exit code and what it said. */
export function refusedStart(data, args) {
  const { status, stderr } = spawnSync(serverBinary, ['--data', data, ...args],
    { env: { ...cleanEnvironment(), HOME: data }, encoding: 'utf8', timeout: startMax_ms });
  assertSane(stderr);
  return { status, stderr };
}

/** Starts a server for a test and stops it at the test's end. Without `data` it gets a folder that goes with it. */
export async function startServer(t, { data, args = [], token } = {}) {
  const server = new Server(data ?? temporaryFolder(t), args, token);
  cleanup(t, () => server.stop());
  return server.ready();
}
