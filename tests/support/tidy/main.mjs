// main: runs the rules over the files of the project and says what each found.
import { execFileSync } from 'node:child_process';
import { readFileSync, readdirSync, writeFileSync, existsSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { rules, treeRules } from './rules.mjs';
import { headersCompileAlone } from './headers.mjs';
import { archiveFindings, archiveSelfTest } from './archive.mjs';

const help = `usage: tests/tidy [--self-test] [--headers] [--archive FILE.a] [--only REGEX] [--results FILE]
  --self-test     first feed every rule its bad snippets; one that is not caught is a failure
  --headers       also see that every header compiles alone; those that the build has not shown are compiled, with
                  --headers=all every one
  --archive FILE  also disassemble the engine's archive and look for instructions and symbols that change bits
  --only REGEX    only the rules whose names match
  --results FILE  write "PASSED FAILED" there
Exit: 0 clean, 1 a rule was broken, 2 usage.`;

const top = resolve(dirname(fileURLToPath(import.meta.url)), '../../..');

function projectFiles() {
  try {
    const listed = execFileSync('git', ['ls-files', '-z', '--cached', '--others', '--exclude-standard'],
      { cwd: top, encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] });
    return [...new Set(listed.split('\0'))].filter((path) => path && existsSync(join(top, path))).sort();
  } catch {
    // Not a git checkout: walk, passing over what the project ignores.
    const walk = (folder) => readdirSync(join(top, folder), { withFileTypes: true }).flatMap((entry) => {
      if (['.git', 'build', 'node_modules', 'demo-data'].includes(entry.name)) return [];
      const path = folder ? `${folder}/${entry.name}` : entry.name;
      return entry.isDirectory() ? walk(path) : [path];
    });
    return walk('').sort();
  }
}

/** Snippets that a rule lets through, and innocent ones it stops. */
export function selfTest(rule) {
  const tree = treeRules.includes(rule);
  const run = tree ? (paths) => rule.check(paths) : ([path, source]) => (rule.files(path) ? rule.check(path, source) : []);
  const missed = rule.bad.filter((snippet) => run(snippet).length === 0);
  const wronged = rule.good.filter((snippet) => run(snippet).length > 0);
  return [
    ...missed.map((snippet) => `not caught: ${JSON.stringify(snippet)}`),
    ...wronged.map((snippet) => `caught without reason: ${JSON.stringify(snippet)}: ${run(snippet)[0].message}`),
  ];
}

export async function main(args) {
  const options = { selfTest: false, headers: false };
  const valued = { '--archive': 'archive', '--only': 'only', '--results': 'results' };
  for (let i = 0; i < args.length; ++i) {
    if (args[i] === '--self-test') options.selfTest = true;
    else if (args[i] === '--headers') options.headers = true;
    else if (args[i] === '--headers=all') options.headers = options.allHeaders = true;
    else if (valued[args[i]] && args[i + 1]) options[valued[args[i]]] = args[++i];
    else {
      console.error(help);
      process.exitCode = 2;
      return;
    }
  }
  const only = options.only ? new RegExp(options.only) : /^/;
  let passed = 0;
  let failed = 0;
  const report = (name, messages, text) => {
    if (messages.length === 0) ++passed; else ++failed;
    console.log(`${messages.length === 0 ? 'ok    ' : 'FAILED'} ${name}: ${text}`);
    messages.slice(0, 50).forEach((message) => console.log(`         ${message}`));
    if (messages.length > 50) console.log(`         and ${messages.length - 50} more`);
  };

  if (options.selfTest) {
    for (const rule of [...rules, ...treeRules].filter(({ name }) => only.test(name))) {
      report(`canary ${rule.name}`, selfTest(rule), `${rule.bad.length} bad snippets are caught, ${rule.good.length} good ones pass`);
    }
    if (only.test('archive')) report('canary archive', archiveSelfTest(), 'a contracted multiply-add and a libm call are caught');
  }

  const paths = projectFiles();
  const show = ({ path, line, message }) => `${path}${line ? `:${line}` : ''}: ${message}`;
  for (const rule of rules.filter(({ name }) => only.test(name))) {
    const found = paths.filter(rule.files)
      .flatMap((path) => rule.check(path, readFileSync(join(top, path), 'utf8')).map((finding) => ({ path, ...finding })));
    report(rule.name, found.map(show), rule.text);
  }
  for (const rule of treeRules.filter(({ name }) => only.test(name))) report(rule.name, rule.check(paths).map(show), rule.text);

  if (options.headers && only.test('headers')) {
    const headers = paths.filter((path) => path.endsWith('.hpp'));
    report('headers', await headersCompileAlone(top, headers, { all: options.allHeaders }), `${headers.length} headers compile alone`);
  }
  if (options.archive && only.test('archive')) {
    report('archive', archiveFindings(resolve(options.archive)), 'no fused or approximate instruction and no libm symbol but sqrt in the engine');
  }
  console.log(`tidy: ${passed} passed, ${failed} failed`);
  if (options.results) writeFileSync(options.results, `${passed} ${failed}\n`);
  process.exitCode = failed === 0 ? 0 : 1;
}
