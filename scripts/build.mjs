// Builds dist/: both wasm packages by wasm-pack, then the JavaScript by the TypeScript compiler and esbuild.
// All flags of the builds are here, in single.toml and threads.toml beside this file, and in Cargo.toml.

import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { gzipSync } from 'node:zlib';
import { Failure, main, root, run, started, tell } from './run.mjs';
import { setup } from './setup.mjs';

const WASM = {
  single: {
    cargo: ['--no-default-features', '--config', 'scripts/single.toml'],
    finish: (glue) => glue,
    limit: 60,
  },
  threads: {
    // A target directory of its own, because it holds a standard library of its own.
    cargo: ['--features', 'threads', '--config', 'scripts/threads.toml', '--target-dir', 'target/threads'],
    finish: withOwnPool,
    limit: 100,
  },
};
const JAVASCRIPT_LIMIT = 8;

/** Builds what has changed, and checks the sizes. */
export function build() {
  for (const name of Object.keys(WASM)) buildWasm(name);
  buildJavaScript();
  checkSizes();
}

function buildWasm(name) {
  const folder = join(root, 'dist', name);
  const stamp = join(root, 'target', `built-${name}`);
  const hash = sourceHash();
  if (existsSync(folder) && existsSync(stamp) && readFileSync(stamp, 'utf8') === hash) return;

  const { cargo, finish } = WASM[name];
  tell(`build: dist/${name} by wasm-pack, because its sources are new or changed`);
  rmSync(stamp, { force: true });
  rmSync(folder, { recursive: true, force: true });
  // The package has one package.json, licence and readme for both builds: none from wasm-pack.
  const output = ['--out-dir', `dist/${name}`, '--out-name', 'bilinormal', '--no-pack', '--no-gitignore'];
  run('wasm-pack', ['build', '.', '--mode', 'no-install', '--target', 'web', '--release', ...output, '--', ...cargo]);

  const glue = join(folder, 'bilinormal.js');
  writeFileSync(glue, finish(readFileSync(glue, 'utf8')));
  rmSync(join(folder, 'snippets'), { recursive: true, force: true });
  minify([glue]);
  mkdirSync(join(root, 'target'), { recursive: true });
  writeFileSync(stamp, hash);
}

/**
 * Lets the threads build start its pool by `src/js/pool.ts` instead of the helper of wasm-bindgen-rayon, which imports a
 * folder (only bundlers resolve that), knows no Node, and waits for ever when a worker fails to load.
 */
function withOwnPool(glue) {
  const helper = /(import \{ startWorkers \} from )'\.\/snippets\/wasm-bindgen-rayon-[^']*\/workerHelpers\.js'/;
  if (!helper.test(glue)) throw new Failure('dist/threads/bilinormal.js: no import of startWorkers to point at pool.js');
  return glue.replace(helper, "$1'../pool.js'");
}

/** One hash over all that goes into the wasm builds: wasm-opt is not incremental, so they are skipped as a whole. */
function sourceHash() {
  const hash = createHash('sha256');
  const sources = filesIn('src').filter((path) => path.endsWith('.rs'));
  const settings = ['Cargo.toml', 'Cargo.lock', 'rust-toolchain.toml', 'package-lock.json'];
  for (const path of [...sources, ...settings, ...filesIn('scripts')]) {
    hash.update(`${path}\0`).update(readFileSync(join(root, path))).update('\0');
  }
  return hash.digest('hex');
}

function buildJavaScript() {
  run('tsc', ['--project', '.']);
  const compiled = filesIn('dist').filter((path) => path.endsWith('.js') && dirname(path) === 'dist');
  minify(compiled.map((path) => join(root, path)));
}

/** File by file, without bundling: a bundler or browser must still see `new URL('./worker.js', import.meta.url)`. */
function minify(files) {
  run('esbuild', [...files, '--minify', '--format=esm', '--target=es2022', `--outdir=${root}`, `--outbase=${root}`, '--allow-overwrite', '--log-level=warning']);
}

function checkSizes() {
  const sizes = Object.entries(WASM).map(([name, { limit }]) => [`${name} wasm`, [`dist/${name}/bilinormal_bg.wasm`], limit]);
  sizes.push(['JavaScript', downloadedJavaScript(), JAVASCRIPT_LIMIT]);
  for (const [what, files, limit] of sizes) {
    const kibibytes = files.reduce((sum, file) => sum + gzipSync(readFileSync(join(root, file)), { level: 9 }).length, 0) / 1024;
    const text = `${what}: ${kibibytes.toFixed(1)} KiB gzipped, limit ${limit} (${files.join(', ')})`;
    if (kibibytes > limit) throw new Failure(text);
    tell(`build: ${text}`);
  }
}

/** What a browser loads: all that index.js leads to, with the larger of the two builds' glue. */
function downloadedJavaScript() {
  const found = new Set(['dist/index.js']);
  for (const file of found) {
    const text = readFileSync(join(root, file), 'utf8');
    for (const [, path] of text.matchAll(/(?:\bfrom|\bimport|\bimport\(|\bnew URL\()\s*["'`](\.[^"'`]*\.js)["'`]/g)) {
      found.add(join(dirname(file), path));
    }
  }
  const size = (file) => readFileSync(join(root, file)).length;
  const [smaller] = Object.keys(WASM).map((name) => join('dist', name, 'bilinormal.js')).sort((a, b) => size(a) - size(b));
  return [...found].filter((file) => file !== smaller);
}

/** The files below a folder, relative to the root, in a fixed order. */
function filesIn(folder) {
  const entries = readdirSync(join(root, folder), { recursive: true, withFileTypes: true });
  return entries.filter((entry) => entry.isFile()).map((entry) => relative(root, join(entry.parentPath ?? entry.path, entry.name))).sort();
}

if (started(import.meta)) {
  await main(() => {
    setup();
    build();
  });
}
