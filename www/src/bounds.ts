// How far a cloud reaches, without being fooled by stray or non-finite points.
import { nth } from './spread';

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
  const length = Math.min(points, SAMPLE);
  /** What is finite of the points looked at, sorted. */
  const sorted = (of: (at: number) => number) => {
    const values = new Float32Array(length);
    let count = 0;
    for (let k = 0; k < length; k++) {
      const value = of(3 * nth(k, points, length));
      if (Number.isFinite(value)) values[count++] = value;
    }
    return values.subarray(0, count).sort();
  };
  const values = [0, 1, 2].map((axis) => sorted((at) => positions[at + axis]!));
  const quantile = (axis: number, share: number) => {
    const column = values[axis]!;
    return column.length === 0 ? 0 : column[Math.round(share * (column.length - 1))]!;
  };
  const low = [0, 1, 2].map((axis) => quantile(axis, STRAY));
  const high = [0, 1, 2].map((axis) => quantile(axis, 1 - STRAY));
  const centre = low.map((value, axis) => (value + high[axis]!) / 2) as Bounds['centre'];
  const extent = low.map((value, axis) => high[axis]! - value) as Bounds['extent'];

  let squaredReach = -1;
  for (let at = 0; at < positions.length; at += 3) {
    const x = positions[at]! - centre[0];
    const y = positions[at + 1]! - centre[1];
    const z = positions[at + 2]! - centre[2];
    const square = x * x + y * y + z * z;
    if (square < Infinity && square > squaredReach) squaredReach = square;
  }
  if (squaredReach < 0) return undefined;
  const [x, y, z] = centre;
  const distances = sorted((at) => Math.hypot(positions[at]! - x, positions[at + 1]! - y, positions[at + 2]! - z));
  const most = distances[Math.floor((1 - 2 * STRAY) * (distances.length - 1))] ?? 0;
  const reach = Math.sqrt(squaredReach) || 1;
  // Without strays the whole cloud is framed; a lone far point is not allowed to shrink the rest to a dot.
  const radius = (reach < 1.5 * most ? reach : most) || reach;
  return { centre, radius, reach, extent };
}
