// Which axis of a cloud points up, where its file does not tell.
import type { Bounds } from './bounds';
import { nth } from './spread';
import type { Up } from './viewer';

/** Points looked at to find out how a cloud stands. */
const SAMPLE = 6_000;
/** What stands rests on the points of this lowest share of its height. */
const FOOT = 0.04;
/** Directions in which a foot is measured. */
const DIRECTIONS = 16;
/** So steady at the least is what stands, and so many times as steady as along another axis. */
const STEADY = 0.1;
const STEADIER = 1.5;

/**
 * Surveys and rooms are z-up and flat along z, often with an origin far away; what stands much more steadily along z
 * than along y, either way, is z-up too. What a depth camera saw lies before it, along z, and its y points down, or up
 * where it looks against z; other single things (meshes, range scans, statues) are mostly y-up. The scanner's place is
 * told by some files.
 */
export function guessUp(
  positions: Float32Array,
  bounds: Bounds,
  origin: readonly number[],
  scanner: readonly [number, number, number] | undefined,
): Up {
  const { centre, extent } = bounds;
  const [x, y, z] = extent;
  const surveyed = origin.some((value) => value !== 0);
  if (scanner && !surveyed) {
    const [aside, above, away] = scanner.map((value, axis) => value - centre[axis]!) as [number, number, number];
    // From so far that it saw no more than a camera does, and along z: that the cloud is flat then is no sign of ground.
    if (Math.abs(away) > Math.max(x, y, 2 * Math.hypot(aside, above))) return away > 0 ? 'y' : '-y';
  }
  if (surveyed || z < 0.6 * Math.min(x, y)) return 'z';
  const along = (axis: number, up: number) => steadiness(positions, bounds, axis, up);
  if (along(2, 1) > Math.max(STEADY, STEADIER * along(1, 1), STEADIER * along(1, -1))) return 'z';
  // Nothing behind or close to the camera, all within a right angle, and its axis passes through it.
  const [right, down, ahead] = centre;
  const isAhead = ahead > 0.75 * z && ahead > Math.max(x, y) / 2;
  return isAhead && Math.abs(right) < x / 2 && Math.abs(down) < y / 2 ? '-y' : 'y';
}

/**
 * The slant, as a tangent, at which a cloud would fall over that stands on the lowest points along an axis, or on the
 * highest where `up` is -1: how far its middle is within the outline of these, by its height. Below 0 it does not stand.
 */
function steadiness(positions: Float32Array, { centre, extent }: Bounds, axis: number, up: number): number {
  const axes = [axis, (axis + 1) % 3, (axis + 2) % 3] as const;
  const [height, width, depth] = axes.map((k) => extent[k]! / 2) as [number, number, number];
  const outline = Array.from({ length: DIRECTIONS }, (_, i) => {
    const angle = (2 * Math.PI * i) / DIRECTIONS;
    return { cosine: Math.cos(angle), sine: Math.sin(angle), reach: -Infinity };
  });
  const points = positions.length / 3;
  const looked = Math.min(points, SAMPLE);
  let [sumU, sumV, sumW, count] = [0, 0, 0, 0];
  for (let k = 0; k < looked; k++) {
    const at = 3 * nth(k, points, looked);
    const w = positions[at + axes[0]]! - centre[axes[0]];
    const u = positions[at + axes[1]]! - centre[axes[1]];
    const v = positions[at + axes[2]]! - centre[axes[2]];
    // Strays carry nothing; neither does what is not finite.
    if (!(Math.abs(w) <= height && Math.abs(u) <= width && Math.abs(v) <= depth)) continue;
    count++;
    sumU += u;
    sumV += v;
    sumW += w;
    if (up * w > (2 * FOOT - 1) * height) continue;
    for (const side of outline) side.reach = Math.max(side.reach, side.cosine * u + side.sine * v);
  }
  const within = outline.map(({ cosine, sine, reach }) => reach - (cosine * sumU + sine * sumV) / count);
  return Math.min(...within) / (height + (up * sumW) / count);
}
