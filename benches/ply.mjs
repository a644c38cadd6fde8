// npm run bench:ply [-- --small] [--out FOLDER]: how long reading takes, beside three.js's PLYLoader, loaders.gl, and a bare copy
// of the file, as docs/reading.md. With --small it takes seconds, and says little.

import { mkdirSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { build } from '../scripts/build.mjs';
import { Failure, fromUser, main, root, tell } from '../scripts/run.mjs';
import { setup } from '../scripts/setup.mjs';
import { sphere } from './clouds.mjs';
import { machine } from './machine.mjs';
import { median } from './median.mjs';
import { milliseconds, paragraphs, table, verdict } from './format.mjs';
import { setupNpm } from './peers/npm.mjs';
import { asciiPly, binaryPly } from './speed/ply.mjs';

const LOADERS = ['@loaders.gl/core@4.4.5', '@loaders.gl/ply@4.4.5'];
const RUNS = 7;
const THREADS = [...new Set([1, availableParallelism()])];
/** How often our time each takes at least, or at most. */
const ASKED = {
  binary: { "three.js's PLYLoader": { least: 40 }, copy: { most: 3 }, 'copy into new memory': { most: 3 } },
  ASCII: { "three.js's PLYLoader": { least: 10 } },
};

/** The milliseconds of each of some runs after one that is not counted, and the points that came of the last. */
async function timed(read, runs = RUNS) {
  const times = [];
  let points;
  for (let run = 0; run <= runs; run++) {
    const start = performance.now();
    points = await read();
    if (run > 0) times.push(performance.now() - start);
  }
  return { times, points };
}

/** All readers, each from an ArrayBuffer to what its users get: by name. */
async function readers(createEstimator, PLYLoader) {
  const require = createRequire(join(setupNpm('loaders.gl', LOADERS), 'package.json'));
  const [core, ply] = ['core', 'ply'].map((name) => require(`@loaders.gl/${name}`));
  const three = new PLYLoader();
  let used;
  const ours = await Promise.all(THREADS.map((threads) => createEstimator({ threads })));
  return {
    close: () => ours.forEach((estimator) => estimator.dispose()),
    list: {
      copy: {
        read: (file) => {
          if (used?.byteLength !== file.byteLength) used = new Uint8Array(file.byteLength);
          used.set(new Uint8Array(file));
        },
      },
      'copy into new memory': { read: (file) => void file.slice(0) },
      ...Object.fromEntries(
        ours.map((estimator, i) => [
          `bilinormal, ${THREADS[i]} ${THREADS[i] === 1 ? 'thread' : 'threads'}`,
          { read: async (file) => (await estimator.readPointCloud(file)).count },
        ]),
      ),
      "three.js's PLYLoader": { runs: 3, read: (file) => three.parse(file).attributes.position.count },
      'loaders.gl': {
        runs: 3,
        read: (file) => core.parseSync(file, ply.PLYLoader, { worker: false }).attributes.POSITION.value.length / 3,
      },
    },
  };
}

/** Every ratio that is asked for. */
const verdicts = (rows) =>
  rows.flatMap(({ kind, found }) =>
    Object.entries(ASKED[kind]).flatMap(([other, { least, most }]) =>
      Object.entries(found)
        .filter(([name]) => name.startsWith('bilinormal'))
        .map(([name, ours]) => {
          const [a, b] = [median(found[other]), median(ours)];
          const ratio = least ? a / b : b / a;
          const asked = least ? `their time over ours at least ${least}` : `our time over it at most ${most}`;
          return [kind, name, other, asked, ratio.toFixed(1), verdict(least ? ratio >= least : ratio <= most)];
        }),
    ),
  );

function report(rows, points, revision) {
  const { model, cores, node, date } = machine();
  const names = Object.keys(rows[0].found);
  const spread = (times) => `${milliseconds(Math.min(...times))} to ${milliseconds(Math.max(...times))}`;
  return `${paragraphs(
    '# Reading, measured',
    'Written by `npm run bench:ply`, text and all; not to be edited.',
    `${model}, ${cores} cores, Node ${node}, ${date}. Files of ${points / 1e6} million points with colours, in memory as an ArrayBuffer. Ours is all that the caller waits for: the copy of the file that the worker gets, reading it there, and the arrays on their way back. The others read in the calling thread. “Copy” is one into an array that is in use, “into new memory” \`ArrayBuffer.slice\`, as all readers make arrays. ${LOADERS.join(', ')}, three.js r${revision}.`,
    '## What is asked',
    table(['file', 'reader', 'against', 'asked', 'ratio', 'verdict'], verdicts(rows)),
    '## Milliseconds, medians, and from the least to the most',
    table(
      ['file', 'MB', ...names],
      rows.map(({ kind, bytes, found }) => [
        kind,
        (bytes / 1e6).toFixed(0),
        ...names.map((name) => `${milliseconds(median(found[name]))} (${spread(found[name])})`),
      ]),
    ),
  )}\n`;
}

await main(async () => {
  const { values } = parseArgs({ options: { small: { type: 'boolean' }, out: { type: 'string' } } });
  setup();
  build();
  const { createEstimator } = await import('../dist/node.js');
  // Not before the set-up, which installs it.
  const { REVISION } = await import('three');
  const { PLYLoader } = await import('three/addons/loaders/PLYLoader.js');
  const points = values.small ? 50_000 : 2_000_000;
  const positions = sphere(points);
  const { list, close } = await readers(createEstimator, PLYLoader);
  const rows = [];
  try {
    for (const [kind, file] of [
      ['binary', binaryPly(positions).buffer],
      ['ASCII', asciiPly(positions).buffer],
    ]) {
      const found = {};
      for (const [name, { read, runs }] of Object.entries(list)) {
        tell(`ply: ${kind}, ${name}`);
        const { times, points: count } = await timed(() => read(file), runs);
        if (count !== undefined && count !== points) throw new Failure(`${name} read ${count} points of ${points}`);
        found[name] = times;
      }
      rows.push({ kind, bytes: file.byteLength, found });
    }
  } finally {
    close();
  }
  const out = fromUser(values.out) ?? join(root, 'docs');
  mkdirSync(out, { recursive: true });
  writeFileSync(join(out, 'reading.md'), report(rows, points, REVISION));
  tell(`ply: written to ${values.out ?? 'docs'}/reading.md`);
});
