// table: who may include whom, where each third-party library is visible, and the other facts the tidy rules keep.
// Paths are from the project's top. An entry ending in '/' is a folder with all below it, else a file (or its stem, '.*').

/** Plain data that every engine folder may include, wherever the folder stands in the order. */
const plainData = ['engine/model/params.hpp', 'engine/model/cell.hpp'];

const engineOrder = ['base', 'random', 'shape', 'space', 'model', 'growth', 'sim'].map((name) => `engine/${name}/`);
const upTo = (name) => engineOrder.slice(0, engineOrder.indexOf(`engine/${name}/`) + 1);

/** Longest matching key wins. A folder may always include itself. */
export const mayInclude = {
  ...Object.fromEntries(engineOrder.map((folder, index) => [folder, [...engineOrder.slice(0, index), ...plainData]])),
  'engine/picture/': upTo('model'),
  'engine/analysis/': upTo('model'),
  'server/store/': ['engine/base/', 'engine/model/', 'engine/analysis/series.hpp'],
  'server/jobs/': ['engine/base/', 'engine/model/', 'engine/sim/', 'engine/analysis/', 'server/store/'],
  'server/http/': ['engine/base/'],
  'server/api/': ['engine/base/', 'engine/model/', 'engine/sim/', 'engine/picture/', 'engine/analysis/', 'server/jobs/',
    'server/store/', 'server/http/admission.hpp', 'server/http/message.hpp', 'server/http/router.hpp', 'server/http/tokens.hpp'],
  'server/main.cpp': ['engine/', 'server/'],
  'server/config.*': ['engine/', 'server/'],
  'server/config_keys.*': ['engine/', 'server/'],
  'server/log.*': ['server/http/'],
  'server/log_sink.*': [],
  'server/token_command.*': ['server/'],
  'client/': [],
  'tests/': ['engine/', 'server/', 'client/'],
};

/** Prefix of an angle include -> the places that may see it. tests/ may see all. */
export const thirdParty = [
  { prefix: 'boost/', places: ['server/http/', 'server/main.cpp'] },
  { prefix: 'nlohmann/', places: ['server/api/', 'server/log.*', 'client/'] },
  { prefix: 'sqlite3.h', places: ['server/store/'] },
  { prefix: 'SQLiteCpp/', places: ['server/store/'] },
  { prefix: 'spng.h', places: ['engine/picture/', 'engine/analysis/'] },
  { prefix: 'tiffio.h', places: ['engine/analysis/', 'engine/picture/'] },
  { prefix: 'expat.h', places: ['engine/analysis/'] },
  { prefix: 'turbojpeg.h', places: ['engine/analysis/'] },
  { prefix: 'opencv2/', places: ['engine/analysis/', 'engine/picture/'] },
  { prefix: 'tiny_gltf.h', places: ['server/api/glb.*'] },
  { prefix: 'zlib.h', places: ['engine/picture/'] },
  { prefix: 'xxhash.h', places: ['engine/base/'] },
  { prefix: 'Random123/', places: ['engine/random/'] },
  { prefix: 'xmmintrin.h', places: ['engine/base/'] },  // the floating-point mode
  { prefix: 'hwy/', places: ['engine/space/', 'engine/random/philox_simd.cpp', 'engine/random/sobol_simd.cpp', 'engine/picture/path_simd.cpp', 'engine/picture/top_simd.cpp'] },
  { prefix: 'tbb/', places: ['engine/sim/', 'engine/growth/scorer.*'] },
  { prefix: 'oneapi/', places: [] },  // the same library's other name: say tbb/
  { prefix: 'Eigen/', places: ['engine/'] },
  { prefix: 'curl/', places: ['client/'] },
  { prefix: 'CLI/', places: ['client/', 'server/config.*'] },
  { prefix: 'toml++/', places: ['client/', 'server/config.*'] },
  { prefix: 'openssl/', places: ['server/http/tokens.*', 'server/http/tls.*'] },
  { prefix: 'spdlog/', places: ['server/'] },
  { prefix: 'gtest/', places: [] },
  { prefix: 'gmock/', places: [] },
  { prefix: 'rapidcheck', places: [] },
];

/** Headers of the operating system: never in the engine, which has no sockets, files, clocks or environment. */
export const systemHeader = /^(sys|netinet|arpa|net|linux)\/|^(unistd|fcntl|signal|poll|termios|pthread|pwd|spawn|netdb|dirent|sched|errno|time)\.h$/;

export const topLevel = ['CMakeLists.txt', 'CMakePresets.json', 'README.md', 'CHANGELOG.md', 'engine', 'server', 'client',
  'tests', 'deploy'];

export const linesMax = 400;

export function matches(entry, path) {
  if (entry.endsWith('/')) return path.startsWith(entry);
  if (entry.endsWith('.*')) return path.startsWith(entry.slice(0, -1)) && !path.slice(entry.length).includes('/');
  return path === entry;
}

/** The key of `mayInclude` that decides for `path`, or undefined. */
export function placeOf(path) {
  return Object.keys(mayInclude).filter((key) => matches(key, path)).sort((a, b) => b.length - a.length)[0];
}
