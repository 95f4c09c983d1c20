// cli_tokens: `colony tokens` against a server that needs them: secrets are shown once, and only admins may.
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import test from 'node:test';
import { assertSane, cleanEnvironment, cliBinary, createToken, startServer, temporaryFolder } from './harness/server.mjs';

const bearer = (token) => ({ Authorization: `Bearer ${token}` });

test('the command line makes, shows and revokes tokens', async (t) => {
  const data = temporaryFolder(t);
  const root = createToken(data, 'root', 'admin');
  const server = await startServer(t, { data, token: root, args: ['--auth.mode', 'required'] });
  const colony = (args, token = root) => {
    const run = spawnSync(cliBinary, args, { env: { ...cleanEnvironment(), HOME: data, COLONY_SERVER: server.url, COLONY_TOKEN: token }, encoding: 'utf8', timeout: 60_000 });
    assertSane(run.stderr);
    return run;
  };
  const ok = (...args) => {
    const run = colony(args);
    assert.equal(run.status, 0, run.stderr);
    return run;
  };
  const made = ok('tokens', 'create', '--name', 'dashboard', '--scope', 'read', '--expires-h', '0.5');
  assert.match(made.stdout, /^colony_[0-9a-f]{64}\n$/, 'the secret alone');
  const secret = made.stdout.trim();
  const [, id] = /^token (\S+) for dashboard, scope read, valid until \S+; it is shown this once\n$/.exec(made.stderr);
  assert.equal((await server.get('/v1/jobs', bearer(secret))).status, 200);
  const json = JSON.parse(ok('tokens', 'create', '--name', 'x', '--scope', 'submit', '--expires-h', '1', '--json').stdout);
  assert.match(json.token, /^colony_/);
  const { json: list } = await server.get('/v1/tokens');
  assert.deepEqual(JSON.parse(ok('tokens', 'list', '--json').stdout), list);
  const table = ok('tokens', 'list').stdout;
  for (const row of list.items) assert.ok(table.includes(row.id) && table.includes(row.name));
  assert.doesNotMatch(table, /colony_/);

  for (const args of [['list'], ['create', '--name', 'y', '--scope', 'read', '--expires-h', '1'], ['delete', id]]) {
    const refused = colony(['tokens', ...args], json.token);
    assert.equal(refused.status, 4, `${args[0]} needs scope admin`);
    assert.match(refused.stderr, /scope/);
  }
  const wrong = colony(['tokens', 'create', '--name', 'local', '--scope', 'root', '--expires-h', '0.0001']);
  assert.equal(wrong.status, 4);
  for (const field of ['name', 'scope', 'expires_h']) assert.match(wrong.stderr, new RegExp(`/${field}`));
  // A secret in place of the id, whole or in part, is never repeated.
  const bare = secret.slice('colony_'.length);
  const mistakes = [[[], 2], [['create', '--name', 'y'], 2], [['delete'], 2],
    ...[secret, secret.toUpperCase(), bare, bare.toUpperCase()].map((given) => [['delete', given], 2]),
    ...[bare.slice(0, 20), bare.slice(-8)].map((given) => [['delete', given], 4])];
  for (const [args, status] of mistakes) {
    const usage = colony(['tokens', ...args]);
    assert.equal(usage.status, status, args.join(' '));
    if (args[0] === 'delete' && args[1]) assert.ok(!`${usage.stdout}${usage.stderr}`.toLowerCase().includes(args[1].toLowerCase()), usage.stderr);
  }
  assert.match(ok('tokens', '--help').stdout, /list[^]*create[^]*delete[^]*colonyd token create/);

  ok('tokens', 'delete', id.slice(-8));
  assert.equal((await server.get('/v1/jobs', bearer(secret))).status, 401);
  const last = list.items.find(({ name }) => name === 'root');
  const kept = colony(['tokens', 'delete', last.id]);
  assert.equal(kept.status, 4);
  assert.match(kept.stderr, /colonyd token create/);
  for (const one of [root, secret, json.token]) assert.ok(!`${server.out}${server.err}`.includes(one.slice(7, 20)), 'a token is in the log');
});
