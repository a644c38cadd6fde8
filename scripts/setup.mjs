// Installs what the project needs and the machine lacks: Rust toolchain, wasm tools, npm packages, a browser.
// A step whose work is done already does nothing. All downloads come from the package registries.

import { accessSync, constants, existsSync, statSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { Failure, environment, main, output, read, root, run, started, tell, toolchain, tools } from './run.mjs';

const WASM_PACK = '0.15.1';

/** Sets up all that building needs, and with `browser` what the browser tests need too. */
export function setup({ browser = false } = {}) {
  node();
  rust();
  wasmBindgen();
  wasmPack();
  packages();
  if (browser) chromium();
}

function node() {
  // What vite asks for; the package itself runs in every Node from 20 on.
  const [major, minor] = process.versions.node.split('.').map(Number);
  if (major < 20 || major === 21 || (major === 20 && minor < 19) || (major === 22 && minor < 12)) {
    throw new Failure(`this is Node ${process.versions.node}; wanted 20.19, 22.12 or later, from https://nodejs.org`);
  }
}

function rust() {
  if (output('rustup', ['--version']) === undefined) {
    throw new Failure('rustup is not on the PATH; wanted rustup and cargo, from https://rustup.rs');
  }
  const { channel, components, targets } = toolchain;
  const wanted = [...components, ...targets.map((target) => `rust-std-${target}`)];
  const installed = output('rustup', ['component', 'list', '--installed', '--toolchain', channel])?.split('\n') ?? [];
  const has = (name) => installed.some((line) => line === name || line.startsWith(`${name}-`));
  if (!wanted.every(has)) {
    tell(`set-up: Rust ${channel} with ${wanted.join(', ')}: one compiler for the native and both wasm builds`);
    const add = [`--component=${components}`, `--target=${targets}`];
    run('rustup', ['toolchain', 'install', channel, '--profile=minimal', '--no-self-update', ...add]);
  }
  if (output('cargo', ['--version']) === undefined) {
    throw new Failure('cargo is not on the PATH, though rustup is; its folder is usually ~/.cargo/bin');
  }
}

function wasmBindgen() {
  const version = read('Cargo.lock').match(/^name = "wasm-bindgen"\nversion = "(.*)"/m)[1];
  // Its lock file asks for a crate version that the registry does not have: without --locked it builds.
  installTool('wasm-bindgen', 'wasm-bindgen-cli', version, [], 'equal to the version in Cargo.lock');
}

function wasmPack() {
  installTool('wasm-pack', 'wasm-pack', WASM_PACK, ['--locked'], 'builds both packages and runs the border tests');
}

function installTool(command, crate, version, flags, reason) {
  if (output(command, ['--version'])?.trim() === `${command} ${version}`) return;
  tell(`set-up: ${crate} ${version} into .tools: ${reason} (about a minute)`);
  // A release build takes four times as long and gains nothing here.
  const args = ['install', crate, '--version', version, '--root', tools, '--profile', 'dev', '--quiet', ...flags];
  run('cargo', args, { env: { CARGO_PROFILE_DEV_DEBUG: '0' } });
}

function packages() {
  const changed = (path) => statSync(join(root, path), { throwIfNoEntry: false })?.mtimeMs ?? 0;
  if (changed('node_modules/.package-lock.json') >= changed('package-lock.json')) return;
  tell('set-up: npm packages of package-lock.json: TypeScript, Vite, three, wasm-opt and the like');
  run('npm', ['ci', '--no-audit', '--no-fund', '--loglevel=error']);
}

function chromium() {
  if (findBrowser()) return;
  const manual = 'install Chromium or Chrome, or set CHROME to its path';
  const superuser = process.getuid?.() === 0 ? [] : ['sudo', '-n'];
  if (!inPath('apt-get') || (superuser.length && !inPath('sudo'))) {
    throw new Failure(`no browser for the browser tests, and no way to install one here: ${manual}`);
  }
  tell('set-up: Debian package chromium: the browser tests drive a real browser');
  const apt = (...args) => {
    const [command, ...rest] = [...superuser, 'apt-get', '-qq', ...args];
    run(command, rest, { env: { DEBIAN_FRONTEND: 'noninteractive' }, quiet: true });
  };
  apt('update');
  apt('install', '--yes', '--no-install-recommends', 'chromium');
  if (!findBrowser()) throw new Failure(`apt-get installed no browser that can be found: ${manual}`);
}

/** The path of Chromium or Chrome: that of the environment variable CHROME, else the first on the PATH. */
export function findBrowser() {
  const chosen = process.env.CHROME;
  if (chosen) {
    if (!existsSync(chosen))
      throw new Failure(`CHROME is ${chosen}, where there is no file; wanted the path of a browser`);
    return chosen;
  }
  const names = ['chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'];
  const applications = ['/Applications/Google Chrome.app/Contents/MacOS/Google Chrome'];
  return names.map(inPath).find(Boolean) ?? applications.find(existsSync);
}

function inPath(name) {
  const places = environment.PATH.split(delimiter).map((folder) => join(folder, name));
  return places.find((place) => {
    try {
      accessSync(place, constants.X_OK);
      return true;
    } catch {
      return false;
    }
  });
}

if (started(import.meta)) await main(() => setup({ browser: process.argv.includes('--browser') }));
