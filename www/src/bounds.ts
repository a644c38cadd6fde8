// How far a cloud reaches and which way is up, without being fooled by stray or non-finite points.

import type { Up } from './viewer';

export interface Bounds {
  /** Middle of the bulk of the points. */
  centre: [number, number, number];
  /** Radius round it that holds the bulk: what a view should frame. */
  radius: number;
  /** Radius round it that holds every finite point: what must not be clipped. */
  reach: number;
  /** Edges of the box of the bulk. */
  extent: [number, number, number];
}

/** Points looked at for quantiles; the reach looks at every point. */
const SAMPLE = 20_000;
/** Share of the points that may lie outside of the bulk, at each end of each axis. */
const STRAY = 0.005;

/** The bounds of `positions` (x0 y0 z0 x1 ...), if there is a finite point. */
export function boundsOf(positions: Float32Array): Bounds | undefined {
  const points = positions.length / 3;
  const step = Math.max(1, Math.floor(points / SAMPLE));
  const values = [0, 1, 2].map((axis) => {
    const column = new Float32Array(Math.ceil(points / step));
    let count = 0;
    for (let i = 0; i < points; i += step) {
      const value = positions[3 * i + axis]!;
      if (Number.isFinite(value)) column[count++] = value;
    }
    return column.subarray(0, count).sort();
  });
  const quantile = (axis: number, share: number) => {
    const column = values[axis]!;
    return column.length === 0 ? 0 : column[Math.round(share * (column.length - 1))]!;
  };
  const low = [0, 1, 2].map((axis) => quantile(axis, STRAY));
  const high = [0, 1, 2].map((axis) => quantile(axis, 1 - STRAY));
  const centre = low.map((value, axis) => (value + high[axis]!) / 2) as Bounds['centre'];
  const extent = low.map((value, axis) => high[axis]! - value) as Bounds['extent'];

  let squaredReach = -1;
  const squares = new Float64Array(Math.ceil(points / step));
  let sampled = 0;
  for (let i = 0; i < points; i++) {
    const x = positions[3 * i]! - centre[0];
    const y = positions[3 * i + 1]! - centre[1];
    const z = positions[3 * i + 2]! - centre[2];
    const square = x * x + y * y + z * z;
    if (!(square < Infinity)) continue;
    if (square > squaredReach) squaredReach = square;
    if (i % step === 0) squares[sampled++] = square;
  }
  if (squaredReach < 0) return undefined;
  const bulk = squares.subarray(0, sampled).sort();
  const most = sampled === 0 ? 0 : Math.sqrt(bulk[Math.floor((1 - 2 * STRAY) * (sampled - 1))]!);
  const reach = Math.sqrt(squaredReach) || 1;
  // Without strays the whole cloud is framed; a lone far point is not allowed to shrink the rest to a dot.
  const radius = (reach < 1.5 * most ? reach : most) || reach;
  return { centre, radius, reach, extent };
}

/**
 * Which axis points up. Surveys and rooms are z-up and flat along z, often with an origin far away; what a depth camera saw
 * lies before it, along z, and its y points down, or up where it looks against z; single things (meshes, range scans,
 * statues) are mostly y-up. The scanner's place is told by some files.
 */
export function guessUp(
  { centre, extent: [x, y, z] }: Bounds,
  origin: readonly number[],
  scanner: readonly [number, number, number] | undefined,
): Up {
  const surveyed = origin.some((value) => value !== 0);
  if (scanner && !surveyed) {
    const [aside, above, away] = scanner.map((value, axis) => value - centre[axis]!) as [number, number, number];
    // From so far that it saw no more than a camera does, and along z: that the cloud is flat then is no sign of ground.
    if (Math.abs(away) > Math.max(x, y, 2 * Math.hypot(aside, above))) return away > 0 ? 'y' : '-y';
  }
  if (surveyed || z < 0.6 * Math.min(x, y)) return 'z';
  // Nothing behind or close to the camera, all within a right angle, and its axis passes through it.
  const [right, down, ahead] = centre;
  const isAhead = ahead > 0.75 * z && ahead > Math.max(x, y) / 2;
  return isAhead && Math.abs(right) < x / 2 && Math.abs(down) < y / 2 ? '-y' : 'y';
}
