// openapi_lint: the document that a server gives is well-formed OpenAPI 3.1 by two linters, with no error and no warning.
// Why the linters' libraries and not their command lines: the same rules, a quarter of the packages, and nothing that reports its use.
import assert from 'node:assert/strict';
import test from 'node:test';
import { fileURLToPath } from 'node:url';
import redocly from '@redocly/openapi-core';
import { Spectral } from '@stoplight/spectral-core';
import { startServer } from './harness/server.mjs';
import { ruleset } from './lint/spectral.mjs';

const redoclyConfig = fileURLToPath(new URL('./lint/redocly.yaml', import.meta.url));

async function bySpectral(document) {
  const spectral = new Spectral();
  spectral.setRuleset(ruleset);
  return (await spectral.run(document)).map(({ code, path, message }) => `${code} at /${path.join('/')}: ${message}`);
}

async function byRedocly(document) {
  const config = await redocly.loadConfig({ configPath: redoclyConfig });
  const found = await redocly.lintFromString({ source: JSON.stringify(document), absoluteRef: '/openapi.json', config });
  return found.map(({ ruleId, location, message }) => `${ruleId} at ${location[0]?.pointer}: ${message}`);
}

const linters = [
  ['spectral', bySpectral],
  ['redocly', byRedocly],
];

test('openapi.json by its linters', async (t) => {
  const server = await startServer(t);
  const document = server.contract.openapi;
  assert.equal(document.openapi, '3.1.0');
  await t.test(
    'where there are tokens, every operation says which it needs',
    { skip: !document.components.securitySchemes && 'no tokens' },
    () => {
      const open = Object.entries(document.paths).flatMap(([path, item]) =>
        Object.entries(item)
          .filter(([, { security }]) => !security)
          .map(([method]) => `${method} ${path}`),
      );
      assert.deepEqual(open, []);
    },
  );
  for (const [name, lint] of linters) {
    await t.test(`${name}: no error, no warning`, async () => assert.deepEqual(await lint(document), []));
    await t.test(`${name}: a canary: a spoiled document is found out`, async () => {
      const spoiled = structuredClone(document);
      const operation = spoiled.paths['/v1/jobs'].post;
      delete operation.operationId;
      delete operation.requestBody.content['application/json'].examples.smallest.value.until;
      const found = (await lint(spoiled)).join('\n');
      assert.match(found, /operation-operationId/);
      assert.match(found, /example/);
    });
  }
});
