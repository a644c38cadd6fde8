// npm run lint: formatting and lints of all languages, in every set of features and for both targets.

import { build } from './build.mjs';
import { checkAll, main, run } from './run.mjs';
import { setup } from './setup.mjs';

const clippy = (...args) => run('cargo', ['clippy', ...args, '--', '-D', 'warnings']);
const wasm = ['--target', 'wasm32-unknown-unknown'];
const checks = {
  'Rust is formatted': () => run('cargo', ['fmt', '--check']),
  // A crate of its own, so that nobody downloads its peers to run the tests.
  'Rust of the peers is formatted': () =>
    run('cargo', ['fmt', '--check', '--manifest-path', 'benches/peers/Cargo.toml']),
  'Rust of the fuzz targets is formatted': () => run('cargo', ['fmt', '--check', '--manifest-path', 'fuzz/Cargo.toml']),
  'clippy, native': () => clippy('--all-targets'),
  'clippy, native without threads': () => clippy('--all-targets', '--no-default-features', '--features', 'full'),
  'clippy, wasm core': () => clippy('--lib', '--no-default-features', ...wasm),
  'clippy, wasm single': () =>
    clippy('--lib', '--test', 'border', '--no-default-features', '--features', 'full', ...wasm),
  'clippy, wasm threads': () =>
    clippy(
      '--lib',
      '--features',
      'threads',
      '--config',
      'scripts/threads.toml',
      '--target-dir',
      'target/threads',
      ...wasm,
    ),
  'pages of the crate': () => run('cargo', ['doc', '--no-deps', '--quiet'], { env: { RUSTDOCFLAGS: '-D warnings' } }),
  'JavaScript, TypeScript and CSS are formatted': () =>
    run('prettier', ['--check', 'src/js', 'www', 'tests/node', 'tests/browser', 'scripts', 'benches', '!www/dist']),
  'types of the package': () => run('tsc', ['--noEmit', '--project', '.']),
  'types of the page': () => run('tsc', ['--noEmit', '--project', 'www']),
};

await main(() => {
  setup();
  // The page's types are those of the built package.
  build();
  checkAll(checks);
});
