// headers: every header compiles as the only include of a source file, with the project's language level and warnings.
// Method:  where X.cpp includes X.hpp before all else and is built, the build has shown it already; the rest is compiled here.
import { spawn } from 'node:child_process';
import { existsSync, readFileSync } from 'node:fs';
import { cpus } from 'node:os';
import { dirname, join } from 'node:path';
import { includes } from './text.mjs';

const flags = ['-std=c++20', '-fsyntax-only', '-Wall', '-Wextra', '-Werror', '-x', 'c++', '-I.', '-isystem', '/usr/include/eigen3', '-isystem', '/usr/include/opencv4', '-'];

function compile(top, header) {
  return new Promise((resolve, reject) => {
    const compiler = spawn(process.env.CXX ?? 'g++', flags, { cwd: top, stdio: ['pipe', 'ignore', 'pipe'] });
    let errors = '';
    compiler.stderr.on('data', (data) => { errors += data; });
    compiler.on('error', reject);
    compiler.on('close', (code) => resolve(code === 0 ? [] : [`${header}: ${errors.split('\n').find((line) => line.includes('error')) ?? `g++ ended with ${code}`}`]));
    compiler.stdin.end(`#include "${header}"\n`);
  });
}

/** True if the header is the first include of its own source, and a CMakeLists.txt on the way up lists that source. */
function shownByBuild(top, header) {
  const source = header.replace(/\.hpp$/, '.cpp');
  if (!existsSync(join(top, source)) || includes(readFileSync(join(top, source), 'utf8'))[0]?.path !== header) return false;
  for (let folder = dirname(source); folder !== '.'; folder = dirname(folder)) {
    const list = join(top, folder, 'CMakeLists.txt');
    const name = source.slice(folder.length + 1).replace(/[.+]/g, '\\$&');
    if (existsSync(list) && new RegExp(`^\\s*${name}\\s*$|[\\s(]${name}[\\s)]`, 'm').test(readFileSync(list, 'utf8'))) return true;
  }
  return false;
}

/** One message per header that does not compile. `all`: the compiler is asked about every one. */
export async function headersCompileAlone(top, headers, { all = false } = {}) {
  const waiting = all ? [...headers] : headers.filter((header) => !shownByBuild(top, header));
  const messages = [];
  const worker = async () => {
    for (let header = waiting.shift(); header; header = waiting.shift()) messages.push(...await compile(top, header));
  };
  await Promise.all(Array.from({ length: cpus().length }, worker));
  return messages.sort();
}
