// plan: requests that fit the document and requests that do not, for one operation of it. Nothing here knows a server: ids and pictures are given.
import fc from 'fast-check';
import { arbitraryOf } from './arbitraries.mjs';
import { textMutations, valueMutations, wrongAccepts, wrongContentTypes, wrongIds, wrongTexts } from './mutations.mjs';

/** Where a value that fits would cost seconds each: parts of a schema laid over it, by parameter or by place in a body. */
const caps = {
  /** Given always, since the value that holds without them is a large picture. */
  always: ['width_px'],
  parameters: {
    width_px: { maximum: 300 },
    um_per_px: { minimum: 1, maximum: 50 },
    triangles_max: { maximum: 30_000 },
    points: { maximum: 200 },
  },
  '/model/founders/count': { maximum: 200 },
  '/model/founders/positions_um': { maxItems: 5 },
};

/** An id that nothing has. */
export const nobody = '01890000-0000-7000-8000-000000000000';

const oneOf = (list) => fc.constantFrom(...list);
const isJson = (media) => /[/+]json$/.test(media);

export class Plan {
  /** `known`: {name of a path parameter: [ids that exist]}; `picture`: bytes of a PNG. */
  constructor(contract, { method, template, operation }, { known, picture }) {
    Object.assign(this, { contract, method, template, operation, known, picture });
    this.parameters = (operation.parameters ?? []).map((one) => contract.resolve(one));
    this.query = this.parameters.filter((one) => one.in === 'query');
    this.content = contract.resolve(operation.requestBody)?.content ?? {};
    this.media = Object.keys(this.content);
    this.answers = [
      ...new Set(
        Object.entries(operation.responses)
          .filter(([status]) => /^2/.test(status))
          .flatMap(([, one]) => Object.keys(contract.resolve(one).content ?? {})),
      ),
    ];
    this.resolve = (schema) => contract.resolve(schema);
  }

  pathWith(ids) {
    return this.template.replace(/\{(\w+)\}/g, (_, name) => ids[name]);
  }
  get pathNames() {
    return [...this.template.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
  }
  get rightIds() {
    return fc.record(
      Object.fromEntries(
        this.pathNames.map((name) => {
          return [name, oneOf(this.known[name] ?? [nobody])];
        }),
      ),
    );
  }

  /** A stream has no end to wait for; the tests of streams read those. */
  get isStream() {
    return this.answers.length === 1 && this.answers[0] === 'text/event-stream';
  }

  /** One parameter's value as it stands in a query or header. */
  textOf(parameter) {
    const schema = { ...this.resolve(parameter.schema), ...caps.parameters[parameter.name] };
    return arbitraryOf(schema, this).map((value) => {
      // Node's client sends no other characters in a header.
      if (parameter.in === 'header')
        return [
          String(value)
            .replace(/[^ -~]/g, '')
            .trim() || 'x',
        ];
      if (Array.isArray(value)) return parameter.explode ? value.map(String) : [[...new Set(value)].join(',')].filter(Boolean);
      return [String(value)];
    });
  }

  /** Headers and bytes of a body that fits. */
  get rightBody() {
    if (this.media.length === 0) return fc.constant({ headers: {}, body: undefined });
    return oneOf(this.media).chain((media) => {
      const headers = { 'Content-Type': media };
      if (!isJson(media)) return fc.constant({ headers: { 'Content-Type': 'image/png' }, body: this.picture });
      return this.rightValue(media).map((value) => ({ headers, body: JSON.stringify(value) }));
    });
  }

  rightValue(media) {
    const { schema, examples } = this.content[media];
    const valid = this.contract.validator(schema);
    const made = arbitraryOf(schema, { resolve: this.resolve, caps })
      .map((value) => this.named(value))
      .filter((value) => valid(value));
    return examples
      ? fc.oneof(
          { weight: 4, arbitrary: made },
          { weight: 1, arbitrary: oneOf(Object.values(examples)).map(({ value }) => this.named(value)) },
        )
      : made;
  }

  /** Ids in a body become ids that exist, most of the time by chance else never. */
  named(value) {
    if (value === null || typeof value !== 'object' || Array.isArray(value)) return value;
    return Object.fromEntries(
      Object.entries(value).map(([name, one]) => [name, this.known[name] && typeof one === 'string' ? this.known[name][0] : one]),
    );
  }

  get right() {
    const optional = this.query.filter(({ name }) => name !== 'cursor');
    const query = fc
      .subarray(optional, { maxLength: Math.min(3, optional.length) })
      .map((chosen) => [
        ...chosen,
        ...optional.filter(
          (one) => caps.always.includes(one.name) && !chosen.includes(one) && !chosen.some(({ name }) => name === 'um_per_px'),
        ),
      ])
      .chain((chosen) =>
        fc.tuple(
          ...chosen.map((one) => this.textOf(one).map((texts) => texts.map((text) => `${one.name}=${encodeURIComponent(text)}`))),
        ),
      )
      .map((parts) => parts.flat().join('&'));
    const stated = this.parameters.filter((one) => one.in === 'header');
    const headers = fc
      .subarray(stated)
      .chain((chosen) => fc.record(Object.fromEntries(chosen.map((one) => [one.name, this.textOf(one).map(([text]) => text)]))));
    // A stream of a job that has not ended has no end to wait for.
    const accepts = this.answers.filter((media) => media !== 'text/event-stream');
    const accept = fc.option(oneOf([...accepts, '*/*', 'text/html, */*;q=0.1']), { nil: undefined });
    return fc.record({ ids: this.rightIds, query, headers, accept, body: this.rightBody, head: fc.boolean() }).map((one) => ({
      what: 'a request that fits',
      method: one.head && this.method === 'GET' ? 'HEAD' : this.method,
      path: this.pathWith(one.ids) + (one.query ? `?${one.query}` : ''),
      headers: { ...one.headers, ...(one.accept ? { Accept: one.accept } : {}), ...one.body.headers },
      body: one.body.body,
    }));
  }

  /** Requests that must be refused; each with the statuses that are a refusal of it. */
  get broken() {
    const base = (ids, more) => ({ method: this.method, path: this.pathWith(ids), headers: {}, ...more });
    const choices = fc.tuple(fc.nat(), fc.nat());
    const kinds = [
      fc
        .tuple(this.rightIds, this.rightBody, oneOf(['colour', 'Limit', '%00', '%F0%9F%A7%AB', 'x[]', '__proto__', '']))
        .map(([ids, body, name]) =>
          base(ids, {
            ...body,
            what: 'an unknown parameter',
            path: `${this.pathWith(ids)}?${name}=1`,
            statuses: [400, 422],
          }),
        ),
      fc
        .tuple(
          this.rightIds,
          this.rightBody,
          oneOf(
            ['PUT', 'PATCH', 'DELETE', 'POST', 'GET'].filter(
              (method) => !this.contract.openapi.paths[this.template][method.toLowerCase()],
            ),
          ),
        )
        .map(([ids, body, method]) => base(ids, { ...body, method, what: 'another method', statuses: [405, 501] })),
      fc
        .tuple(this.rightIds, this.rightBody)
        .map(([ids, body]) =>
          base(ids, { ...body, what: 'a longer path', path: `${this.pathWith(ids)}/made/up/path`, statuses: [404] }),
        ),
    ];
    if (this.pathNames.length > 0) {
      kinds.push(
        fc.tuple(this.rightIds, this.rightBody, oneOf(this.pathNames), oneOf(wrongIds)).map(([ids, body, name, wrong]) =>
          base(ids, {
            ...body,
            what: 'a wrong id',
            path: this.pathWith({ ...ids, [name]: wrong }),
            statuses: [400, 404, 422],
          }),
        ),
      );
    }
    if (this.answers.length > 0) {
      kinds.push(
        fc
          .tuple(
            this.rightIds,
            this.rightBody,
            oneOf(
              wrongAccepts.filter(
                (range) =>
                  !(range.startsWith('application/json') && !this.answers.every((media) => media === 'application/json')),
              ),
            ),
          )
          .map(([ids, { body, headers }, accept]) =>
            base(ids, { body, headers: { ...headers, Accept: accept }, what: `Accept: ${accept}`, statuses: [406] }),
          ),
      );
    }
    if (this.query.length > 0) kinds.push(this.brokenQuery(base));
    if (this.media.length > 0) {
      kinds.push(
        fc.tuple(this.rightIds, this.rightBody, oneOf(wrongContentTypes)).map(([ids, { body }, media]) =>
          base(ids, {
            body,
            headers: media ? { 'Content-Type': media } : {},
            what: `Content-Type: ${media}`,
            statuses: [415],
          }),
        ),
      );
      const json = this.media.filter(isJson);
      if (json.length > 0) kinds.push(...this.brokenBodies(base, choices, json));
      else {
        kinds.push(
          fc.tuple(this.rightIds, fc.uint8Array({ maxLength: 200 }), oneOf(this.media), fc.nat()).map(([ids, bytes, media, n]) =>
            base(ids, {
              body: n % 2 ? Buffer.from(bytes) : this.picture.subarray(0, n % (this.picture.length - 20)),
              headers: { 'Content-Type': media },
              what: 'no picture',
              statuses: [400, 422],
            }),
          ),
        );
      }
    }
    return fc.oneof(...kinds);
  }

  brokenQuery(base) {
    return oneOf(this.query).chain((parameter) => {
      const schema = this.resolve(parameter.schema);
      const one = this.resolve(schema.items ?? schema);
      const texts = (one.enum ? wrongTexts.enum : wrongTexts[one.type]).map((text) =>
        text.startsWith('%') && one.type === 'string' && !one.enum ? text : encodeURIComponent(text),
      );
      if (one.maximum !== undefined) texts.push(String(one.maximum * 2 + 1), '1e308', String(one.minimum - 1));
      const twice =
        schema.items && parameter.explode !== false ? [] : [`${one.enum?.[0] ?? 1}&${parameter.name}=${one.enum?.[0] ?? 1}`];
      return fc.tuple(this.rightIds, this.rightBody, oneOf([...texts, ...twice])).map(([ids, body, text]) =>
        base(ids, {
          ...body,
          what: `${parameter.name}=${text}`,
          path: `${this.pathWith(ids)}?${parameter.name}=${text}`,
          statuses: [400, 422],
        }),
      );
    });
  }

  brokenBodies(base, choices, json) {
    const byText = fc
      .tuple(
        this.rightIds,
        oneOf(json).chain((media) => fc.tuple(fc.constant(media), this.rightValue(media))),
        oneOf(Object.keys(textMutations)),
        choices,
      )
      .map(([ids, [media, value], name, [n]]) =>
        base(ids, {
          what: name,
          body: textMutations[name](JSON.stringify(value), n),
          headers: { 'Content-Type': media },
          statuses: [400, 422],
        }),
      );
    const byValue = fc
      .tuple(
        this.rightIds,
        oneOf(json).chain((media) => fc.tuple(fc.constant(media), this.rightValue(media))),
        oneOf(Object.keys(valueMutations)),
        choices,
      )
      .map(([ids, [media, value], name, [n, m]]) => {
        let after = valueMutations[name](value, n, m);
        const wrong = !this.contract.validator(this.content[media].schema)(after);
        // It may still fit by chance; an array never does.
        if (!wrong) after = [value];
        return base(ids, {
          what: wrong ? name : 'an array',
          body: JSON.stringify(after),
          headers: { 'Content-Type': media },
          statuses: [422],
        });
      });
    return [byText, byValue];
  }
}
