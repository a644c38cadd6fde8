// A sampler and a variant -> a cloud with its true normals: seeded noise and density patterns, as in PCPNet's data, and
// coordinates that were rounded.

import { mulberry } from '../clouds.mjs';

/**
 * `noise`: the standard deviation as a share of the diagonal of the clean cloud's box. `keep`: the share of candidates
 * that stay, by their place along the longest side of the box, 0 to 1. `step`: what coordinates are rounded to multiples
 * of, as a share of that diagonal.
 */
export const VARIANTS = {
  clean: {},
  'noise0.12': { noise: 0.0012 },
  'noise0.6': { noise: 0.006 },
  'noise1.2': { noise: 0.012 },
  stripes: { keep: (place) => (Math.floor(10 * place) % 2 === 0 ? 1 : 0.1) },
  gradient: { keep: (place) => 1 - 0.95 * place },
  steps: { step: 1 / 400 },
};
/** Those of PCPNet. */
export const PCPNET = Object.keys(VARIANTS).filter((name) => name !== 'steps');

/** Candidates that show where the box of a surface is. */
const PILOT = 20_000;

/** `count` points and their true normals, both Float32Array; the clean and the noisy ones are the same points. */
export function cloudOf(sampler, count, { noise, keep, step }, seed) {
  const [positions, normals] = [new Float32Array(3 * count), new Float32Array(3 * count)];
  const stays = keep ? pattern(sampler, keep, seed) : () => true;
  const random = mulberry(Math.imul(seed, 0x9e3779b1));
  const sample = new Float64Array(6);
  for (let at = 0; at < 3 * count;) {
    sampler(random, sample);
    if (!stays(sample)) continue;
    positions.set(sample.subarray(0, 3), at);
    normals.set(sample.subarray(3), at);
    at += 3;
  }
  if (noise) blur(positions, noise * diagonal({ positions, normals }), mulberry(Math.imul(seed, 0x85ebca6b)));
  if (step) {
    const width = step * diagonal({ positions, normals });
    positions.forEach((place, i) => (positions[i] = Math.round(place / width) * width));
  }
  return { positions, normals };
}

/** The same points or directions, turned about no special axis. */
export function turned(vectors) {
  // By the quaternion 1 + 0.3 i - 0.45 j + 0.7 k.
  const [w, x, y, z] = [1, 0.3, -0.45, 0.7].map((part) => part / Math.hypot(1, 0.3, -0.45, 0.7));
  const rows = [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
  return vectors.map((_, i) => {
    const from = i - (i % 3);
    return rows[i % 3].reduce((sum, factor, axis) => sum + factor * vectors[from + axis], 0);
  });
}

/** Whether a candidate stays, by its place along the longest side. */
function pattern(sampler, keep, seed) {
  const pilot = cloudOf(sampler, PILOT, {}, seed);
  const { low, side } = box(pilot);
  const axis = side.indexOf(Math.max(...side));
  const random = mulberry(Math.imul(seed, 0xc2b2ae35));
  return (sample) => random() < keep(Math.min(Math.max((sample[axis] - low[axis]) / side[axis], 0), 1));
}

/** The box of the points on the surface: outliers are not part of it. */
function box({ positions, normals }) {
  const [low, high] = [
    [Infinity, Infinity, Infinity],
    [-Infinity, -Infinity, -Infinity],
  ];
  for (let i = 0; i < positions.length; i += 3) {
    if (normals[i] === 0 && normals[i + 1] === 0 && normals[i + 2] === 0) continue;
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], positions[i + axis]);
      high[axis] = Math.max(high[axis], positions[i + axis]);
    }
  }
  return { low, side: high.map((value, axis) => value - low[axis]) };
}

/** Of the box of the points on the surface. */
export const diagonal = (cloud) => Math.hypot(...box(cloud).side);

function blur(positions, deviation, random) {
  for (let i = 0; i < positions.length; i++) {
    const radius = Math.sqrt(-2 * Math.log(1 - random()));
    positions[i] += deviation * radius * Math.cos(2 * Math.PI * random());
  }
}
