// What the scripts share: where things are, what is told, and how a tool is called.
//
// Everything that is told goes to standard error: standard output belongs to results.

import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, readFileSync, realpathSync } from 'node:fs';
import { delimiter, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

export const root = fileURLToPath(new URL('..', import.meta.url));
export const tools = join(root, '.tools');

/** The path that a user means: npm changes into the project's folder, and names are meant from where the user stands. */
export const fromUser = (path) => path && resolve(process.env.INIT_CWD ?? '.', path);

export const read = (path) => readFileSync(join(root, path), 'utf8');

const toolchainFile = read('rust-toolchain.toml');
const list = (name) =>
  [...(toolchainFile.match(new RegExp(`^${name} = \\[(.*)\\]`, 'm'))?.[1] ?? '').matchAll(/"(.*?)"/g)].map((m) => m[1]);

/** What rust-toolchain.toml asks for. */
export const toolchain = {
  channel: toolchainFile.match(/^channel = "(.*)"/m)[1],
  components: list('components'),
  targets: list('targets'),
};

/** The environment of every tool: the project's own tools first, and nothing that would change what is built. */
export const environment = {
  ...process.env,
  PATH: [join(tools, 'bin'), join(root, 'node_modules', '.bin'), process.env.PATH].join(delimiter),
  RUSTUP_TOOLCHAIN: toolchain.channel,
};
// These would override the flags of scripts/*.toml, or build for another target.
for (const name of ['RUSTFLAGS', 'CARGO_ENCODED_RUSTFLAGS', 'CARGO_BUILD_RUSTFLAGS', 'CARGO_BUILD_TARGET']) {
  delete environment[name];
}

/** An error whose message says all there is to say. */
export class Failure extends Error {}

export const tell = (text) => process.stderr.write(`${text}\n`);

/** Runs a command to its end and shows what it says. Throws a `Failure` if it fails or takes more than `minutes`. */
export function run(command, args, { env = {}, quiet = false, minutes } = {}) {
  const { error, status, signal, stdout, stderr } = spawnSync(command, args, {
    cwd: root,
    env: { ...environment, ...env },
    stdio: quiet ? ['ignore', 'pipe', 'pipe'] : ['ignore', process.stderr.fd, process.stderr.fd],
    maxBuffer: 1 << 28,
    timeout: minutes && minutes * 60_000,
  });
  if (!error && status === 0) return;
  if (quiet) process.stderr.write(Buffer.concat([stdout ?? Buffer.alloc(0), stderr ?? Buffer.alloc(0)]));
  throw new Failure(`${[command, ...args].join(' ')}: ${error?.message ?? signal ?? `ended with ${status}`}`);
}

/** What a command prints, or `undefined` if it is missing or fails. */
export function output(command, args) {
  try {
    return execFileSync(command, args, {
      cwd: root,
      env: environment,
      encoding: 'utf8',
      stdio: ['ignore', 'pipe', 'ignore'],
    });
  } catch {
    return undefined;
  }
}

/** Runs every check, also after one has failed, sums up, and throws if any failed. */
export function checkAll(checks) {
  const results = Object.entries(checks).map(([name, check]) => {
    tell(`\n${name}`);
    const start = performance.now();
    let verdict = 'passed';
    try {
      check();
    } catch (error) {
      if (!(error instanceof Failure)) throw error;
      tell(error.message);
      verdict = 'FAILED';
    }
    return { verdict, text: `${verdict}  ${name}, ${((performance.now() - start) / 1000).toFixed(0)} s` };
  });
  tell(['', ...results.map(({ text }) => text)].join('\n'));
  if (results.some(({ verdict }) => verdict === 'FAILED')) throw new Failure('not every check passed');
}

/** Runs the main function of a script: a `Failure` is told in one line, anything else is a bug and keeps its trace. */
export async function main(job) {
  try {
    await job();
  } catch (error) {
    tell(error instanceof Failure ? `\nfailed: ${error.message}` : error.stack);
    process.exitCode = 1;
  }
}

/** Whether this module is the one that was started, be it through a link. */
export const started = (meta) =>
  existsSync(process.argv[1] ?? '') && realpathSync(process.argv[1]) === realpathSync(fileURLToPath(meta.url));
