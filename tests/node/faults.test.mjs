// What happens when wasm, a thread, or the start of either fails: the packed package with glue made to fail.
import assert from 'node:assert/strict';
import { rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { installPacked } from './packed.mjs';

/** As much of the border as `estimateNormals` needs; the points say what is to happen. */
const single = `
let memory, used = 0;
export default async (options) => ({ memory } = options);
export const setMaximum = () => {};
export class Buffer {
  constructor(byteLength) { this.byteLength = byteLength; this.pointer = used; used += byteLength; }
  free() {}
}
export function estimate(positions, double, options, tell) {
  const [wish] = new Float32Array(memory.buffer, positions.pointer, 3);
  tell('work', 0.5);
  if (wish === 1) throw new WebAssembly.RuntimeError('unreachable');
  if (wish === 2) Atomics.wait(new Int32Array(memory.buffer), 65536);
  return { report: { milliseconds: {} }, normals: positions };
}
`;
const threads = (thread) => `
export * from '../single/bilinormal.js';
import init from '../single/bilinormal.js';
let given;
export const pool = {};
export default async (options) => { given = options; ${thread.load}; return init(options); };
export const initThreadPool = (count) =>
  pool.start(given.module_or_path, given.memory, { numThreads: () => count, receiver: () => 1, build() {} });
export function wbg_rayon_start_worker() { ${thread.run} }
`;
const isThread = `(await import('node:worker_threads')).parentPort.listenerCount('message') === 0`;
const sleep = (milliseconds) => `Atomics.wait(new Int32Array(new SharedArrayBuffer(4)), 0, 0, ${milliseconds});`;

/** The package with glue that fails as asked, around the smallest wasm module. */
async function faulty({ load = '', run = '' }) {
  const { home, load: open } = installPacked();
  const empty = Uint8Array.of(0, 97, 115, 109, 1, 0, 0, 0);
  for (const [build, glue] of Object.entries({ single, threads: threads({ load, run }) })) {
    writeFileSync(join(home, 'dist', build, 'bilinormal.js'), glue);
    writeFileSync(join(home, 'dist', build, 'core.wasm'), empty);
  }
  return { home, ...(await open('bilinormal')) };
}

const points = (wish) => Float32Array.of(wish, 0, 0);

test('a trap rejects the call with a clear error, and the next one gets a new worker', async () => {
  const { createEstimator, BilinormalError } = await faulty({});
  const estimator = await createEstimator({ threads: 1 });
  const [first, second] = await Promise.allSettled([
    estimator.estimateNormals(points(1)),
    estimator.estimateNormals(points(0)),
  ]);
  assert.ok(first.reason instanceof BilinormalError);
  assert.equal(first.reason.code, 'limit');
  assert.match(first.reason.message, /wasm broke.*memory.*unreachable/);
  assert.equal(second.status, 'fulfilled');
  estimator.dispose();
});

test('the death of a thread, of which its waiting owner hears nothing, rejects the call', async () => {
  const { createEstimator } = await faulty({ run: `${sleep(300)} throw new WebAssembly.RuntimeError('unreachable');` });
  const estimator = await createEstimator({ threads: 2 });
  await assert.rejects(estimator.estimateNormals(points(2)), { code: 'limit', message: /unreachable/ });
  estimator.dispose();
});

test('a thread that fails to start means the single build, with the reason', async () => {
  const { createEstimator } = await faulty({ load: `if (${isThread}) throw new Error('no thread today')` });
  const estimator = await createEstimator({ threads: 2 });
  const { report } = await estimator.estimateNormals(points(0));
  assert.equal(report.mode, 'single');
  assert.equal(report.threads, 1);
  assert.match(report.fallbackReason, /threads did not start.*no thread today/);
  estimator.dispose();
});

test('a thread that never answers means the single build, with the reason', async () => {
  const { createEstimator } = await faulty({
    load: `if (${isThread}) await new Promise(() => setInterval(() => {}, 1e6))`,
  });
  const estimator = await createEstimator({ threads: 2 });
  const { report } = await estimator.estimateNormals(points(0));
  assert.equal(report.mode, 'single');
  assert.match(report.fallbackReason, /no answer in \d+ s/);
  estimator.dispose();
});

test('a worker that does not load is an unsupported engine or place', async () => {
  const { home, estimateNormals } = await faulty({});
  rmSync(join(home, 'dist', 'worker-node.js'));
  await assert.rejects(estimateNormals(points(0)), {
    code: 'unsupported',
    message: /worker did not start.*worker-node/,
  });
});
