// npm run orientation [-- --meshes FOLDER] [--out FOLDER] [--rows NAME,...] [--peers]: how many signs are right on shapes whose
// sides are known, on points sampled on the meshes of a folder, and on its range scans, as docs/orientation-bench.md. With
// --rows only those of these names, variants or both ("cube", "clean", "cube-clean"): printed, and not written. With --peers
// Open3D, MeshLib, CGAL and VTK choose signs too, of the same clouds in the same run, in a Python in .tools: an hour.

import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { Failure, fromUser, main, root, tell } from '../scripts/run.mjs';
import { setupPython } from '../scripts/python.mjs';
import { setup } from '../scripts/setup.mjs';
import { chosenRows } from './accuracy/measure.mjs';
import { readMeshes } from './accuracy/meshes.mjs';
import { machine } from './machine.mjs';
import { FULL, measureAll, plannedRows, withOutside } from './orientation/measure.mjs';
import { peersOf } from './orientation/peers.mjs';
import { beside, details, report, withoutSides } from './orientation/report.mjs';
import { readScans } from './orientation/scans.mjs';

const OPTIONS = {
  meshes: { type: 'string' },
  out: { type: 'string' },
  rows: { type: 'string' },
  peers: { type: 'boolean' },
};

await main(async () => {
  const { values } = parseArgs({ options: OPTIONS });
  const folder = fromUser(values.meshes);
  if (folder && !existsSync(folder)) throw new Failure(`no folder ${values.meshes}`);
  setup();
  const python = values.peers && setupPython();
  build();
  const { createEstimator } = await import('../dist/node.js');
  const start = performance.now();
  const estimator = await createEstimator({ threads: 1 });
  try {
    const read = readMeshes(folder);
    const { meshes, skipped, notes } = withOutside(read.meshes);
    const scans = await readScans(folder, (bytes) => estimator.readPointCloud(bytes));
    const planned = plannedRows(FULL, meshes, scans);
    const chosen = values.rows === undefined ? planned : chosenRows(planned, values.rows.split(','));
    const peers = python && ((row, cloud) => peersOf(python, row, cloud, estimator));
    const rows = await measureAll(estimator, chosen, { tell: (what) => tell(`orientation: ${what}`), peers });
    if (values.rows !== undefined) {
      console.log([details(rows), withoutSides(rows), beside(rows)].filter(Boolean).join('\n\n'));
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
    };
    writeFileSync(join(out, 'orientation-bench.md'), report(rows, facts));
    tell(`orientation: written to ${values.out ?? 'docs'}/orientation-bench.md`);
  } finally {
    estimator.dispose();
  }
});
