// mutations: what a body, a query or a header becomes when somebody is careless or hostile.
import { Buffer } from 'node:buffer';

const junk = [
  null,
  true,
  false,
  -1,
  0,
  1.5,
  1e300,
  -1e300,
  2 ** 53,
  2 ** 64,
  '',
  'x',
  '12',
  'null',
  '\u{1F9EB}',
  'a'.repeat(5000),
  [],
  [[]],
  [null],
  {},
  { '': null },
  { a: { b: [1, 2] } },
];

/** Every place in a value: [path of names]. */
function places(value, path = []) {
  if (value === null || typeof value !== 'object') return [path];
  return [path, ...Object.entries(value).flatMap(([name, one]) => places(one, [...path, name]))];
}

function changed(value, path, change) {
  if (path.length === 0) return change(value);
  const copy = Array.isArray(value) ? [...value] : { ...value };
  const after = changed(copy[path[0]], path.slice(1), change);
  if (after === undefined) delete copy[path[0]];
  else copy[path[0]] = after;
  return copy;
}

const isObject = (value) => value !== null && typeof value === 'object' && !Array.isArray(value);
const pickFrom = (list, n) => list[n % list.length];
const objectsOf = (value) => places(value).filter((path) => isObject(path.reduce((at, name) => at[name], value)));

/** Changes of the value: (value, n, m) -> another value, wrong only if the schema says so. n and m choose. */
export const valueMutations = {
  'another type': (value, n, m) => changed(value, pickFrom(places(value), n), () => pickFrom(junk, m)),
  'a number out of range': (value, n, m) => {
    const numbers = places(value).filter((path) => typeof path.reduce((at, name) => at[name], value) === 'number');
    return numbers.length === 0
      ? pickFrom(junk, m)
      : changed(value, pickFrom(numbers, n), (old) =>
          pickFrom([-1, old + 0.5, -old - 1, 1e15, -1e15, 1e308, 5e-324, 2 ** 53], m),
        );
  },
  'an unknown member': (value, n, m) =>
    changed(value, pickFrom(objectsOf(value).concat([[]]), n), (old) =>
      isObject(old)
        ? {
            ...old,
            [pickFrom(['colour', '', '~', '/', 'Seed', 'seed ', '__proto__x', '\u{1F9EB}', 'constructor', 'toString'], m)]: 1,
          }
        : [old],
    ),
  'a missing member': (value, n) => {
    const inside = places(value).filter((path) => path.length > 0);
    return inside.length === 0 ? null : changed(value, pickFrom(inside, n), () => undefined);
  },
  'wrapped in an array': (value) => [value],
};

/** Changes of the text, wrong whatever the schema says. (text, n) -> bytes. */
const insideString = (text, insert) => {
  const at = text.indexOf('"') + 1;
  return at > 0
    ? Buffer.concat([Buffer.from(text.slice(0, at)), Buffer.from(insert), Buffer.from(text.slice(at))])
    : Buffer.concat([Buffer.from('"'), Buffer.from(insert), Buffer.from('"')]);
};
const member = (text, added) => (text.startsWith('{') ? `{${added}${text === '{}' ? '' : ','}${text.slice(1)}` : `{${added}}`);
export const textMutations = {
  'a duplicate key': (text) =>
    text === '{}' || !text.startsWith('{') ? '{"a":1,"a":2}' : `${text.slice(0, -1)},${text.slice(1)}`,
  'deep nesting': (text, n) => member(text, `"deep":${'['.repeat(33 + (n % 20_000))}`),
  'deep and closed': (text, n) => member(text, `"deep":${'{"a":'.repeat(33 + (n % 500))}1${'}'.repeat(33 + (n % 500))}`),
  NaN: (text, n) =>
    member(
      text,
      `"a":${pickFrom(['NaN', 'nan', 'Infinity', '-Infinity', 'undefined', '.5', '5.', '+1', '01', '0x10', '1e', '--1', 'tru', "'a'"], n)}`,
    ),
  'U+0000': (text) => member(text, '"a":"\\u0000"'),
  'a raw control character': (text, n) => insideString(text, Buffer.from([n % 32])),
  'a number beyond double': (text, n) => member(text, `"a":${pickFrom(['1e999', '-1e999', '1e400', `9${'0'.repeat(400)}`], n)}`),
  'a lone surrogate': (text) => member(text, '"a":"\\ud800"'),
  'bytes that are not UTF-8': (text, n) =>
    insideString(
      text,
      Buffer.from(pickFrom([[0xff], [0xc0, 0x80], [0xed, 0xa0, 0x80], [0xf5, 0x80, 0x80, 0x80], [0xe2, 0x82]], n)),
    ),
  'a byte order mark': (text) => Buffer.concat([Buffer.from([0xef, 0xbb, 0xbf]), Buffer.from(text)]),
  'cut short': (text, n) => text.slice(0, 1 + (n % Math.max(1, text.length - 1))),
  'something after it': (text, n) => `${text}${pickFrom([' x', '{}', ',', '\0', '//', ']'], n)}`,
  'a comment': (text) => `/* c */${text}`,
  'a trailing comma': (text) => (text === '{}' ? '{,}' : `${text.slice(0, -1)},${text.at(-1)}`),
  'UTF-16': (text) => Buffer.from(`\ufeff${text}`, 'utf16le'),
  'nothing but spaces': () => '   ',
};

export const wrongContentTypes = [
  undefined,
  'text/plain',
  'application/x-www-form-urlencoded',
  'multipart/form-data; boundary=x',
  'application/jsonp',
  'application/json; charset=utf-16',
  'application/json, text/plain',
  'application',
  '*/*',
  'text/json',
];

export const wrongAccepts = ['application/x-made-up', 'text/html;q=0', 'application/json;q=0', 'image/webp', '*/*;q=0'];

/** Texts that no parameter of this type takes. */
export const wrongTexts = {
  integer: ['', 'x', '1.5', '-1', '+1', '1e3', '0x10', ' 1', '1 ', 'NaN', '1,2', '99999999999999999999999', '１'],
  number: ['', 'x', 'NaN', 'inf', '-inf', '0x10', '1e999', '1,5', '1.5.5', ' 1', '--1'],
  boolean: ['', '1', '0', 'yes', 'TRUE', 'True', 'true,false', 'null'],
  enum: ['', 'made-up', 'QUEUED', 'queued ', '%', '../etc/passwd', "' or 1=1 --", 'a'.repeat(300)],
  // Any text is one, but not these bytes.
  string: ['%00', '%ff', '%c0%80', '%ed%a0%80'],
};

export const wrongIds = [
  '0',
  '-',
  'null',
  '01890000-0000-7000-8000-00000000000',
  '01890000-0000-7000-8000-000000000000',
  '01890000-0000-4000-8000-000000000000',
  'A'.repeat(200),
  '%27%20or%201%3D1',
  '%F0%9F%A7%AB',
  '..%5c..%5cetc',
  '~',
  '*',
  '01890000-0000-7000-8000-000000000000%20',
];
