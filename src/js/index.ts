/**
 * Normals of large point clouds, computed in a worker by WebAssembly: the entry for browsers. Importing it does
 * nothing; the first call starts a worker that later calls share, and the first that needs the full module another.
 *
 * Sub-paths of the package: `bilinormal/three` (a point material), `bilinormal/worker` (the worker's script),
 * `bilinormal/single.wasm`, `single-full.wasm`, `threads.wasm` and `threads-full.wasm` (the wasm modules, for
 * `createEstimator({ wasmUrl })`).
 */
import { makeApi } from './api.js';
import { starter } from './link.js';

const api = /* @__PURE__ */ makeApi({
  startWorker: starter(() => new Worker(new URL('./worker.js', import.meta.url), { type: 'module' })),
  base: () => globalThis.document?.baseURI ?? location.href,
});

/**
 * One unit normal for each point; zero where there is none to be found. Time and memory grow with the points only; time also
 * with k for `'knn'`, and with its square for `'egg'`. Rejects with `input`, `limit`, `unsupported`, `signal.reason`.
 */
export const estimateNormals = api.estimateNormals;
/**
 * Reads a PLY file: positions, and normals, colours and intensity where it has them. Other elements are skipped. Rejects with
 * `format` for what the file holds, `input` for a source that does not open, and as `estimateNormals` does.
 */
export const readPointCloud = api.readPointCloud;
/**
 * Writes a PLY with `add`: from a file (or anything that `readPointCloud` takes) with every other property and element
 * kept and existing normals replaced, or from a cloud alone. Rejects as `readPointCloud` does, and with `input` for arrays
 * that do not fit the points.
 */
export const writePly = api.writePly;
/**
 * An estimator with workers of its own, and its own choice of threads, memory and place of the wasm files; resolves when the
 * first is ready. Rejects with `input` for options, `limit` for memory, `unsupported` where no worker starts.
 */
export const createEstimator = api.createEstimator;
/** What this engine and this page allow, without starting anything. Never rejects. */
export const features = api.features;

export { BilinormalError, type ErrorCode } from './error.js';
export type * from './types.js';
