// Builds dist/: both wasm packages by wasm-pack, then the JavaScript by the TypeScript compiler and esbuild.
// All flags of the builds are here, in minify.mjs, single.toml and threads.toml beside this file, and in Cargo.toml.

import { createHash } from 'node:crypto';
import { existsSync, mkdirSync, readFileSync, readdirSync, renameSync, rmSync, writeFileSync } from 'node:fs';
import { dirname, join, relative } from 'node:path';
import { gzipSync } from 'node:zlib';
import { shortenGlue } from './glue.mjs';
import { Failure, main, root, run, started, tell } from './run.mjs';
import { setup } from './setup.mjs';

/**
 * The wasm builds: what cargo is told, what happens to the glue, and the gzipped size allowed in KiB. Each is a module
 * `core`, which every page loads, and a module `full`, which has all there is and is loaded when something asks for it.
 */
const WASM = {
  single: {
    features: [],
    cargo: ['--config', 'scripts/single.toml'],
    finish: (glue) => glue,
    limit: 60,
  },
  threads: {
    features: ['threads'],
    // A target directory of its own, because it holds a standard library of its own.
    cargo: ['--config', 'scripts/threads.toml', '--target-dir', 'target/threads'],
    finish: withOwnPool,
    limit: 100,
  },
};
const JAVASCRIPT_LIMIT = 8;

/** Builds what has changed, and then tells the sizes. */
export function build() {
  const scripts = ['build.mjs', 'glue.mjs', 'minify.mjs', 'single.toml', 'threads.toml'].map(
    (name) => `scripts/${name}`,
  );
  const wasmSources = [...filesIn('src', '.rs'), ...scripts, 'Cargo.toml', 'Cargo.lock', 'rust-toolchain.toml'];
  const built = Object.keys(WASM).map((name) =>
    once(`dist/${name} by wasm-pack`, wasmSources, [`dist/${name}/core.wasm`, `dist/${name}/full.wasm`], () =>
      buildWasm(name),
    ),
  );
  const sources = [...filesIn('src/js'), 'tsconfig.json', ...wasmSources];
  built.push(once('dist/*.js by tsc and esbuild', sources, ['dist/index.js'], buildJavaScript));
  if (built.includes(true)) sizes().forEach(({ text }) => tell(`build: ${text}`));
}

/** Builds the page into www/dist. */
export function buildPage() {
  tell('build: www/dist by Vite');
  run('vite', ['build', 'www', '--logLevel', 'warn']);
}

/**
 * Does a job unless it was done with the same input files, and answers whether it did. For each build as a whole,
 * because the linker and wasm-opt begin anew each time; cargo knows what to compile.
 */
function once(what, inputs, outputs, job) {
  const hash = createHash('sha256');
  for (const path of [...inputs, 'package-lock.json']) {
    hash
      .update(`${path}\0`)
      .update(readFileSync(join(root, path)))
      .update('\0');
  }
  const digest = hash.digest('hex');
  const stamp = join(root, 'target', 'built', what.replace(/\W+/g, '-'));
  const done = existsSync(stamp) && readFileSync(stamp, 'utf8') === digest;
  if (done && outputs.every((path) => existsSync(join(root, path)))) return false;
  tell(`build: ${what}, because its sources are new or changed`);
  rmSync(stamp, { force: true });
  job();
  mkdirSync(dirname(stamp), { recursive: true });
  writeFileSync(stamp, digest);
  return true;
}

function buildWasm(name) {
  const folder = `dist/${name}`;
  rmSync(join(root, folder), { recursive: true, force: true });
  // One glue serves both modules: that of the core is a part of it.
  const core = pack(name, 'core', []);
  const full = pack(name, 'full', ['full']);
  const missing = core.split('\n').find((line) => !full.includes(line));
  if (missing) throw new Failure(`${folder}: the glue of the core has a line that is not in the full one: ${missing}`);
  writeFileSync(join(root, folder, 'bilinormal.js'), shortenGlue(WASM[name].finish(full), folder));
  minify([`${folder}/bilinormal.js`]);
}

/** Builds one module by wasm-pack; leaves it under its name, and answers its glue. */
function pack(name, module, extra) {
  const { features, cargo } = WASM[name];
  const folder = join(root, 'dist', name);
  // The npm package has one package.json, readme and licence of its own: none from wasm-pack.
  const output = [
    '--out-dir',
    `dist/${name}`,
    '--out-name',
    'bilinormal',
    '--no-pack',
    '--no-gitignore',
    '--no-typescript',
  ];
  const chosen = ['--no-default-features', '--features', [...features, ...extra].join(), ...cargo];
  run('wasm-pack', ['build', '.', '--mode', 'no-install', '--target', 'web', '--release', ...output, '--', ...chosen]);
  rmSync(join(folder, 'snippets'), { recursive: true, force: true });
  renameSync(join(folder, 'bilinormal_bg.wasm'), join(folder, `${module}.wasm`));
  return readFileSync(join(folder, 'bilinormal.js'), 'utf8');
}

/**
 * Lets the threads build start its pool by what the worker puts into `pool` (`src/js/pool.ts`) instead of the helper of
 * wasm-bindgen-rayon, which imports a folder (only bundlers resolve that), knows no Node, and waits for ever when a worker
 * fails to load. Not by an import: bundlers would look for it in the script of the worker, and WebKit runs a worker's script
 * once more when something imports it.
 */
function withOwnPool(glue) {
  const helper = /import \{ startWorkers \} from '\.\/snippets\/wasm-bindgen-rayon-[^']*\/workerHelpers\.js';/;
  if (!helper.test(glue)) throw new Failure('the glue of the threads build has no import of startWorkers');
  return glue.replace(helper, 'export const pool = {};\nconst startWorkers = (...all) => pool.start(...all);');
}

/** The scripts that are imported or started by their own address; every other module goes into those that use it. */
const SCRIPTS = ['index', 'node', 'link', 'worker', 'worker-node', 'thread', 'thread-node', 'three', 'cli'];

function buildJavaScript() {
  // What an older source left behind must not enter the package.
  for (const path of filesIn('dist').filter((path) => dirname(path) === 'dist')) rmSync(join(root, path));
  run('tsc', ['--project', '.']);
  // `new URL('./worker.js', import.meta.url)` and the imports of glue stay as they are, for browsers and bundlers.
  const apart = ['./link.js', './node.js', './single/*', './threads/*'].map((path) => `--external:${path}`);
  const scripts = SCRIPTS.map((name) => `src/js/${name}.ts`);
  const form = ['--format=esm', '--target=es2022', '--log-level=warning'];
  run('esbuild', [...scripts, '--bundle', '--packages=external', ...apart, ...form, '--outdir=dist']);
  minify(SCRIPTS.map((name) => `dist/${name}.js`));
}

const minify = (paths) => run(process.execPath, ['scripts/minify.mjs', ...paths]);

/** What a browser downloads, gzipped. */
export function sizes() {
  const wasm = Object.entries(WASM).flatMap(([name, { limit }]) => [
    [`${name} wasm`, [`dist/${name}/core.wasm`], limit],
    [`${name} wasm with what few pages need`, [`dist/${name}/full.wasm`], Infinity],
  ]);
  return [...wasm, ['JavaScript', downloadedJavaScript(), JAVASCRIPT_LIMIT]].map(([what, files, limit]) => {
    const bytes = files.map((file) => gzipSync(readFileSync(join(root, file)), { level: 9 }).length);
    const kibibytes = bytes.reduce((sum, size) => sum + size, 0) / 1024;
    const fits = kibibytes <= limit;
    const verdict = !fits ? `, more than the ${limit} allowed` : limit < Infinity ? ` of ${limit} allowed` : '';
    return { fits, text: `${what} ${kibibytes.toFixed(1)} KiB gzipped${verdict} (${files.join(', ')})` };
  });
}

/** What a browser loads: all that index.js leads to, with the larger one of the two builds' glue. */
function downloadedJavaScript() {
  const found = new Set(['dist/index.js']);
  for (const file of found) {
    const text = readFileSync(join(root, file), 'utf8');
    for (const [, path] of text.matchAll(/(?:\bfrom|\bimport|\bimport\(|\bnew URL\()\s*["'`](\.[^"'`]*\.js)["'`]/g)) {
      found.add(join(dirname(file), path));
    }
  }
  const size = (file) => readFileSync(join(root, file)).length;
  const glues = Object.keys(WASM).map((name) => join('dist', name, 'bilinormal.js'));
  const smaller = glues.sort((a, b) => size(a) - size(b))[0];
  return [...found].filter((file) => file !== smaller);
}

/** The files below a folder whose names end as asked, relative to the root, in a fixed order. */
function filesIn(folder, ending = '') {
  const entries = readdirSync(join(root, folder), { recursive: true, withFileTypes: true });
  const files = entries.filter((entry) => entry.isFile() && entry.name.endsWith(ending));
  return files.map((entry) => relative(root, join(entry.parentPath ?? entry.path, entry.name))).sort();
}

if (started(import.meta)) {
  await main(() => {
    setup();
    build();
  });
}
