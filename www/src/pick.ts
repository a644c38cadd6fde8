// The point under a ray, for clicks: the nearest to the eye of those close to the ray.
import { nth } from './spread';

type Vector = readonly [number, number, number];

/** Points looked at; more would hold up the page and find much the same spot. */
const SAMPLE = 1_000_000;

/**
 * Index of the point met by the ray from `eye` along the unit vector `along`, or -1. A point is met within the angle
 * whose tangent is `slope`, and within the `radius` that it is drawn with.
 */
export function pickPoint(positions: Float32Array, eye: Vector, along: Vector, slope: number, radius: number): number {
  const points = positions.length / 3;
  const count = Math.min(points, SAMPLE);
  // Those looked at stand for the others.
  const reach = radius * Math.sqrt(points / count);
  let best = -1;
  let nearest = Infinity;
  for (let k = 0; k < count; k++) {
    const i = nth(k, points, count);
    const x = positions[3 * i]! - eye[0];
    const y = positions[3 * i + 1]! - eye[1];
    const z = positions[3 * i + 2]! - eye[2];
    const depth = x * along[0] + y * along[1] + z * along[2];
    if (!(depth > 0) || depth >= nearest) continue;
    const offset = x * x + y * y + z * z - depth * depth;
    if (offset > Math.max(slope * depth, reach) ** 2) continue;
    nearest = depth;
    best = i;
  }
  return best;
}
