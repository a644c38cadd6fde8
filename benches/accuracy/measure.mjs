// The measurements: rows of clouds by methods, as plain numbers.

import { Failure } from '../../scripts/run.mjs';
import { cloudOf, turned, VARIANTS } from './clouds.mjs';
import { jetNormal } from './jet.mjs';
import { angles, summary, unresolved } from './judge.mjs';
import { nearestNeighbours } from './neighbours.mjs';
import { SHAPES } from './shapes.mjs';

export const NEIGHBOURS = [10, 16, 30, 100, 250];
const SCALES = [0.4, 1, 1.5, 3];

const named = (values, name) => values.map((value) => [name(value), value]);
/** The methods of the package, `{ name: options }`. */
export const METHODS = {
  auto: {},
  ...Object.fromEntries(named(SCALES, (scale) => `${scale} L`).map(([name, scale]) => [name, { cell: { scale } }])),
  ...Object.fromEntries(named(NEIGHBOURS, (k) => `knn ${k}`).map(([name, k]) => [name, { method: 'knn', k }])),
};
export const KNN = NEIGHBOURS.map((k) => `knn ${k}`);
export const JET = NEIGHBOURS.map((k) => `jet ${k}`);
export const ALL = [...Object.keys(METHODS), ...JET];
/** What 'auto' is held against where it gives no normal. */
const RESOLVES = 'knn 16';

/** Angles below this are as good as none: ratios take them for it. In degrees. */
export const LEAST = 0.1;

/** Runs of each method, unless they have taken so many milliseconds: long runs differ less. */
export const RUNS = 3;
export const ENOUGH = 300;

const rowsOf = (shapes, variants, points, suffix = '') =>
  shapes.flatMap((shape) => variants.map((variant) => ({ shape, variant, points, name: `${shape}${suffix}` })));

/** How much is measured. `sampled`: the points of a row at which the jet is fitted, among all points. */
export const FULL = {
  rows: [
    ...rowsOf(Object.keys(SHAPES), Object.keys(VARIANTS), 100_000),
    ...rowsOf(['cube'], ['clean', 'noise0.12', 'noise0.6'], 200_000, '200k'),
  ],
  meshPoints: 100_000,
  sampled: 5_000,
};
/** For tests: seconds. */
export const SMALL = {
  rows: [
    ...rowsOf(['sphere', 'cube', 'outliers'], ['clean'], 15_000),
    ...rowsOf(['terrain', 'cylinder'], ['noise0.6'], 15_000),
    ...rowsOf(['torus'], ['stripes'], 15_000),
    ...rowsOf(['helicoid'], ['gradient'], 15_000),
  ],
  meshPoints: 15_000,
  sampled: 500,
};

const MESH_SEED = 101;

/** The rows of a plan with their samplers; of `meshes`, `{ name, sampler }`, one for each variant. */
export function plannedRows({ rows, meshPoints }, meshes) {
  const shapes = Object.keys(SHAPES);
  return [
    ...rows.map((row) => ({ ...row, sampler: SHAPES[row.shape](row.points), seed: 1 + shapes.indexOf(row.shape) })),
    ...meshes.flatMap(({ name, about, sampler }) =>
      Object.keys(VARIANTS).map((variant) => ({
        name,
        about,
        variant,
        points: meshPoints,
        sampler,
        seed: MESH_SEED,
        isMesh: true,
      })),
    ),
  ];
}

/** The rows that one of the names means: a shape, a variant, or both, "cube-clean". Throws where there is none. */
export function chosenRows(rows, names) {
  const means = (row, name) => [row.name, row.variant, `${row.name}-${row.variant}`].includes(name);
  const unknown = names.find((name) => !rows.some((row) => means(row, name)));
  if (unknown !== undefined) {
    const known = [...new Set(rows.flatMap(({ name, variant }) => [name, variant]))];
    throw new Failure(`no row is called ${unknown}; wanted some of ${known.join(', ')}, or both as cube-clean`);
  }
  return rows.filter((row) => names.some((name) => means(row, name)));
}

/** Measures every row by every method; `tell` hears what is being measured. */
export async function measureAll(estimator, rows, { sampled, tell }) {
  await warmUp(estimator);
  const results = [];
  for (const { name, about, variant, points, sampler, seed, isMesh = false } of rows) {
    tell(`${name}, ${variant}`);
    const cloud = cloudOf(sampler, points, VARIANTS[variant], seed);
    const methods = await measure(estimator, cloud, sampled);
    results.push({ name, about, variant, points, isMesh, methods, ...compare(methods) });
  }
  return results;
}

/** The engine compiles what is hot once more, better: not during what counts. */
async function warmUp(estimator) {
  const { positions } = cloudOf(SHAPES.sphere(), 20_000, {}, 1);
  for (const options of Object.values(METHODS)) await estimator.estimateNormals(positions, options);
}

/**
 * `{ method: { rms, mean, over, unresolved, milliseconds, sampled } }`, where `sampled` is the root mean square over the
 * points at which the jet was fitted; a jet has nothing but that. `auto` also has `missed`: the share of the points
 * without a normal that have one by the nearest neighbours; and `turned`: the root mean square of the cloud when it is turned.
 */
async function measure(estimator, { positions, normals: truth }, sampled) {
  const chosen = sample(positions.length / 3, sampled);
  const methods = {};
  const found = {};
  for (const [name, options] of Object.entries(METHODS)) {
    const { normals, milliseconds } = await timed(() => estimator.estimateNormals(positions, options));
    const errors = angles(normals, truth);
    methods[name] = {
      ...summary(errors),
      unresolved: unresolved(normals, truth),
      milliseconds,
      sampled: summary(chosen.map((i) => errors[i])).rms,
    };
    found[name] = normals;
  }
  methods.auto.missed = unresolved(found.auto, truth, found[RESOLVES]);
  const { normals } = await estimator.estimateNormals(turned(positions), METHODS.auto);
  methods.auto.turned = summary(angles(normals, turned(truth))).rms;
  return { ...methods, ...jets(positions, truth, chosen) };
}

/** The result of a job, and the time of its fastest run of `RUNS`; of fewer where these take long. */
async function timed(job) {
  let [spent, milliseconds, normals] = [0, Infinity];
  for (let run = 0; run < RUNS && spent < ENOUGH; run++) {
    const { report, ...result } = await job();
    ({ normals } = result);
    spent += report.milliseconds.total;
    milliseconds = Math.min(milliseconds, report.milliseconds.total);
  }
  return { normals, milliseconds };
}

/** Evenly spread in the order of the points, which is random in all rows. */
const sample = (count, wanted) => Array.from({ length: wanted }, (_, i) => Math.floor((i * count) / wanted));

function jets(positions, truth, chosen) {
  const nearest = nearestNeighbours(positions);
  const most = Math.max(...NEIGHBOURS);
  const around = new Float64Array(3 * most);
  const normals = NEIGHBOURS.map(() => new Float64Array(3 * chosen.length));
  const chosenTruth = new Float64Array(3 * chosen.length);
  chosen.forEach((point, to) => {
    chosenTruth.set(truth.subarray(3 * point, 3 * point + 3), 3 * to);
    nearest(positions.subarray(3 * point, 3 * point + 3), most).forEach((other, i) => {
      for (let axis = 0; axis < 3; axis++)
        around[3 * i + axis] = positions[3 * other + axis] - positions[3 * point + axis];
    });
    NEIGHBOURS.forEach((k, i) => normals[i].set(jetNormal(around, k), 3 * to));
  });
  return Object.fromEntries(JET.map((name, i) => [name, { sampled: summary(angles(normals[i], chosenTruth)).rms }]));
}

/** 'auto' against the best that one fixed k could have done, by the plane alone and by plane or jet. */
function compare(methods) {
  const best = KNN.reduce((a, b) => (methods[b].rms < methods[a].rms ? b : a));
  const bestOfAll = [...KNN, ...JET].reduce((a, b) => (methods[b].sampled < methods[a].sampled ? b : a));
  return {
    best,
    ratio: ratio(methods.auto.rms, methods[best].rms),
    bestOfAll,
    ratioOfAll: ratio(methods.auto.sampled, methods[bestOfAll].sampled),
    turning: change(methods.auto.turned, methods.auto.rms),
  };
}

export const ratio = (error, reference) => Math.max(error, LEAST) / Math.max(reference, LEAST);
/** By how many times the larger of two errors is the smaller one. */
const change = (a, b) => Math.max(ratio(a, b), ratio(b, a));
export const geometricMean = (values) =>
  Math.exp(values.reduce((sum, value) => sum + Math.log(value), 0) / values.length);
