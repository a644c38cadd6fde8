// npm run bench:peers [-- --small] [--out FOLDER]: our times beside those of MeshLib, small_gicp, Open3D and pcl.js on the same
// points in one run, as docs/peers.md. They are installed into .tools, the first three by a Python there. With --small it takes
// a minute, and says little.

import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { availableParallelism, tmpdir } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { fromUser, main, root, tell } from '../scripts/run.mjs';
import { setupPython } from '../scripts/python.mjs';
import { setup } from '../scripts/setup.mjs';
import { sorted, sphere } from './clouds.mjs';
import { machine } from './machine.mjs';
import { median } from './median.mjs';
import { paragraphs, table, verdict } from './format.mjs';
import { setupNpm } from './peers/npm.mjs';
import { linesOf } from './peers/run.mjs';

const PCL = 'pcl.js@1.16.0';
/** What is measured of ours, and the name of the peer and how often our time it is asked to take, by order of the points. */
const OURS = {
  '0.5 L': {
    options: { cell: { scale: 0.5 } },
    asked: { random: { MeshLib: 20 }, sorted: { MeshLib: 15, small_gicp: 15 } },
  },
  '1.5 L': { options: { cell: { scale: 1.5 } }, asked: { random: { MeshLib: 60 }, sorted: {} } },
  auto: { options: {}, asked: { random: { MeshLib: 10 }, sorted: { MeshLib: 10 } } },
  'auto, consistent': {
    options: { orient: 'consistent' },
    asked: { random: { 'MeshLib, oriented': 6 }, sorted: { 'MeshLib, oriented': 6 } },
  },
};
const RUNS = 5;

const times = (ratio) => ratio.toFixed(ratio < 9.95 ? 1 : 0);

/** The seconds of each run of ours, what the caller waits for: by name. */
async function measureOurs(createEstimator, positions, threads) {
  const estimator = await createEstimator({ threads });
  const seconds = {};
  for (const [name, { options }] of Object.entries(OURS)) {
    seconds[name] = [];
    for (let run = 0; run <= RUNS; run++) {
      const { report } = await estimator.estimateNormals(positions, options);
      // The engine compiles what is hot once more, better.
      if (run > 0) seconds[name].push(report.milliseconds.total / 1_000);
    }
  }
  estimator.dispose();
  return seconds;
}

/** The seconds of each run of theirs: by name; none of those that fail. */
function measureTheirs(python, pcl, file, threads) {
  const found = [
    ...linesOf(python, 'normals.py', [file, `${threads}`]),
    ...(threads === 1 ? linesOf(process.execPath, 'pcl.cjs', [pcl, file]) : []),
  ];
  return Object.fromEntries(found.map(({ method, seconds = [] }) => [method, seconds]));
}

/** Every ratio that is asked for: `{ cloud, threads, ours, peer, ratio, asked }`. */
const verdicts = (rows) =>
  rows.flatMap(({ size, order, threads, ours, theirs }) =>
    Object.entries(OURS).flatMap(([name, { asked }]) =>
      Object.entries(asked[order]).map(([peer, least]) => ({
        cloud: `${size / 1e6} M, ${order}`,
        threads,
        ours: name,
        peer,
        ratio: median(theirs[peer]) / median(ours[name]),
        asked: least,
      })),
    ),
  );

function report(rows) {
  const { model, cores, node, date } = machine();
  const methods = [...new Set(rows.flatMap(({ theirs }) => Object.keys(theirs)))];
  const cell = (seconds) => (seconds?.length ? median(seconds).toFixed(3) : '');
  return `${paragraphs(
    '# Beside others, measured',
    'Written by `npm run bench:peers`, text and all; not to be edited.',
    `${model}, ${cores} cores, Node ${node}, ${date}. Points evenly spread over a sphere, in random order and sorted (Morton), so that neighbours in space are neighbours in memory. Seconds, medians of up to five runs. Ours are WebAssembly in Node, all that the caller waits for; theirs are native, but for pcl.js, and without the copies in and out. They look at 30 points, which is the accuracy of 0.5 L; benches/peers/ has how they are called.`,
    '## What is asked',
    table(
      ['cloud', 'threads', 'ours', 'peer', 'their time over ours', 'asked', 'verdict'],
      verdicts(rows).map(({ cloud, threads, ours, peer, ratio, asked }) => [
        cloud,
        threads,
        ours,
        peer,
        times(ratio),
        asked,
        verdict(ratio >= asked),
      ]),
    ),
    '## Seconds',
    table(
      ['cloud', 'threads', ...Object.keys(OURS), ...methods],
      rows.map(({ size, order, threads, ours, theirs }) => [
        `${size / 1e6} M, ${order}`,
        threads,
        ...Object.keys(OURS).map((name) => cell(ours[name])),
        ...methods.map((method) => cell(theirs[method])),
      ]),
    ),
  )}\n`;
}

await main(async () => {
  const { values } = parseArgs({ options: { small: { type: 'boolean' }, out: { type: 'string' } } });
  setup();
  build();
  const [python, pcl] = [setupPython(), setupNpm('pcl', [PCL])];
  const { createEstimator } = await import('../dist/node.js');
  const folder = mkdtempSync(join(tmpdir(), 'bilinormal-'));
  const rows = [];
  try {
    for (const size of values.small ? [50_000] : [750_000, 3_000_000]) {
      for (const order of ['random', 'sorted']) {
        const positions = order === 'random' ? sphere(size) : sorted(sphere(size));
        const file = join(folder, 'cloud.f32');
        writeFileSync(file, positions);
        for (const threads of [...new Set([1, availableParallelism()])]) {
          tell(`peers: ${size / 1e6} M, ${order}, ${threads} ${threads === 1 ? 'thread' : 'threads'}`);
          const ours = await measureOurs(createEstimator, positions, threads);
          rows.push({ size, order, threads, ours, theirs: measureTheirs(python, pcl, file, threads) });
        }
      }
    }
  } finally {
    rmSync(folder, { recursive: true });
  }
  const out = fromUser(values.out) ?? join(root, 'docs');
  mkdirSync(out, { recursive: true });
  writeFileSync(join(out, 'peers.md'), report(rows));
  tell(`peers: written to ${values.out ?? 'docs'}/peers.md`);
});
