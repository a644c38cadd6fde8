// npm run bench [-- --scan FILE.ply] [--runs N] [--small] [--out FOLDER]: what the estimator takes on this machine, as
// docs/speed.md. With --small it takes a minute, and says little.
//
// Time for each phase, points per second and bytes per point, of spheres in random and in sorted order and of a real
// scan: native, and as WebAssembly in Node and in Chromium, with one thread and with as many as there are processors,
// beside the time of bare copies in and out. Then the page, from a file to normals handed to WebGL.

import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { gunzipSync } from 'node:zlib';
import { build, buildPage } from '../scripts/build.mjs';
import { Failure, fromUser, main, root, tell } from '../scripts/run.mjs';
import { setup } from '../scripts/setup.mjs';
import { sorted, sphere } from './clouds.mjs';
import { measureDrop } from './speed/drop.mjs';
import { enginesOf, openBrowser } from './speed/engines.mjs';
import { report } from './speed/report.mjs';

const SIZES = [187_500, 750_000, 3_000_000, 12_000_000];
const SMALL_SIZES = [50_000, 100_000];
const CELLS = ['0.5', '1.5', 'auto'];
/** Where the clouds lie for all engines to read; below the root, so that the browser can be served from there. */
const FOLDER = 'target/bench';
const OPTIONS = {
  scan: { type: 'string' },
  runs: { type: 'string', default: '5' },
  small: { type: 'boolean' },
  out: { type: 'string' },
};

/** One after the other, because the largest take gigabytes. */
async function* clouds(sizes, scan, readPointCloud) {
  for (const size of sizes) {
    const random = sphere(size);
    yield { shape: 'sphere', size, order: 'random', positions: random };
    yield { shape: 'sphere', size, order: 'sorted', positions: sorted(random) };
  }
  if (scan) {
    const bytes = readFileSync(scan);
    const { count, positions } = await readPointCloud(scan.endsWith('.gz') ? gunzipSync(bytes) : bytes);
    yield { shape: 'scan', size: count, order: 'as it is', positions };
  } else {
    tell('bench: no real scan (give one by --scan FILE.ply)');
  }
}

await main(async () => {
  const { values } = parseArgs({ options: OPTIONS });
  const runs = Number(values.runs);
  if (!(Number.isInteger(runs) && runs > 0))
    throw new Failure(`--runs is ${values.runs}; wanted a whole number above 0`);
  const scan = fromUser(values.scan);
  if (scan && !existsSync(scan)) throw new Failure(`no file ${values.scan}`);
  setup();
  build();
  buildPage();
  const node = await import('../dist/node.js');
  const opened = await openBrowser();
  mkdirSync(join(root, FOLDER), { recursive: true });
  const rows = [];
  let drop;
  try {
    for await (const { positions, ...cloud } of clouds(values.small ? SMALL_SIZES : SIZES, scan, node.readPointCloud)) {
      const file = `${FOLDER}/cloud.f32`;
      writeFileSync(join(root, file), positions);
      const engines = enginesOf(node.createEstimator, opened?.page);
      tell(`bench: ${cloud.shape}, ${cloud.size / 1e6} M, ${cloud.order}`);
      // What the memory allows, told once for Node and once for Chromium.
      const copies = {};
      for (const { name, copy } of engines) copies[name] ??= await copy?.({ file, positions }, runs);
      for (const cell of CELLS) {
        for (const { name, threads, measure } of engines) {
          const reports = await measure({ file, positions }, cell, runs);
          rows.push({ ...cloud, cell, engine: name, threads, reports, copy: copies[name] });
        }
      }
    }
    if (opened) {
      tell('bench: the page');
      drop = await measureDrop(opened, sphere(values.small ? 100_000 : 3_000_000), FOLDER, runs);
    }
  } finally {
    rmSync(join(root, FOLDER), { recursive: true, force: true });
    await opened?.close();
  }
  const out = fromUser(values.out) ?? join(root, 'docs');
  mkdirSync(out, { recursive: true });
  writeFileSync(join(out, 'speed.md'), report(rows, drop, runs));
  tell(`bench: written to ${values.out ?? 'docs'}/speed.md`);
});
