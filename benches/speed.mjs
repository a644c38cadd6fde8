// npm run bench [-- --scan FILE.ply] [--runs N]: the table of the README, as Markdown on standard output.
//
// Time for each phase, points per second and bytes per point, of spheres in random and in sorted order and of a real
// scan: native, and as WebAssembly in Node and in Chromium, with one thread and with as many as there are processors.

import { spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { availableParallelism, cpus } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { gunzipSync } from 'node:zlib';
import { build } from '../scripts/build.mjs';
import { Failure, environment, main, root, tell } from '../scripts/run.mjs';
import { serve } from '../scripts/serve.mjs';
import { findBrowser, setup } from '../scripts/setup.mjs';
import { sorted, sphere } from './clouds.mjs';
import { measure } from './measure.mjs';
import { median } from './median.mjs';

const SIZES = [187_500, 750_000, 3_000_000];
const CELLS = ['1.5', 'auto'];
const SCAN = '../shared/data/scans/las_ahn3_cropped.ply.gz';
const THREADS = availableParallelism();
/** Of fixed cells, and of 'auto'. */
const PHASES = ['bounds', 'cellSize', 'sort', 'nodes', 'interpolation', 'surfaces', 'vote', 'detail'];
/** Where the clouds lie for all engines to read; below the root, so that the browser can be served from there. */
const FOLDER = 'target/bench';

async function clouds(scan, readPointCloud) {
  const list = SIZES.flatMap((size) => {
    const random = sphere(size);
    return [
      { name: `sphere ${size / 1e6} M, random`, positions: random },
      { name: `sphere ${size / 1e6} M, sorted`, positions: sorted(random) },
    ];
  });
  const path = join(root, scan ?? SCAN);
  const file = scan && existsSync(scan) ? scan : path;
  if (existsSync(file)) {
    const bytes = readFileSync(file);
    const { count, positions } = await readPointCloud(file.endsWith('.gz') ? gunzipSync(bytes) : bytes);
    list.push({ name: `scan ${(count / 1e6).toFixed(2)} M`, positions });
  } else if (scan) {
    throw new Failure(`no file ${scan}`);
  } else {
    tell('bench: no real scan (give one by --scan FILE.ply)');
  }
  return list;
}

/** The engines: a name, threads, and how one measures the cloud `{ file, positions }`. */
function engines(node, page) {
  const native = (threads) => (cloud, cell, runs) => {
    const args = ['bench', '--quiet', '--bench', 'native', '--', join(root, cloud.file), cell, `${runs}`, `${threads}`];
    const { status, stdout, stderr } = spawnSync('cargo', args, { cwd: root, env: environment, encoding: 'utf8' });
    if (status !== 0) throw new Failure(`cargo bench: ${stderr}`);
    return stdout.trim().split('\n').map(JSON.parse);
  };
  const option = (cell) => (cell === 'auto' ? cell : { scale: Number(cell) });
  const inNode = (threads) => (cloud, cell, runs) =>
    measure(node.createEstimator, { positions: cloud.positions, cell: option(cell), runs, threads });
  const inPage = (threads) => (cloud, cell, runs) =>
    page.evaluate(
      async ({ file, ...job }) => {
        const [{ createEstimator }, { measure }, response] = await Promise.all([
          import('/dist/index.js'),
          import('/benches/measure.mjs'),
          fetch(`/${file}`),
        ]);
        return measure(createEstimator, { ...job, positions: new Float32Array(await response.arrayBuffer()) });
      },
      { file: cloud.file, cell: option(cell), runs, threads },
    );
  const counts = THREADS > 1 ? [1, THREADS] : [1];
  return [['native', native], ['wasm, Node', inNode], ...(page ? [['wasm, Chromium', inPage]] : [])].flatMap(
    ([name, engine]) => counts.map((threads) => ({ name, threads, measure: engine(threads) })),
  );
}

async function openPage() {
  const executablePath = findBrowser();
  if (!executablePath) {
    tell('bench: no Chromium found, so no rows for it');
    return {};
  }
  const { chromium } = await import('playwright-core');
  const server = await serve(root);
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--disable-background-networking'] });
  const page = await browser.newPage();
  await page.goto(`${server.url}benches/page.html`);
  return { page, close: () => Promise.all([browser.close(), server.close()]) };
}

function row(cloud, cell, engine, reports) {
  const time = (phase) => median(reports.map((report) => report.milliseconds[phase]));
  const totals = reports.map((report) => report.milliseconds.total);
  const spread = ((Math.max(...totals) - Math.min(...totals)) / time('total')) * 50;
  const { points, peakBytes } = reports[0];
  return [
    cloud.name,
    cell,
    engine.name,
    engine.threads,
    time('total').toFixed(0),
    `±${spread.toFixed(0)} %`,
    ...PHASES.map((phase) => time(phase)?.toFixed(1) ?? ''),
    (points / time('total') / 1e3).toFixed(1),
    (peakBytes / points).toFixed(0),
  ];
}

await main(async () => {
  const { values } = parseArgs({ options: { scan: { type: 'string' }, runs: { type: 'string', default: '5' } } });
  const runs = Number(values.runs);
  if (!(Number.isInteger(runs) && runs > 0))
    throw new Failure(`--runs is ${values.runs}; wanted a whole number above 0`);
  setup();
  build();
  const node = await import('../dist/node.js');
  const { page, close } = await openPage();
  mkdirSync(join(root, FOLDER), { recursive: true });
  try {
    console.log(
      `${cpus()[0].model.trim()}, ${THREADS} threads, Node ${process.versions.node}; medians of ${runs} runs\n`,
    );
    const head = ['cloud', 'cell', 'engine', 'threads', 'total ms', 'spread', ...PHASES, 'M points/s', 'bytes/point'];
    console.log(`| ${head.join(' | ')} |\n|${head.map(() => ' --- |').join('')}`);
    for (const [i, cloud] of (await clouds(values.scan, node.readPointCloud)).entries()) {
      cloud.file = `${FOLDER}/${i}.f32`;
      writeFileSync(join(root, cloud.file), cloud.positions);
      for (const cell of CELLS) {
        for (const engine of engines(node, page)) {
          console.log(`| ${row(cloud, cell, engine, await engine.measure(cloud, cell, runs)).join(' | ')} |`);
        }
      }
    }
  } finally {
    rmSync(join(root, FOLDER), { recursive: true, force: true });
    await close?.();
  }
});
