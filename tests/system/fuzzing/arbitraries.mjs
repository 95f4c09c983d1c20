// arbitraries: values that fit a JSON Schema, for what our schemas use: type, enum, const, bounds, lengths, pattern, properties, required,
// additionalProperties, propertyNames, items, oneOf, anyOf, $ref. Rules that it does not follow (not, minProperties) are left to the caller's validator.
// Anything else in a schema is an error, so a keyword that comes later is not passed over in silence.
import fc from 'fast-check';

const understood = new Set([
  'type',
  'enum',
  'const',
  'minimum',
  'maximum',
  'exclusiveMinimum',
  'exclusiveMaximum',
  'minLength',
  'maxLength',
  'pattern',
  'properties',
  'required',
  'additionalProperties',
  'propertyNames',
  'minProperties',
  'maxProperties',
  'items',
  'minItems',
  'maxItems',
  'oneOf',
  'anyOf',
  'not',
  '$ref',
  'description',
  'title',
  'default',
  'examples',
  'format',
  'contentMediaType',
  'uniqueItems',
]);

/** Of the ends and of what lies between; ends are where mistakes are. */
function integer({ minimum = -1e6, maximum = 1e6, exclusiveMinimum, exclusiveMaximum }) {
  const min = Math.max(Math.ceil(minimum), exclusiveMinimum === undefined ? -Infinity : Math.floor(exclusiveMinimum) + 1);
  const max = Math.min(Math.floor(maximum), exclusiveMaximum === undefined ? Infinity : Math.ceil(exclusiveMaximum) - 1);
  return fc.oneof(
    { weight: 1, arbitrary: fc.constantFrom(min, max) },
    { weight: 3, arbitrary: fc.integer({ min, max: Math.min(max, min + 1000) }) },
    { weight: 1, arbitrary: fc.integer({ min, max }) },
  );
}

function number({ minimum, maximum, exclusiveMinimum, exclusiveMaximum }) {
  const min = exclusiveMinimum ?? minimum ?? -1e9;
  const max = exclusiveMaximum ?? maximum ?? 1e9;
  const doubles = fc.double({
    min,
    max,
    minExcluded: exclusiveMinimum !== undefined,
    maxExcluded: exclusiveMaximum !== undefined,
    noNaN: true,
  });
  const least = exclusiveMinimum === undefined ? Math.ceil(min) : Math.floor(min) + 1;
  const most = Math.min(exclusiveMaximum === undefined ? Math.floor(max) : Math.ceil(max) - 1, least + 100);
  return least > most
    ? doubles
    : fc.oneof({ weight: 3, arbitrary: doubles }, { weight: 2, arbitrary: fc.integer({ min: least, max: most }) });
}

const lengths = ({ minLength = 0, maxLength = 40 }) => ({ minLength, maxLength: Math.min(maxLength, minLength + 40) });

function string(schema) {
  const { minLength, maxLength } = lengths(schema);
  // JSON Schema counts code points.
  const fits = (text) => [...text].length >= minLength && [...text].length <= (schema.maxLength ?? Infinity);
  if (schema.pattern) return fc.stringMatching(new RegExp(schema.pattern)).filter(fits);
  return fc.string({ minLength, maxLength, unit: 'grapheme' }).filter((text) => fits(text) && !text.includes('\0'));
}

/** `caps`: {pointer: part of a schema laid over it}, where a value that fits costs minutes. */
export function arbitraryOf(schema, { resolve, caps = {} }, pointer = '') {
  schema = { ...resolve(schema), ...caps[pointer] };
  for (const keyword of Object.keys(schema))
    if (!understood.has(keyword) && !keyword.startsWith('x-')) throw new Error(`${pointer}: the fuzzer does not know ${keyword}`);
  const inner = (part, name) => arbitraryOf(part, { resolve, caps }, `${pointer}/${name}`);
  if ('const' in schema) return fc.constant(schema.const);
  if (schema.enum) return fc.constantFrom(...schema.enum);
  if (schema.type === undefined && (schema.oneOf ?? schema.anyOf))
    return fc.oneof(...(schema.oneOf ?? schema.anyOf).map((one) => arbitraryOf(one, { resolve, caps }, pointer)));
  if (Array.isArray(schema.type))
    return fc.oneof(...schema.type.map((type) => arbitraryOf({ ...schema, type }, { resolve, caps: {} }, pointer)));
  switch (schema.type) {
    case 'null':
      return fc.constant(null);
    case 'boolean':
      return fc.boolean();
    case 'integer':
      return integer(schema);
    case 'number':
      return number(schema);
    case 'string':
      return string(schema);
    case 'array': {
      const minLength = schema.minItems ?? 0;
      const array = schema.uniqueItems ? fc.uniqueArray : fc.array;
      return array(inner(schema.items ?? {}, 'items'), {
        minLength,
        maxLength: Math.min(schema.maxItems ?? Infinity, minLength + 4),
      });
    }
    case 'object':
      return object(schema, inner);
    case undefined:
      return fc.jsonValue({ maxDepth: 2 });
    default:
      throw new Error(`${pointer}: type ${schema.type}`);
  }
}

/** Few of the optional members at a time: with all of them some rule between two fields would always be broken. */
function object(schema, inner) {
  const properties = schema.properties ?? {};
  const required = schema.required ?? [];
  const optional = Object.keys(properties).filter((name) => !required.includes(name));
  const least = Math.min(optional.length, Math.max(0, (schema.minProperties ?? 0) - required.length));
  const arbitraries = Object.fromEntries(Object.entries(properties).map(([name, part]) => [name, inner(part, name)]));
  const known = fc
    .subarray(optional, { minLength: least, maxLength: Math.min(optional.length, Math.max(least, 3)) })
    .chain((chosen) =>
      fc.record(Object.fromEntries([...required, ...chosen].map((name) => [name, arbitraries[name] ?? fc.jsonValue()]))),
    );
  if (typeof schema.additionalProperties !== 'object' || schema.properties) return known.map((value) => ({ ...value }));
  const name = schema.propertyNames
    ? inner(schema.propertyNames.type ? schema.propertyNames : { type: 'string', ...schema.propertyNames }, '*name')
    : fc.string();
  return fc.dictionary(name, inner(schema.additionalProperties, '*'), {
    maxKeys: Math.min(schema.maxProperties ?? 5, 5),
    noNullPrototype: true,
  });
}
