// headers: every header compiles as the only include of a source file, with the project's language level and warnings.
import { spawn } from 'node:child_process';
import { availableParallelism, cpus } from 'node:os';

const flags = ['-std=c++20', '-fsyntax-only', '-Wall', '-Wextra', '-Werror', '-x', 'c++', '-I.', '-isystem', '/usr/include/eigen3', '-'];

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

/** One message per header that does not compile. */
export async function headersCompileAlone(top, headers) {
  const waiting = [...headers];
  const messages = [];
  const worker = async () => {
    for (let header = waiting.shift(); header; header = waiting.shift()) messages.push(...await compile(top, header));
  };
  const width = availableParallelism ? availableParallelism() : cpus().length;
  await Promise.all(Array.from({ length: width }, worker));
  return messages.sort();
}
