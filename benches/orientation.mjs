// npm run orientation [-- --meshes FOLDER] [--out FOLDER] [--rows NAME,...] [--peers FILE] [--write FOLDER]: how many signs
// are right on shapes whose sides are known, on points sampled on the meshes of a folder, and on its range scans, as
// docs/orientation-bench.md. With --rows only those of these names, variants or both ("cube", "clean", "cube-clean"):
// printed, and not written. With --peers also what benches/peers/orientation.py found; with --write no signs are measured,
// and the clouds with their true normals are written for it.

import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { Failure, main, root, tell } from '../scripts/run.mjs';
import { setup } from '../scripts/setup.mjs';
import { chosenRows } from './accuracy/measure.mjs';
import { readMeshes } from './accuracy/meshes.mjs';
import { machine } from './machine.mjs';
import { FULL, measureAll, plannedRows, withOutside } from './orientation/measure.mjs';
import { details, readPeers, report, rowName, withoutSides } from './orientation/report.mjs';
import { readScans } from './orientation/scans.mjs';

const OPTIONS = {
  meshes: { type: 'string' },
  out: { type: 'string' },
  rows: { type: 'string' },
  peers: { type: 'string' },
  write: { type: 'string' },
};

/** npm changes into the project's folder; names are meant from where the user stands. */
const fromUser = (path) => path && resolve(process.env.INIT_CWD ?? '.', path);

function orFail(job) {
  try {
    return job();
  } catch ({ message }) {
    throw new Failure(message);
  }
}

/** A cloud with its true normals, as a PLY file. */
async function write(folder, row, writePly) {
  const { positions, normals } = row.cloud();
  const source = { format: 'generated', properties: [], comments: [] };
  const cloud = { count: positions.length / 3, positions, origin: [0, 0, 0], source };
  const file = await writePly(cloud, { normals });
  writeFileSync(join(folder, `${rowName(row)}.ply`), new Uint8Array(await file.arrayBuffer()));
}

await main(async () => {
  const { values } = parseArgs({ options: OPTIONS });
  const folder = fromUser(values.meshes);
  if (folder && !existsSync(folder)) throw new Failure(`no folder ${values.meshes}`);
  const peers = values.peers && orFail(() => readPeers(readFileSync(fromUser(values.peers), 'utf8')));
  setup();
  build();
  const { createEstimator } = await import('../dist/node.js');
  const start = performance.now();
  const estimator = await createEstimator({ threads: 1 });
  try {
    const read = readMeshes(folder);
    const { meshes, skipped, notes } = withOutside(read.meshes);
    const scans = await readScans(folder, (bytes) => estimator.readPointCloud(bytes));
    const planned = plannedRows(FULL, meshes, scans);
    const chosen = values.rows === undefined ? planned : orFail(() => chosenRows(planned, values.rows.split(',')));
    if (values.write !== undefined) {
      const out = fromUser(values.write);
      mkdirSync(out, { recursive: true });
      for (const row of chosen) if (row.sides) await write(out, row, (...args) => estimator.writePly(...args));
      tell(`orientation: clouds written to ${values.write}`);
      return;
    }
    const rows = await measureAll(estimator, chosen, { tell: (what) => tell(`orientation: ${what}`) });
    if (values.rows !== undefined) {
      console.log([details(rows), withoutSides(rows)].filter(Boolean).join('\n\n'));
      return;
    }
    const out = fromUser(values.out) ?? join(root, 'docs');
    mkdirSync(out, { recursive: true });
    const others = read.skipped.filter(({ name }) => !scans.some(({ file }) => file === name));
    const facts = {
      machine: machine(),
      minutes: (performance.now() - start) / 60_000,
      hasFolder: !!folder,
      skipped: [...skipped, ...others],
      notes,
      peers,
    };
    writeFileSync(join(out, 'orientation-bench.md'), report(rows, facts));
    tell(`orientation: written to ${values.out ?? 'docs'}/orientation-bench.md`);
  } finally {
    estimator.dispose();
  }
});
