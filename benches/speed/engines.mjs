// What runs the estimator: native code, and WebAssembly in Node and in Chromium.

import { spawnSync } from 'node:child_process';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { Failure, environment, root, tell } from '../../scripts/run.mjs';
import { serve } from '../../scripts/serve.mjs';
import { findBrowser } from '../../scripts/setup.mjs';
import { measure, measureCopy } from './measure.mjs';

export const THREADS = availableParallelism();

const optionsOf = (cell) => ({ cell: cell === 'auto' ? cell : { scale: Number(cell) } });

/**
 * The engines: a name, threads, and how one measures the cloud `{ file, positions }`: the reports of some runs, and, if it
 * can, the milliseconds of the bare copy.
 */
export function enginesOf(createEstimator, page) {
  const native = (threads) => ({
    measure(cloud, cell, runs) {
      const args = [
        'bench',
        '--quiet',
        '--bench',
        'native',
        '--',
        join(root, cloud.file),
        cell,
        `${runs}`,
        `${threads}`,
      ];
      const { status, stdout, stderr } = spawnSync('cargo', args, { cwd: root, env: environment, encoding: 'utf8' });
      if (status !== 0) throw new Failure(`cargo bench: ${stderr}`);
      return stdout.trim().split('\n').map(JSON.parse);
    },
  });
  const inNode = (threads) => ({
    measure: ({ positions }, cell, runs) =>
      measure(createEstimator, { positions, options: optionsOf(cell), runs, threads }),
    copy: ({ positions }, runs) => measureCopy(positions, runs),
  });
  const inPage = (threads) => ({
    measure: ({ file }, cell, runs) => page.evaluate(measureThere, { file, options: optionsOf(cell), runs, threads }),
    copy: ({ file }, runs) => page.evaluate(copyThere, { file, runs }),
  });
  const kinds = [['native', native], ['wasm, Node', inNode], ...(page ? [['wasm, Chromium', inPage]] : [])];
  const counts = [...new Set([1, THREADS])];
  return kinds.flatMap(([name, engine]) => counts.map((threads) => ({ name, threads, ...engine(threads) })));
}

/** In the page. */
export async function measureThere({ file, ...job }) {
  const [{ createEstimator }, { measure }, response] = await Promise.all([
    import('/dist/index.js'),
    import('/benches/speed/measure.mjs'),
    fetch(`/${file}`),
  ]);
  return measure(createEstimator, { ...job, positions: new Float32Array(await response.arrayBuffer()) });
}

async function copyThere({ file, runs }) {
  const [{ measureCopy }, response] = await Promise.all([import('/benches/speed/measure.mjs'), fetch(`/${file}`)]);
  return measureCopy(new Float32Array(await response.arrayBuffer()), runs);
}

/** Chromium with a page that sees this folder; nothing without a Chromium. */
export async function openBrowser() {
  const executablePath = findBrowser();
  if (!executablePath) {
    tell('bench: no Chromium found, so no rows for it');
    return undefined;
  }
  const { chromium } = await import('playwright-core');
  const server = await serve(root);
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--disable-background-networking'] });
  const page = await browser.newPage();
  await page.goto(`${server.url}benches/speed/page.html`);
  return { browser, page, close: () => Promise.all([browser.close(), server.close()]) };
}
