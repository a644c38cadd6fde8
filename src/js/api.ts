import { createEstimator, openEstimator, type Host } from './estimator.js';
import type { Estimator, EstimatorOptions } from './types.js';

export interface Api extends Omit<Estimator, 'dispose'> {
  createEstimator(options?: EstimatorOptions): Promise<Estimator>;
}

/** The package's functions for one platform, on one estimator, whose workers start with the first calls that need them. */
export function makeApi(host: Host): Api {
  const [estimator] = openEstimator(host, {});
  return { ...estimator, createEstimator: (options) => createEstimator(host, options) };
}
