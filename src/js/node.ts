// The entry for Node: the same package on worker threads. Its types are those of index.ts.
import { statSync } from 'node:fs';
import { pathToFileURL } from 'node:url';
import { Worker } from 'node:worker_threads';
import { makeApi } from './api.js';
import { link } from './node-link.js';

export const { estimateNormals, readPointCloud, writePly, createEstimator, features } = /* @__PURE__ */ makeApi({
  // Options of the process, such as a loader of its tests, are not for the worker.
  startWorker: (receive, fail) =>
    link(new Worker(new URL('./worker-node.js', import.meta.url), { execArgv: [] }), receive, fail),
  size(source) {
    try {
      // Bytes would be taken for a path.
      return source instanceof URL ? statSync(source).size : undefined;
    } catch {
      // Told when it is opened.
      return undefined;
    }
  },
  base: () => pathToFileURL('./').href,
});

export { BilinormalError, type ErrorCode } from './error.js';
export type * from './types.js';
