// npm run paper [-- --scans FOLDER] [--small] [--no-pictures] [--out FOLDER]: the experiments of the paper, as
// docs/paper.md with its charts and pictures. With --small it takes seconds, and says little.

import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { Failure, fromUser, main, root, tell } from '../scripts/run.mjs';
import { setup } from '../scripts/setup.mjs';
import { FULL, SMALL } from './paper/experiments.mjs';
import { reproduce } from './paper/reproduce.mjs';

const OPTIONS = {
  scans: { type: 'string' },
  out: { type: 'string' },
  small: { type: 'boolean', default: false },
  'no-pictures': { type: 'boolean', default: false },
};

await main(async () => {
  const { values } = parseArgs({ options: OPTIONS });
  const scans = fromUser(values.scans);
  if (scans && !existsSync(scans)) throw new Failure(`no folder ${values.scans}`);
  setup();
  build();
  const { createEstimator } = await import('../dist/node.js');
  const out = fromUser(values.out) ?? join(root, 'docs');
  const withPictures = !values['no-pictures'];
  await reproduce({
    createEstimator,
    plan: values.small ? SMALL : FULL,
    scans,
    out,
    withPictures,
    tell: (what) => tell(`paper: ${what}`),
  });
  tell(`paper: written to ${values.out ?? 'docs'}/paper.md`);
});
