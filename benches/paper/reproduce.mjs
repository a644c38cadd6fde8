// Measures, takes the pictures, writes the report.

import { mkdirSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { machine } from '../machine.mjs';
import { measureAll } from './experiments.mjs';
import { takePictures } from './pictures.mjs';
import { charts, report } from './report.mjs';
import { readScans } from './scans.mjs';

/**
 * Writes `paper.md` and the folder `paper` with its pictures into the folder `out`, and answers the rows. `scans` is a
 * folder, or nothing; `createEstimator` the package's.
 */
export async function reproduce({ createEstimator, plan, scans: scansFolder, out, withPictures, tell }) {
  const start = performance.now();
  const folder = join(out, 'paper');
  mkdirSync(folder, { recursive: true });
  for (const name of readdirSync(folder)) if (/\.(jpg|svg)$/.test(name)) rmSync(join(folder, name));

  const estimator = await createEstimator({ threads: 1 });
  try {
    const { scans, skipped } = await readScans(scansFolder, {
      readPointCloud: estimator.readPointCloud.bind(estimator),
      least: plan.leastScan,
    });
    const rows = await measureAll(estimator, { plan, scans, tell });
    const pictures = withPictures ? await takePictures(estimator, { plan, scans, folder, tell }) : undefined;
    for (const [name, svg] of Object.entries(charts(rows))) writeFileSync(join(folder, `${name}.svg`), svg);
    const facts = {
      machine: machine(),
      minutes: (performance.now() - start) / 60_000,
      pictures,
      skipped,
      hasFolder: scansFolder !== undefined,
    };
    writeFileSync(join(out, 'paper.md'), report(rows, facts));
    return { rows, pictures, skipped };
  } finally {
    estimator.dispose();
  }
}
