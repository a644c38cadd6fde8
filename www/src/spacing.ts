// How far apart the points of a cloud are, which tells how large they must be drawn to close its surface.
import { spread } from './spread';

/** Points looked at, and those of them whose nearest neighbours among all these are sought: 30 ms at the most. */
const SAMPLE = 60_000;
const PROBES = 200;
const NEIGHBOURS = 8;
/** Share of the probes whose neighbours are no further: what is thinly covered does not make blobs of the rest. */
const QUANTILE = 0.9;

/**
 * The edge of the square that a point has for itself on the surface; `Infinity` if all are in one place, or none is finite of
 * those looked at.
 */
export function spacingOf(positions: Float32Array): number {
  const all = positions.length / 3;
  const sample = new Float32Array(3 * Math.min(all, SAMPLE));
  let count = 0;
  for (const index of spread(all, sample.length / 3)) {
    const point = positions.subarray(3 * index, 3 * index + 3);
    if (point.every(Number.isFinite)) sample.set(point, 3 * count++);
  }
  const taken = sample.subarray(0, 3 * count);
  const distances = Float64Array.from({ length: Math.min(count, PROBES) }, (_, probe) => reachOf(probe, taken)).sort();
  const distance = distances[Math.floor(QUANTILE * (distances.length - 1))];
  if (distance === undefined) return Infinity;
  // The disc round a probe holds so many points of the sample, and as many more of all as there are.
  return distance * Math.sqrt((Math.PI / NEIGHBOURS) * (count / all));
}

/** How far the nearest neighbours of a point reach; what is in the same place is none. */
function reachOf(point: number, positions: Float32Array): number {
  const [x, y, z] = [0, 1, 2].map((axis) => positions[3 * point + axis]!) as [number, number, number];
  const nearest = new Float64Array(NEIGHBOURS).fill(Infinity);
  for (let i = 0; i < positions.length; i += 3) {
    const square = (positions[i]! - x) ** 2 + (positions[i + 1]! - y) ** 2 + (positions[i + 2]! - z) ** 2;
    if (square === 0 || !(square < nearest[NEIGHBOURS - 1]!)) continue;
    nearest[NEIGHBOURS - 1] = square;
    nearest.sort();
  }
  return Math.sqrt(nearest[NEIGHBOURS - 1]!);
}
