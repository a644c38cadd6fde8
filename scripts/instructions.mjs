// npm run instructions [-- --update]: how many instructions the native single-threaded build takes for small cases, by callgrind,
// against the numbers in benches/instructions.json, which --update writes. Unlike times they are the same on a busy machine.

import { spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { Failure, environment, main, output, read, root, tell } from './run.mjs';
import { setup } from './setup.mjs';

const FILE = 'benches/instructions.json';
/** More than this share more is a failure, and as much less asks for new numbers. */
const TOLERANCE = 0.05;

const BUILD = ['bench', '--bench', 'instructions', '--no-default-features', '--features=full', '--no-run'];

/** The program, from what cargo says of it. */
function build() {
  const args = [...BUILD, '--message-format=json'];
  const { status, stdout, stderr } = spawnSync('cargo', args, { cwd: root, env: environment, encoding: 'utf8' });
  if (status !== 0) throw new Failure(`cargo ${args.join(' ')}: ${stderr}`);
  const lines = stdout.trim().split('\n').map(JSON.parse);
  return lines.find(({ executable, target }) => executable && target.name === 'instructions').executable;
}

/** The instructions of a case that is run so often, making its cloud included. */
function count(program, folder, name, runs) {
  const args = ['--tool=callgrind', `--callgrind-out-file=${join(folder, 'out')}`, program, name, `${runs}`];
  const { status, stderr } = spawnSync('valgrind', args, { env: environment, encoding: 'utf8' });
  const collected = stderr.match(/Collected : (\d+)/);
  if (status !== 0 || !collected) throw new Failure(`valgrind ${args.join(' ')}: ${stderr}`);
  return Number(collected[1]);
}

await main(() => {
  const { values } = parseArgs({ options: { update: { type: 'boolean' } } });
  if (process.arch !== 'x64') throw new Failure(`the numbers are those of x64; this is ${process.arch}`);
  if (output('valgrind', ['--version']) === undefined)
    throw new Failure('no valgrind on the PATH, which has callgrind');
  setup();
  const program = build();
  const known = JSON.parse(read(FILE));
  const folder = mkdtempSync(join(tmpdir(), 'bilinormal-'));
  const found = {};
  try {
    for (const name of Object.keys(known)) {
      found[name] = (count(program, folder, name, 1) - count(program, folder, name, 0)) / 1e6;
      const change = found[name] / known[name] - 1;
      const sign = change < 0 ? '' : '+';
      tell(`instructions: ${name}: ${found[name].toFixed(1)} million (${sign}${(100 * change).toFixed(1)} %)`);
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
  if (values.update) {
    const rounded = Object.entries(found).map(([name, millions]) => [name, Number(millions.toFixed(1))]);
    writeFileSync(join(root, FILE), `${JSON.stringify(Object.fromEntries(rounded), undefined, 2)}\n`);
    return;
  }
  const changed = Object.keys(known).filter((name) => Math.abs(found[name] / known[name] - 1) > TOLERANCE);
  if (changed.length > 0) {
    throw new Failure(
      `${changed.join('; ')}: not within ${100 * TOLERANCE} % of ${FILE}; if that is meant, npm run instructions -- --update`,
    );
  }
});
