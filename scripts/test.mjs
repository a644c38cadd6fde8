// npm test: sets up, builds, and runs every test.

import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { build, buildPage, sizes } from './build.mjs';
import { Failure, checkAll, main, root, run, tell } from './run.mjs';
import { findBrowser, setup } from './setup.mjs';

/** Node's own runner, on each test file of a folder. */
function nodeTests(folder, options = []) {
  const files = readdirSync(join(root, folder)).filter((name) => /\.test\.(js|mjs)$/.test(name));
  run(process.execPath, ['--test', ...options, ...files.sort().map((name) => join(folder, name))], {
    env: { CHROME: findBrowser() },
    // Only a test that hangs comes near it: on a loaded machine those of the page took 15.
    minutes: 40,
  });
}

const border = ['--no-default-features', '--features', 'full', '--test', 'border'];
const tests = {
  'sizes of the downloads': () => {
    sizes().forEach(({ text }) => tell(text));
    if (!sizes().every(({ fits }) => fits)) throw new Failure('the npm package is larger than it may be');
  },
  'crate, native (cargo test)': () => run('cargo', ['test']),
  'border, wasm in Node (wasm-pack test)': () =>
    run('wasm-pack', ['test', '--node', '--mode', 'no-install', '--', ...border]),
  'npm package and command line, in Node': () => nodeTests('tests/node'),
  // One after the other: each drives a browser, and some look at the time.
  'page, in a browser': () => nodeTests('tests/browser', ['--test-concurrency=1']),
};

await main(() => {
  setup({ browser: true });
  build();
  buildPage();
  checkAll(tests);
});
