// rules: each rule names itself, says which files it reads, and finds violations in one file. `bad` are snippets it must
// catch and `good` ones it must let pass: the self-test feeds both, so a rule that has gone blind is a failure.
import { includes, codeOnly, findAll, awaitStatements, lineOf } from './text.mjs';
import * as table from './table.mjs';

const cpp = (path) => /\.(hpp|cpp)$/.test(path);
const engine = (path) => cpp(path) && path.startsWith('engine/');
const cmake = (path) => /(^|\/)CMakeLists\.txt$|\.cmake$|CMakePresets\.json$/.test(path);
const text = (path) => !/\.(png|tif|tiff|jpg|ico|bin|npz)$/.test(path);

const libm = 'sin|cos|tan|asin|acos|atan|atan2|sinh|cosh|tanh|asinh|acosh|atanh|exp|exp2|expm1|log|log2|log10|log1p|pow|cbrt|'
  + 'hypot|erf|erfc|tgamma|lgamma|fma|sincos';

/** Calls that change bits between CPUs, runs or library versions, or that read the world. */
const banned = [
  [new RegExp(`(?<![\\w:.>])(?:std\\s*::\\s*|::\\s*)(?:${libm})[fl]?\\s*\\(`, 'g'),
    'changes bits between CPUs: use the deterministic functions of engine/base/maths'],
  [/(?<![\w:.>])(?:std\s*::\s*|::\s*)?s?rand\s*\(|\brandom_device\b|\bmt19937|\bdefault_random_engine\b|\b\w+_distribution\b|\brandom_shuffle\b|\bstd\s*::\s*shuffle\b/g,
    'randomness comes from engine/random only, addressed by purpose'],
  [/#\s*include\s*<(random|chrono|ctime|time\.h|execution|filesystem|fstream|iostream)>/g, 'this header has no use in the engine'],
  [/\bstd\s*::\s*chrono\b|(?<![\w:.>])(?:std\s*::\s*|::\s*)?(time|clock|clock_gettime|gettimeofday)\s*\(/g, 'the engine has no clock'],
  [/\b(secure_)?getenv\s*\(|\bsetlocale\s*\(/g, 'the engine has no environment'],
  [/\bthis_thread\b|\bpthread_self\b|\bgettid\b|\bthread\s*::\s*id\b/g, 'nothing may depend on which thread it is'],
  [/\bstd\s*::\s*(reduce|transform_reduce|execution)\b|\bparallel_reduce\b/g, 'sums run in index order'],
  [/\bAngleAxis|\.\s*array\s*\(\s*\)\s*\.\s*(sin|cos|tan|exp|log|pow)\b/g, "Eigen's transcendental functions change bits between CPUs"],
  [/#\s*pragma\s+GCC\s+(optimize|target)|__attribute__\s*\(\(\s*(target|optimize)|\b_mm\w*_f(n?m(add|sub))/g, 'no target or contraction tricks here'],
];

/** Ours are colony::maths::sin and the like; a bare name would be the C library's, except where ours are defined. */
const bareLibm = new RegExp(`(?<![\\w:.>])(?:${libm})[fl]?\\s*\\(`, 'g');

const unordered = /\b(?:std\s*::\s*)?unordered_(?:multi)?(?:map|set)\s*</g;
const temporaryLambda = /(?:^|[^\w)\]\[])\[(?!\[)[^\][]*\]\s*(?:[({]|mutable\b|->|noexcept\b|<)/;
const temporaryAggregate = /(?<![\w.])(?:[a-z]\w*\s*::\s*)*[A-Z]\w*\s*\{\s*[^\s}]/;

export const rules = [
  {
    name: 'include-order', text: 'an include goes only where the table allows it', files: cpp,
    check(path, source) {
      const place = table.placeOf(path);
      if (!place) return [{ line: 1, message: 'this folder has no row in the include table (tests/support/tidy/table.mjs)' }];
      const allowed = [...table.mayInclude[place], place];
      return includes(source).filter((include) => include.quoted).flatMap((include) => {
        if (!/^(engine|server|client|tests)\//.test(include.path)) {
          return [{ line: include.line, message: `"${include.path}": quoted includes are paths from the project's top` }];
        }
        if (allowed.some((entry) => table.matches(entry, include.path))) return [];
        return [{ line: include.line, message: `${place} may not include ${include.path}` }];
      });
    },
    bad: [['engine/shape/a.cpp', '#include "engine/model/colony.hpp"\n'], ['engine/base/a.hpp', '#include "engine/random/stream.hpp"\n'],
      ['server/http/a.cpp', '#include "server/api/codec.hpp"\n'], ['client/cli/a.cpp', '#include "engine/model/params.hpp"\n'],
      ['server/api/a.cpp', '#include "server/http/session.hpp"\n'], ['engine/model/a.cpp', '#include "cell.hpp"\n'],
      ['server/store/a.cpp', '#include "engine/sim/simulator.hpp"\n'], ['engine/new/a.cpp', '\n']],
    good: [['engine/shape/a.cpp', '#include "engine/model/params.hpp"\n#include <vector>\n'],
      ['server/api/a.cpp', '#include "server/http/router.hpp"\n'], ['server/main.cpp', '#include "server/http/server.hpp"\n'],
      ['engine/base/a.cpp', '// #include "engine/sim/simulator.hpp"\n#include "engine/base/a.hpp"\n']],
  },
  {
    name: 'third-party', text: 'each third-party library is visible in one place', files: cpp,
    check(path, source) {
      return includes(source).filter((include) => !include.quoted).flatMap((include) => {
        if (/^[a-z_0-9]+$/.test(include.path)) return [];     // the standard library
        if (table.systemHeader.test(include.path)) {
          return path.startsWith('engine/') ? [{ line: include.line, message: `<${include.path}> has no place in the engine` }] : [];
        }
        if (path.startsWith('tests/')) return [];
        const library = table.thirdParty.find(({ prefix }) => include.path.startsWith(prefix));
        if (!library) return [{ line: include.line, message: `<${include.path}> is of no library in the table` }];
        if (library.places.some((place) => table.matches(place, path))) return [];
        return [{ line: include.line, message: `<${include.path}> is visible in ${library.places.join(', ') || 'tests/'} only` }];
      });
    },
    bad: [['server/jobs/a.cpp', '#include <nlohmann/json.hpp>\n'], ['server/api/a.hpp', '#include <sqlite3.h>\n'],
      ['server/api/a.hpp', '#include <boost/asio.hpp>\n'], ['engine/model/a.cpp', '#include <unistd.h>\n'],
      ['engine/space/a.cpp', '#include <xxhash.h>\n'], ['client/cli/a.cpp', '#include <zmq.hpp>\n']],
    good: [['server/http/a.cpp', '#include <boost/beast.hpp>\n#include <cstdint>\n#include <sys/socket.h>\n'],
      ['tests/unit/a.cpp', '#include <gtest/gtest.h>\n']],
  },
  {
    name: 'file-length', text: `a source file has at most ${table.linesMax} lines`,
    files: (path) => /\.(hpp|cpp|mjs|js|ts|sh)$/.test(path) || ['tests/run', 'tests/tidy', 'deploy/demo'].includes(path),
    check(path, source) {
      const lines = source.split('\n').length - 1;
      return lines > table.linesMax ? [{ line: lines, message: `${lines} lines: split it by idea` }] : [];
    },
    bad: [['engine/model/a.cpp', '\n'.repeat(table.linesMax + 1)]],
    good: [['engine/model/a.cpp', '\n'.repeat(table.linesMax)]],
  },
  {
    name: 'banned-calls', text: 'the engine calls nothing that changes between CPUs, runs or threads', files: engine,
    check(path, source) {
      const code = codeOnly(source);
      const all = /^engine\/base\/maths\.(hpp|cpp)$/.test(path) ? banned : [...banned, [bareLibm, 'would be the C library: say maths::']];
      return all.flatMap(([regex, message]) => findAll(code, regex, (match) => `${match[0].trim()} ${message}`));
    },
    bad: [...['x = std::sin(y);', 'x = sin(y);', 'x = std::pow(y, 2);', 'x = ::exp(y);', 'x = atan2(a, b);', 'x = std::hypot(a, b);',
      'x = cosf(y);', 'x = std::log ( y );', 'x = std::fma(a, b, c);', 'int i = std::rand();', 'std::random_device d;',
      'std::normal_distribution<double> n;', 'std::shuffle(a, b, g);', '#include <random>', 'auto t = std::chrono::seconds(1);',
      'getenv("X");', 'std::this_thread::get_id();', 'std::reduce(a, b);', 'Eigen::AngleAxisd r;', 'x = v.array().exp();',
      '#pragma GCC optimize("fast-math")', 'y = _mm256_fmadd_ps(a, b, c);', 'const long now = time(nullptr);',
    ].map((line) => ['engine/model/a.cpp', `${line}\n`]), ['engine/base/maths.cpp', 'double exp(double x) { return std::exp(x); }\n']],
    good: [['engine/base/maths.cpp', 'double exp(double x) { return x; }\n'], ['engine/model/a.cpp', '// std::sin(x) is banned\nx = std::sqrt(y) + std::abs(z) + std::floor(w) + maths::sin(x) + table.log(2) + time_h();\n'
      + 'FailureContext context{"std::rand()"};\nconst int n = 1\'000; double distance_exp(int); using std::max;\n']],
  },
  {
    name: 'unordered', text: 'an unordered container in the engine says why its order cannot matter', files: engine,
    check(path, source) {
      const lines = source.split('\n');
      return findAll(codeOnly(source), unordered, 'say "looked up, never iterated" beside it (and mean it), or use an ordered one')
        .filter(({ line }) => !`${lines[line - 2] ?? ''}${lines[line - 1]}`.includes('looked up, never iterated'));
    },
    bad: [['engine/space/a.hpp', 'std::unordered_map<int, int> m_;\n'], ['engine/space/a.hpp', 'std::unordered_set<int> m_;  // fast\n']],
    good: [['engine/space/a.hpp', '#include <unordered_map>\nstd::unordered_map<int, int> m_;  // looked up, never iterated: order cannot matter\n']],
  },
  {
    name: 'build-flags', text: 'no flag that lets the compiler change floating point results or the target CPU', files: cmake,
    check: (path, source) => findAll(source.replace(/^\s*#.*$/gm, ''), /-ffast-math|-Ofast|-funsafe-math\S*|-march=\S*|-mfma\b|-mavx\S*|-mtune=\S*|-ffp-contract=(?!off)\S*|-ffinite-math\S*|-fassociative-math/g,
      (match) => `${match[0]} changes results between machines`),
    bad: [['CMakeLists.txt', 'add_compile_options(-ffast-math)\n'], ['engine/CMakeLists.txt', 'target_compile_options(a PRIVATE -march=native)\n'],
      ['CMakePresets.json', '{"CMAKE_CXX_FLAGS": "-O3 -ffp-contract=fast"}\n']],
    good: [['CMakeLists.txt', '# no -ffast-math here\ntarget_compile_options(a INTERFACE -ffp-contract=off)\n']],
  },
  {
    name: 'build-lists', text: 'CMake lists files by hand, and every target of ours links colony_flags and colony_warnings', files: cmake,
    check(path, source) {
      const code = source.replace(/#.*$/gm, '');
      const globs = findAll(code, /\bfile\s*\(\s*GLOB\w*/g, 'files are listed by hand');
      const targets = findAll(code, /\badd_(?:library|executable)\s*\(\s*([\w${}]+)(?![\w${}])(?!\s+(?:INTERFACE|IMPORTED|ALIAS)\b)/g,
        (match) => match[1]);
      const bare = targets.flatMap(({ line, message: target }) => {
        const links = [...code.matchAll(/\btarget_link_libraries\s*\(\s*([\w${}]+)([^)]*)\)/g)].filter((link) => link[1] === target)
          .map((link) => link[2]).join(' ');
        // The flags are public in every library of ours, so one of those brings them.
        return [['colony_flags', /\bcolony_(?!warnings\b)\w+/], ['colony_warnings', /\bcolony_warnings\b/]]
          .filter(([, regex]) => !regex.test(links)).map(([name]) => ({ line, message: `${target} does not link ${name}` }));
      });
      return [...globs, ...bare];
    },
    bad: [['engine/CMakeLists.txt', 'add_library(a STATIC a.cpp)\ntarget_link_libraries(a PUBLIC colony_flags)\n'],
      ['engine/CMakeLists.txt', 'add_library(a STATIC a.cpp)\ntarget_link_libraries(a PRIVATE colony_warnings)\n'],
      ['engine/CMakeLists.txt', 'file(GLOB_RECURSE all *.cpp)\n'], ['client/cli/CMakeLists.txt', 'add_executable(b main.cpp)\n']],
    good: [['engine/CMakeLists.txt', 'add_library(f INTERFACE)\nadd_library(a STATIC a.cpp)\ntarget_link_libraries(a PUBLIC colony_flags\n  PRIVATE colony_warnings)\n']],
  },
  {
    name: 'header-form', text: 'a header opens with what the module promises, then #pragma once', files: (path) => path.endsWith('.hpp'),
    check(path, source) {
      const lines = source.split('\n');
      const stem = path.split('/').pop().replace(/\.hpp$/, '');
      const found = [];
      if (!new RegExp(`^// ${stem}: \\S`).test(lines[0])) found.push({ line: 1, message: `the first line is not "// ${stem}: what it promises"` });
      const first = lines.findIndex((line) => line.trim() !== '' && !line.startsWith('//'));
      // A header that is read once for each vector target has that guard instead.
      const perTarget = /^#if defined\(\w+\) == defined\(HWY_TARGET_TOGGLE\)$/.test(lines[first] ?? '');
      if (!perTarget && lines[first] !== '#pragma once') found.push({ line: first + 1, message: '#pragma once comes first after the opening comment' });
      return found;
    },
    bad: [['engine/base/a.hpp', '#pragma once\n'], ['engine/base/a.hpp', '// a: text\n#include <vector>\n#pragma once\n'],
      ['engine/base/a.hpp', '// some text\n#pragma once\n'], ['engine/base/a.hpp', '// a: text.\n#if defined(A) == defined(B)\n']],
    good: [['engine/base/a.hpp', '// a: text.\n// More.\n\n#pragma once\n'], ['engine/space/a.hpp', '// a: text.\n#if defined(A_HPP) == defined(HWY_TARGET_TOGGLE)\n']],
  },
  {
    name: 'white-space', text: 'no tabs, trailing blanks or carriage returns; the last line ends', files: (path) => text(path) && !/\.csv$|^tests\/bench\/results\//.test(path),
    check: (path, source) => [
      ...findAll(source, /\t/g, 'a tab'), ...findAll(source, /[ \r]+$/gm, 'blanks at the end of the line'),
      ...(source !== '' && !source.endsWith('\n') ? [{ line: lineOf(source, source.length), message: 'the last line does not end' }] : [])],
    bad: [['a.cpp', 'int\ta;\n'], ['a.cpp', 'int a; \n'], ['a.cpp', 'int a;\r\n'], ['a.cpp', 'int a;']],
    good: [['a.cpp', 'int a;\n\n'], ['tests/bench/results/full.txt', 'what a program printed \t\n']],
  },
  {
    name: 'machine-paths', text: 'no path of one machine', files: text,
    // Written in pieces, so that this file does not name them.
    check: (path, source) => findAll(source, new RegExp(`(?<![\\w.$}])/(?:${['wo' + 'rk', 'ro' + 'ot', 'tmp/' + 'wt', 'tmp/' + 'notes', 'ho' + 'me/(?!someone\\b)\\w+']
      .join('|')})(?:/|\\b)(?!\\w)`, 'g'), (match) => `${match[0]} is a path of one machine`),
    bad: [['README.md', `see /wo${'rk'}/shared/data\n`], ['tests/run', `cp /ho${'me'}/anna/a .\n`], ['a.cpp', `"/tm${'p/wt'}/a"\n`]],
    good: [['README.md', 'see ../shared/data, ./work/x, https://example.org/a/root.html, /home/someone/x and ~/.config/colony\n']],
  },
  {
    name: 'co-await-temporaries', text: 'a lambda or aggregate in a statement with co_await has a name (GCC 12.2 frees it twice)', files: cpp,
    check(path, source) {
      const code = codeOnly(source);
      return awaitStatements(code).flatMap(({ offset, text: statement }) => {
        const at = lineOf(code, offset + statement.length - statement.trimStart().length);
        if (temporaryLambda.test(statement)) return [{ line: at, message: 'name the lambda on the line before and move it in' }];
        if (temporaryAggregate.test(statement)) return [{ line: at, message: 'name the aggregate on the line before and move it in' }];
        return [];
      });
    },
    bad: [['server/http/a.cpp', 'void f() { co_await run([x] { return x; }); }\n'], ['server/http/a.cpp', 'const auto y = co_await run(a, [&](int i) { g(i); }, b);\n'],
      ['server/http/a.cpp', 'foo([&] { bar(); }, co_await baz());\n'], ['server/http/a.cpp', 'co_await send(Message{a, b});\n'],
      ['server/http/a.cpp', 'if (co_await run([x] { return x; })) {\n}\n']],
    good: [['server/http/a.cpp', 'auto f = [x] { return x; };\nco_await run(std::move(f), items[0], use_awaitable);\n'],
      ['server/http/a.cpp', 'asio::co_spawn(io, [self]() -> awaitable<void> { co_await self->loop(); }, detached);\n']],
  },
];

/** Rules about the set of files, not about one. */
export const treeRules = [
  {
    name: 'top-level', text: 'nothing else at the top',
    check: (paths) => [...new Set(paths.map((path) => path.split('/')[0]))]
      .filter((name) => !name.startsWith('.') && !table.topLevel.includes(name)).map((name) => ({ path: name, line: 0, message: 'a stray file or folder' })),
    bad: [['main.cpp'], ['notes/a.md', 'README.md']], good: [['README.md', '.ci/run', 'engine/base/check.cpp']],
  },
  {
    name: 'design-texts', text: 'engine, server and client each have a DESIGN.md',
    check: (paths) => ['engine', 'server', 'client'].filter((folder) => !paths.includes(`${folder}/DESIGN.md`))
      .map((folder) => ({ path: folder, line: 0, message: 'has no DESIGN.md' })),
    bad: [['engine/DESIGN.md', 'server/DESIGN.md']], good: [['engine/DESIGN.md', 'server/DESIGN.md', 'client/DESIGN.md']],
  },
];
