// How far a cloud reaches, without being fooled by stray or non-finite points.

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
