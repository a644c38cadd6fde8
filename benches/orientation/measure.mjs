// The measurements: rows of clouds with known signs, as plain numbers.

import { PCPNET, VARIANTS, cloudOf, diagonal } from '../accuracy/clouds.mjs';
import { angles, summary } from '../accuracy/judge.mjs';
import { likeliest } from './attainable.mjs';
import { rightSigns, verdicts } from './judge.mjs';
import { SHAPES, turned } from './shapes.mjs';
import { VIEWS, seenFrom } from './single.mjs';
import { cornersOf, hidden, signedVolume, thickness } from './solid.mjs';

export const MODES = ['consistent', 'outward'];

/** Of each estimate, unless its runs have taken so many milliseconds; the fastest counts. */
export const RUNS = 3;
export const ENOUGH = 3_000;

/** A wall is thick that is more than so many times the deviation of the noise. */
export const THICK = 10;

/** What is attainable is told with so much noise and more, for so many points. */
export const LEAST_NOISE = 0.006;
export const TRIED = 5_000;

const MESH_SEED = 101;
/** For clouds of the same surface that are no part of the measured ones. */
const OTHER_SEED = 777;
/** Of a mesh's surface more may not lie inside of it: its signs would be a matter of opinion. */
const MOST_HIDDEN = 0.02;

/** How much is measured. `large`: the points of large clouds; `surface`: those that stand for a surface. */
export const FULL = {
  rows: Object.entries(SHAPES).flatMap(([name, { noise = 'noise0.6' }]) =>
    ['clean', noise].map((variant) => ({ name, variant })),
  ),
  points: 100_000,
  large: 1_000_000,
  surface: 300_000,
  meshVariants: PCPNET,
  viewVariants: ['clean', 'noise0.12'],
};
/** For tests: seconds. */
export const SMALL = {
  rows: ['sphere', 'terrain', 'moebius'].map((name) => ({ name, variant: 'clean' })),
  points: 15_000,
  large: 30_000,
  surface: 30_000,
  meshVariants: ['clean', 'noise0.6'],
  viewVariants: ['clean'],
};

/**
 * Meshes as `readMeshes` gives them -> `{ meshes, skipped, notes }`: wound outwards, and without those that overlap
 * themselves; `corners` of the triangles and `diagonal` of the box are added.
 */
export function withOutside(read) {
  const [meshes, skipped, notes] = [[], [], new Map()];
  for (const { name, about, mesh, sampler } of read) {
    const corners = cornersOf(mesh);
    const isInward = signedVolume(corners) < 0;
    const outward = isInward ? turned(sampler) : sampler;
    const size = diagonal(cloudOf(sampler, 2_000, {}, MESH_SEED));
    const inside = hidden(corners, outward, size);
    if (inside > MOST_HIDDEN) {
      skipped.push({
        name,
        reason: `overlaps itself: ${Math.round(100 * inside)} % of its surface is not its outside`,
      });
      continue;
    }
    if (isInward) notes.set(name, 'wound inwards, so turned');
    meshes.push({ name, about, corners, sampler: outward });
  }
  return { meshes, skipped, notes };
}

/**
 * The rows of a plan: each with a function `cloud` that answers `{ positions, normals }`. Clean ones have `large`, which answers
 * the positions of many more points, those with much noise `surface`, which answers `{ positions, normals, deviation }` of the
 * surface and of its noise, and noisy meshes `walls`, which answers how thick the wall behind each point is, in deviations of the
 * noise. `scans`: `{ name, about, positions, normals }`.
 */
export function plannedRows({ rows, points, large, surface, meshVariants, viewVariants }, meshes, scans = []) {
  const shapes = Object.keys(SHAPES);
  const clouds = (samplerFor, variant, seed) => {
    const { noise = 0, keep } = VARIANTS[variant];
    const known = () => {
      const cloud = cloudOf(samplerFor(points), surface, {}, OTHER_SEED);
      return { ...cloud, deviation: noise * diagonal(cloud) };
    };
    return {
      cloud: () => cloudOf(samplerFor(points), points, VARIANTS[variant], seed),
      large: !noise && !keep && (() => cloudOf(samplerFor(large), large, {}, seed).positions),
      surface: noise >= LEAST_NOISE && known,
    };
  };
  return [
    ...rows.map(({ name, variant }) => {
      const { shape, open = false, sides = true, kind = 'shape' } = SHAPES[name];
      return { name, variant, kind, open, sides, ...clouds(shape, variant, 1 + shapes.indexOf(name)) };
    }),
    ...meshes.flatMap(({ name, about, corners, sampler }) => {
      const walls = once(() => wallsOf(corners, cloudOf(sampler, points, {}, MESH_SEED)));
      return meshVariants.map((variant) => ({
        name,
        about,
        variant,
        kind: 'mesh',
        open: false,
        sides: true,
        ...clouds(() => sampler, variant, MESH_SEED),
        // The noisy points are those of the clean cloud, moved.
        walls: VARIANTS[variant].noise && (() => walls().map((wall) => wall / VARIANTS[variant].noise)),
      }));
    }),
    ...meshes.flatMap(({ name, corners, sampler }) =>
      Object.entries(VIEWS).flatMap(([view, direction]) => {
        const seen = once(() => seenFrom(direction, corners, sampler));
        return viewVariants.map((variant) => ({
          name: `${name} ${view}`,
          variant,
          kind: 'view',
          open: false,
          sides: true,
          cloud: () => cloudOf(seen(), points, VARIANTS[variant], MESH_SEED),
        }));
      }),
    ),
    ...scans.map(({ name, about, ...cloud }) => ({
      name,
      about,
      variant: 'as it is',
      kind: 'ranges',
      open: false,
      sides: true,
      cloud: () => cloud,
    })),
  ];
}

/** How thick the walls behind the points of a clean cloud are, as shares of its diagonal. */
function wallsOf(corners, cloud) {
  const size = diagonal(cloud);
  return thickness(corners, cloud, 2e-5 * size).map((wall) => wall / size);
}

function once(job) {
  let result;
  return () => (result ??= job());
}

/**
 * Measures every row; `tell` hears what is being measured. `estimator` has one thread. `peers(row, cloud)`: what others reach
 * on it.
 */
export async function measureAll(estimator, rows, { tell, peers }) {
  await warmUp(estimator);
  const results = [];
  for (const { cloud, large, surface, walls, ...row } of rows) {
    tell(`${row.name}, ${row.variant}`);
    const measured = cloud();
    const { positions, normals: truth } = measured;
    const parts = partsOf(walls && walls().map((wall) => wall > THICK));
    const off = (normals) => summary(angles(normals, truth)).rms;
    const lines = { none: off((await estimator.estimateNormals(positions)).normals) };
    const modes = {};
    for (const mode of MODES) {
      const { normals, report, seconds } = await timed(estimator, positions, { orient: mode });
      const signs = mapValues(parts, (counts) => rightSigns(normals, truth, counts));
      lines[mode] = off(normals);
      const { components } = report;
      modes[mode] = { signs, components: components.count, largest: components.largest[0], seconds };
    }
    const others = row.sides && (await peers?.(row, measured));
    const result = { ...row, points: positions.length / 3, lines, modes, ...(others && { peers: others }) };
    if (large) result.large = (await timed(estimator, large(), { orient: MODES[0] })).seconds.orientation;
    const missed = new Set(verdicts(result).flatMap(({ part, met }) => (met ? [] : [part])));
    if (surface && missed.size > 0) {
      const direction = likeliest(surface());
      const shares = [...missed].map((part) => [part, attainable(measured, direction, parts[part])]);
      result.attainable = Object.fromEntries(shares);
    }
    results.push(result);
  }
  return results;
}

/** Which points are of each part that something is asked of; `thick` tells of each whether the wall behind it is. */
const partsOf = (thick) => ({
  all: () => true,
  ...(thick && { thick: (i) => thick[i] === 1, thin: (i) => thick[i] === 0 }),
});

/** The share of right signs that who knows the surface has, for points of which `counts` answers true. */
function attainable({ positions, normals }, direction, counts) {
  const points = Array.from({ length: positions.length / 3 }, (_, i) => i).filter(counts);
  const tried = points.filter((_, i) => i % Math.ceil(points.length / TRIED) === 0);
  const of = (vectors, point) => [...vectors.subarray(3 * point, 3 * point + 3)];
  const directions = tried.flatMap((point) => direction(of(positions, point)));
  const truth = tried.flatMap((point) => of(normals, point));
  return rightSigns(directions, truth).share;
}

const mapValues = (object, job) => Object.fromEntries(Object.entries(object).map(([key, value]) => [key, job(value)]));

/** The engine compiles what is hot once more, better: not during what counts. */
async function warmUp(estimator) {
  const { positions } = cloudOf(SHAPES.sphere.shape(), 50_000, {}, 1);
  for (const mode of MODES) await estimator.estimateNormals(positions, { orient: mode });
}

/** A result, and the seconds for a million points, of the orientation and of all, of the fastest run. */
async function timed(estimator, positions, options) {
  const fastest = { orientation: Infinity, total: Infinity };
  let [result, spent] = [undefined, 0];
  for (let run = 0; run < RUNS && spent < ENOUGH; run++) {
    result = await estimator.estimateNormals(positions, options);
    const { milliseconds, points } = result.report;
    spent += milliseconds.total;
    for (const phase of Object.keys(fastest))
      fastest[phase] = Math.min(fastest[phase], (1_000 * milliseconds[phase]) / points);
  }
  return { normals: result.normals, report: result.report, seconds: fastest };
}
