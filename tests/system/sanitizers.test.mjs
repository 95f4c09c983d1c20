// sanitizers: a canary of the harness: a report on stderr fails the test that started the server, however the server ended.
// The program is a stand-in of a few lines, so that it can be made to say what a sound server never says.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import test from 'node:test';

const folder = mkdtempSync(join(tmpdir(), 'colony-system-'));
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
process.env.COLONYD = join(folder, 'stand-in');
const { Server, refusedStart } = await import('./harness/server.mjs');  // reads COLONYD once

// As the sanitizers of GCC word them.
const reports = {
  address: '==4711==ERROR: AddressSanitizer: heap-use-after-free on address 0x602000000010 at pc 0x55',
  leak: '==4711==ERROR: LeakSanitizer: detected memory leaks',
  thread: 'WARNING: ThreadSanitizer: data race (pid=4711)',
  'undefined behaviour': "engine/sim/sim.cpp:12:34: runtime error: signed integer overflow: 2147483647 + 1 cannot be represented in type 'int'",
};
const sound = '{"level":"warn","event":"request","status":422}';

/** A program that says `line` on stderr and then serves (or would) until SIGTERM, or gives up with status 1. */
function standIn(line, serves) {
  const rest = serves
    ? "process.on('SIGTERM', () => process.exit(0)); setInterval(() => {}, 1000); console.log('listening on http://127.0.0.1:9');"
    : 'process.exit(1);';
  writeFileSync(process.env.COLONYD, `#!${process.execPath}\nconsole.error(${JSON.stringify(line)}); ${rest}\n`, { mode: 0o755 });
}

const ends = {
  'SIGTERM': async () => (await new Server(folder, []).ready({})).stop(),
  'kill -9': async () => (await new Server(folder, []).ready({})).kill(),
  'an end that the test expects': async () => {
    const server = await new Server(folder, []).ready({});
    server.expectedToDie = true;
    await server.stop();
  },
  'a refused start': async () => assert.equal(refusedStart(folder, []).status, 1),
};

for (const [how, end] of Object.entries(ends)) {
  test(`a sanitizer's report is found after ${how}`, async () => {
    for (const [kind, report] of Object.entries(reports)) {
      standIn(report, how !== 'a refused start');
      await assert.rejects(end, /The input was expected to not match/, kind);
    }
    standIn(sound, how !== 'a refused start');
    await end();
  });
}
