// A small static file server on this machine only, for the page and for the browser tests.

import { createReadStream, readFileSync } from 'node:fs';
import { stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize, sep } from 'node:path';

const TYPES = {
  '.css': 'text/css; charset=utf-8',
  '.html': 'text/html; charset=utf-8',
  '.ico': 'image/x-icon',
  '.js': 'text/javascript; charset=utf-8',
  '.json': 'application/json',
  '.map': 'application/json',
  '.mjs': 'text/javascript; charset=utf-8',
  '.ply': 'application/octet-stream',
  '.png': 'image/png',
  '.svg': 'image/svg+xml',
  '.txt': 'text/plain; charset=utf-8',
  '.wasm': 'application/wasm',
  '.webmanifest': 'application/manifest+json',
  '.webp': 'image/webp',
  '.woff2': 'font/woff2',
};

/** With these two a page is cross-origin isolated and may share memory between threads. */
export const ISOLATION = {
  'Cross-Origin-Opener-Policy': 'same-origin',
  'Cross-Origin-Embedder-Policy': 'require-corp',
};

/**
 * The headers that the page in a folder wants: isolation, types that are taken as they are told, and its own
 * Content-Security-Policy, which as a <meta> holds for the page but not for its workers, and can't forbid frames.
 */
export function pageHeaders(folder) {
  const [, policy] = readFileSync(join(folder, 'index.html'), 'utf8').match(/content="(default-src[^"]*)"/);
  return {
    ...ISOLATION,
    'X-Content-Type-Options': 'nosniff',
    'Content-Security-Policy': `${policy}; frame-ancestors 'none'`,
  };
}

/**
 * Serves a folder on 127.0.0.1 until `close()` is called, with `headers` on every answer.
 * Port 0 is any free one; with `next`, a port that is taken gives way to the next free one.
 */
export async function serve(folder, { port = 0, next = false, headers = ISOLATION } = {}) {
  const server = createServer((request, response) => {
    answer(folder, request, response, headers).catch(() => response.destroy());
  });
  const actual = await listen(server, port, next);
  return {
    url: `http://127.0.0.1:${actual}/`,
    close: () =>
      new Promise((closed) => {
        server.close(closed);
        server.closeAllConnections();
      }),
  };
}

function listen(server, port, next) {
  return new Promise((resolve, reject) => {
    server.once('error', (error) => {
      if (next && error.code === 'EADDRINUSE' && port < 65535) resolve(listen(server, port + 1, next));
      else reject(error);
    });
    server.listen(port, '127.0.0.1', () => {
      server.removeAllListeners('error');
      resolve(server.address().port);
    });
  });
}

async function answer(folder, request, response, headers) {
  const refuse = (status, text) => {
    response.writeHead(status, { ...headers, 'Content-Type': TYPES['.txt'] }).end(`${text}\n`);
  };
  if (request.method !== 'GET' && request.method !== 'HEAD') return refuse(405, 'only GET and HEAD');
  let path;
  try {
    path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  } catch {
    return refuse(400, 'not an address');
  }
  if (path.includes('\0')) return refuse(400, 'not an address');
  // Normalised and absolute, so that it cannot lead out of the folder.
  const file = join(folder, path.endsWith(sep) ? join(path, 'index.html') : path);
  const found = await stat(file).catch(() => undefined);
  if (!found?.isFile()) return refuse(404, 'no such file');
  response.writeHead(200, {
    ...headers,
    'Content-Type': TYPES[extname(file)] ?? 'application/octet-stream',
    'Content-Length': found.size,
    'Cache-Control': 'no-cache',
  });
  if (request.method === 'HEAD') response.end();
  else
    createReadStream(file)
      .on('error', () => response.destroy())
      .pipe(response);
}
