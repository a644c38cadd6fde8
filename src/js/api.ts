import { createEstimator, openEstimator, type Host } from './estimator.js';
import { detect } from './features.js';
import type { Estimator, EstimatorOptions, Features } from './types.js';

export interface Api extends Pick<Estimator, 'estimateNormals' | 'readPointCloud' | 'writePly'> {
  createEstimator(options?: EstimatorOptions): Promise<Estimator>;
  features(): Promise<Features>;
}

/** The package's functions for one platform, on one estimator that the first call opens. */
export function makeApi(host: Host): Api {
  let opened: Estimator | undefined;
  const shared = () => (opened ??= openEstimator(host, {})[0]);
  return {
    estimateNormals: (positions, options) => shared().estimateNormals(positions, options),
    readPointCloud: (source, options) => shared().readPointCloud(source, options),
    writePly: (cloud, add, options) => shared().writePly(cloud, add, options),
    createEstimator: (options) => createEstimator(host, options),
    features: async () => detect(),
  };
}
