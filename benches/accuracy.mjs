// npm run accuracy [-- --meshes FOLDER] [--out FOLDER] [--rows NAME,...]: errors of normals on shapes whose normals are
// known, and on points sampled on the meshes of a folder, as docs/accuracy.md. With --rows only those of these shapes,
// variants or both ("cube", "noise0.6", "cube-clean"): printed, and not written.

import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { Failure, fromUser, main, root, tell } from '../scripts/run.mjs';
import { setup } from '../scripts/setup.mjs';
import { FULL, chosenRows, measureAll, plannedRows } from './accuracy/measure.mjs';
import { readMeshes } from './accuracy/meshes.mjs';
import { details, report } from './accuracy/report.mjs';
import { machine } from './machine.mjs';

const OPTIONS = { meshes: { type: 'string' }, out: { type: 'string' }, rows: { type: 'string' } };

await main(async () => {
  const { values } = parseArgs({ options: OPTIONS });
  const folder = fromUser(values.meshes);
  if (folder && !existsSync(folder)) throw new Failure(`no folder ${values.meshes}`);
  setup();
  build();
  const { createEstimator } = await import('../dist/node.js');
  const start = performance.now();
  const { meshes, skipped } = readMeshes(folder);
  const planned = plannedRows(FULL, meshes);
  const chosen = values.rows === undefined ? planned : chosenRows(planned, values.rows.split(','));
  const threads = availableParallelism();
  const estimator = await createEstimator({ threads });
  try {
    const rows = await measureAll(estimator, chosen, {
      sampled: FULL.sampled,
      tell: (what) => tell(`accuracy: ${what}`),
    });
    if (values.rows !== undefined) {
      const whole = rows.map((row) => ({ ...row, name: `${row.name}-${row.variant}` }));
      console.log(details(whole).join('\n\n'));
      return;
    }
    const out = fromUser(values.out) ?? join(root, 'docs');
    mkdirSync(out, { recursive: true });
    const minutes = (performance.now() - start) / 60_000;
    const facts = { machine: machine(), threads, minutes, sampled: FULL.sampled, hasFolder: !!folder, skipped };
    writeFileSync(join(out, 'accuracy.md'), report(rows, facts));
    tell(`accuracy: written to ${values.out ?? 'docs'}/accuracy.md`);
  } finally {
    estimator.dispose();
  }
});
