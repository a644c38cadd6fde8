// npm test: sets up, builds, and runs every test.

import { readdirSync } from 'node:fs';
import { join } from 'node:path';
import { build, buildPage } from './build.mjs';
import { Failure, main, root, run, tell } from './run.mjs';
import { findBrowser, setup } from './setup.mjs';

/** Node's own runner, on each test file of a folder. */
function nodeTests(folder, options = []) {
  const files = readdirSync(join(root, folder)).filter((name) => /\.test\.(js|mjs)$/.test(name));
  run(process.execPath, ['--test', ...options, ...files.sort().map((name) => join(folder, name))], {
    env: { CHROME: findBrowser() },
  });
}

const border = ['--no-default-features', '--test', 'border'];
const tests = {
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
  const results = Object.entries(tests).map(([name, test]) => {
    tell(`\ntest: ${name}`);
    const start = performance.now();
    let failure;
    try {
      test();
    } catch (error) {
      if (!(error instanceof Failure)) throw error;
      failure = error;
    }
    return { name, failure, seconds: (performance.now() - start) / 1000 };
  });
  tell('');
  for (const { name, failure, seconds } of results) {
    tell(`${failure ? 'FAILED' : 'passed'}  ${name}, ${seconds.toFixed(0)} s`);
  }
  if (results.some(({ failure }) => failure)) throw new Failure('not all tests passed');
});
