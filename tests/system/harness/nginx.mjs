// nginx: a real reverse proxy before a server, on a free port, in a folder of its own, ended by its pid.
import { spawn } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import net from 'node:net';
import { join } from 'node:path';
import { cleanup } from './cleanup.mjs';
import { eventually, within } from './wait.mjs';

function freePort() {
  return new Promise((done, fail) => {
    const probe = net.createServer().listen(0, '127.0.0.1', () => {
      const { port } = probe.address();
      probe.close(() => done(port));
    });
    probe.on('error', fail);
  });
}

const canConnect = (port) => new Promise((done) => {
  const socket = net.connect(port, '127.0.0.1', () => { socket.destroy(); done(true); });
  socket.on('error', () => done(false));
});

/**
 * Passes everything under `base` to `upstream` over kept connections: what one request hides, the next would meet. Each request gets an id
 * from it. Gives {port, seen}; seen() is the ids of the requests that it has read.
 */
export async function startNginx(t, folder, upstream, base) {
  const port = await freePort();
  mkdirSync(join(folder, 'nginx'), { recursive: true });
  const at = (name) => join(folder, 'nginx', name);
  writeFileSync(at('nginx.conf'), `
    daemon off; master_process off; worker_processes 1; pid ${at('pid')}; error_log ${at('error.log')};
    events { worker_connections 256; }
    http {
      log_format id '$request_id';
      access_log ${at('access.log')} id;
      ${['client_body', 'proxy', 'fastcgi', 'uwsgi', 'scgi'].map((name) => `${name}_temp_path ${at(name)};`).join(' ')}
      client_max_body_size 40m;
      upstream colonyd { server 127.0.0.1:${upstream}; keepalive 4; }
      server {
        listen 127.0.0.1:${port};
        location ${base}/ {
          proxy_pass http://colonyd;
          proxy_http_version 1.1;
          proxy_set_header Host $host;
          proxy_set_header Connection "";
          proxy_set_header X-Request-Id $request_id;
          proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for;
          proxy_request_buffering off;
          proxy_buffering off;
        }
      }
    }`);
  const child = spawn('nginx', ['-c', at('nginx.conf'), '-e', at('error.log'), '-p', at('')], { stdio: 'ignore' });
  const ended = new Promise((done) => {
    child.on('error', done);
    child.on('exit', done);
  });
  const kill = () => child.kill('SIGKILL');
  process.on('exit', kill);
  cleanup(t, async () => {
    child.kill('SIGTERM');
    await within(10_000, ended, 'nginx to end');
    process.removeListener('exit', kill);
  });
  await eventually('nginx to listen', () => canConnect(port), 20_000);
  return { port, seen: () => new Set(readFileSync(at('access.log'), 'utf8').split('\n')) };
}
