// archive: what the compiled engine contains: no instruction that fuses or approximates, no libm function but sqrt.
// Why:     a source lint cannot see what the compiler makes of an expression, or what a template of a library calls.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const run = (program, args, input) => execFileSync(program, args, { encoding: 'utf8', input, maxBuffer: 1 << 30, stdio: ['pipe', 'pipe', 'pipe'] });

const instruction = /^\s*[0-9a-f]+:\s+(vf(?:n)?m(?:add|sub)\w*|v?rcp(?:ps|ss|14\w*|28\w*)|v?rsqrt(?:ps|ss|14\w*|28\w*))\b/;

// sqrt is correctly rounded by IEEE 754 and therefore the same everywhere.
const allowed = new Set(['sqrt', 'sqrtf']);

/** Names that libm defines; from the library itself, so that the list cannot be short. */
function libmNames() {
  const path = run(process.env.CXX ?? 'g++', ['-print-file-name=libm.so.6']).trim();
  return new Set(run('nm', ['-D', '--defined-only', path]).split('\n').map((line) => line.split(/\s+/).pop().replace(/@.*/, '')).filter(Boolean));
}

export function archiveFindings(archive) {
  const messages = [];
  const names = libmNames();
  if (names.size < 100) messages.push(`libm defines only ${names.size} names: the check is blind`);
  for (const line of run('nm', ['-u', '-A', archive]).split('\n')) {
    const match = /:([^:]+\.o):.*\bU\s+(\S+)/.exec(line);
    if (match && names.has(match[2]) && !allowed.has(match[2])) messages.push(`${match[1]}: calls ${match[2]} of libm`);
  }
  let symbol = '';
  let instructions = 0;
  const seen = new Set();
  for (const line of run('objdump', ['-d', '--no-show-raw-insn', '-C', archive]).split('\n')) {
    const label = /^[0-9a-f]+ <(.*)>:$/.exec(line);
    if (label) symbol = label[1];
    if (/^\s+[0-9a-f]+:\s/.test(line)) ++instructions;
    const match = instruction.exec(line);
    if (match && !seen.has(`${symbol} ${match[1]}`)) {
      seen.add(`${symbol} ${match[1]}`);
      messages.push(`${symbol}: ${match[1]}`);
    }
  }
  if (instructions === 0) messages.push(`${archive} holds no instructions: the check is blind`);
  return messages;
}

/** Compiles what must be found and says what was not. */
export function archiveSelfTest() {
  const folder = mkdtempSync(join(tmpdir(), 'colony-tidy-'));
  try {
    const object = join(folder, 'canary.o');
    const archive = join(folder, 'canary.a');
    run(process.env.CXX ?? 'g++', ['-O2', '-mfma', '-ffp-contract=fast', '-c', '-x', 'c++', '-o', object, '-'],
      '#include <cmath>\ndouble f(double a, double b, double c) { return a * b + c; }\ndouble g(double a) { return std::exp(a) + std::sqrt(a); }\n');
    run('ar', ['rcs', archive, object]);
    const found = archiveFindings(archive).join('\n');
    return [...(/vfmadd/.test(found) ? [] : ['a contracted multiply-add was not caught']),
      ...(/calls exp /.test(found) ? [] : ['a call of exp was not caught']),
      ...(/calls sqrt /.test(found) ? ['sqrt was caught without reason'] : [])];
  } finally {
    rmSync(folder, { recursive: true, force: true });
  }
}
