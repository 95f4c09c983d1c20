// contract: every answer is held against the server's own OpenAPI document. A status, media type or shape that the document
// does not state fails the test, so the document cannot drift from the server.
import assert from 'node:assert/strict';
import Ajv2020 from 'ajv/dist/2020.js';
import { mediaType } from './http.mjs';

const formats = {
  uuid: /^[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}$/,
  'date-time': /^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z$/,
  uri: /^[a-z][a-z0-9+.-]*:\S*$/i,
  'uri-reference': /^\S*$/,
  'json-pointer': /^(\/([^~]|~[01])*)*$/,
  double: true, float: true, int32: true, int64: true, binary: true,
};
const methods = ['get', 'put', 'post', 'delete', 'options', 'head', 'patch', 'trace'];

/** What any answer may carry, whatever it is an answer to; every other header must be stated. */
const commonHeaders = new Set(['allow', 'cache-control', 'connection', 'content-length', 'content-security-policy', 'content-type',
  'cross-origin-opener-policy', 'cross-origin-resource-policy', 'date', 'keep-alive', 'permissions-policy', 'referrer-policy', 'retry-after',
  'strict-transport-security', 'transfer-encoding', 'vary', 'www-authenticate', 'x-content-type-options', 'x-frame-options', 'x-request-id']);

/** What the request gate may answer to anything before it looks at the path. */
const gateStatuses = [400, 401, 403, 408, 413, 414, 421, 429, 431, 503];

export class Contract {
  constructor(openapi) {
    this.openapi = openapi;
    this.ajv = new Ajv2020({ allErrors: true, strict: false, formats });
    this.validators = new Map();
    this.templates = Object.keys(openapi.paths).map((template) => ({ template, segments: template.split('/') }));
  }

  /** Follows `$ref` in the parts of the document that are not schemas. */
  resolve(node) {
    let found = node;
    while (found && found.$ref) {
      found = found.$ref.slice(2).split('/')
        .reduce((at, part) => at?.[decodeURIComponent(part).replace(/~1/g, '/').replace(/~0/g, '~')], this.openapi);
    }
    return found;
  }

  validator(schema) {
    const key = JSON.stringify(schema);
    if (!this.validators.has(key)) {
      // The components ride along, so that #/components/schemas/X resolves inside this very schema.
      this.validators.set(key, this.ajv.compile({ components: this.openapi.components, allOf: [schema] }));
    }
    return this.validators.get(key);
  }

  validate(schema, value, what) {
    const valid = this.validator(schema);
    if (!valid(value)) {
      const errors = valid.errors.slice(0, 8).map((error) => `${error.instancePath || '/'} ${error.message} ${JSON.stringify(error.params)}`);
      assert.fail(`${what} is not what openapi.json says:\n  ${errors.join('\n  ')}\n${JSON.stringify(value).slice(0, 2000)}`);
    }
  }

  /** The path item whose template fits; literal segments win over parameters. */
  find(path) {
    const segments = path.split('?')[0].split('/');
    const fits = this.templates.filter((candidate) => candidate.segments.length === segments.length
      && candidate.segments.every((part, index) => part.startsWith('{') || part === segments[index]));
    const literals = (candidate) => candidate.segments.filter((part) => !part.startsWith('{')).length;
    return fits.sort((a, b) => literals(b) - literals(a))[0]?.template;
  }

  checkProblem(response, what) {
    assert.equal(mediaType(response.headers), 'application/problem+json', `${what}: ${response.text.slice(0, 500)}`);
    const problem = response.json;
    assert.match(problem.type, /^urn:colony:problem:[a-z][a-z0-9-]*$/, what);
    assert.equal(problem.status, response.status, what);
    for (const name of ['title', 'detail', 'request_id']) assert.equal(typeof problem[name], 'string', `${what}: ${name}`);
    for (const error of problem.errors ?? []) {
      assert.equal(typeof error.message, 'string', what);
      assert.ok(('pointer' in error) !== ('parameter' in error), `${what}: an error has a pointer or a parameter: ${JSON.stringify(error)}`);
    }
    const schema = this.openapi.components?.schemas?.Problem;
    assert.ok(schema, 'openapi.json has components.schemas.Problem');
    this.validate(schema, problem, what);
  }

  /** Each header is one that all answers may have, or stated for this one and of its schema; those that are required are there. */
  checkHeaders(answer, response, what, method) {
    const stated = Object.fromEntries(Object.entries(answer.headers ?? {}).map(([name, header]) => [name.toLowerCase(), this.resolve(header)]));
    for (const [name, header] of Object.entries(stated)) {
      if (response.headers[name] !== undefined) this.validate(header.schema, response.headers[name], `${what}: the header ${name}`);
      else assert.ok(!header.required || method === 'HEAD', `${what}: the header ${name} is missing`);
    }
    for (const name of Object.keys(response.headers)) {
      assert.ok(commonHeaders.has(name) || stated[name], `${what}: a header that openapi.json does not state: ${name}: ${response.headers[name]}`);
    }
  }

  /** `gate`: the request is made to be refused before its path is looked at. */
  check(method, path, response, { gate = false } = {}) {
    const what = `${method} ${path} -> ${response.status} ${mediaType(response.headers)}`;
    // The document may state it, but a bug is a bug.
    assert.notEqual(response.status, 500, `${what}: ${response.text}`);
    if (response.status >= 400 && method !== 'HEAD') this.checkProblem(response, what);
    if (gate && gateStatuses.includes(response.status)) return;
    const template = this.find(path);
    if (!template) {
      assert.equal(response.status, 404, `${what}: a path that openapi.json does not have`);
      return;
    }
    const item = this.resolve(this.openapi.paths[template]);
    const operation = item[method === 'HEAD' ? 'get' : method.toLowerCase()];
    if (!operation) {
      assert.equal(response.status, 405, `${what}: a method that openapi.json does not have`);
      const allowed = (response.headers.allow ?? '').split(',').map((name) => name.trim().toLowerCase());
      for (const name of methods.filter((candidate) => item[candidate])) assert.ok(allowed.includes(name), `${what}: Allow lacks ${name}`);
      return;
    }
    const answer = this.resolve(operation.responses[response.status] ?? operation.responses[`${Math.trunc(response.status / 100)}XX`]);
    assert.ok(answer, `${what}: a status that openapi.json does not state for ${template}`);
    this.checkHeaders(answer, response, what, method);
    if (method === 'HEAD' || response.status === 304 || !answer.content) {
      assert.equal(response.body.length, 0, `${what}: a body that openapi.json does not state`);
      return;
    }
    const content = answer.content[mediaType(response.headers)];
    assert.ok(content, `${what}: a media type that openapi.json does not state for ${template}`);
    if (/[/+]json$/.test(mediaType(response.headers))) {
      assert.ok(content.schema, `${what}: openapi.json has no schema`);
      assert.notEqual(response.json, undefined, `${what}: no body`);
      this.validate(content.schema, response.json, what);
    } else if (mediaType(response.headers) === 'application/x-ndjson' && content.schema && this.resolve(content.schema).type !== 'string') {
      response.text.split('\n').filter(Boolean).forEach((line, index) => this.validate(content.schema, JSON.parse(line), `${what} line ${index + 1}`));
    }
  }
}
