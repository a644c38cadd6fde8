// How two sets of normals of the same points differ.

export interface Comparison {
  /** Mean angle between them, whatever their signs. */
  degrees: number;
  /** How many point to opposite sides, of how many that have both. */
  opposite: number;
  compared: number;
}

/** Normals of any length, x0 y0 z0 x1 ...; where one is zero or not finite, nothing is compared. */
export function compare(normals: Float32Array, others: Float32Array): Comparison {
  let [sum, opposite, compared] = [0, 0, 0];
  for (let i = 0; i < normals.length; i += 3) {
    const [x, y, z] = [normals[i]!, normals[i + 1]!, normals[i + 2]!];
    const [u, v, w] = [others[i]!, others[i + 1]!, others[i + 2]!];
    // In less than half the time of Math.hypot; products of squares of single precision do not overflow.
    const cosine = (x * u + y * v + z * w) / Math.sqrt((x * x + y * y + z * z) * (u * u + v * v + w * w));
    if (!Number.isFinite(cosine)) continue;
    compared++;
    if (cosine < 0) opposite++;
    sum += Math.acos(Math.min(1, Math.abs(cosine)));
  }
  return { degrees: (sum / Math.max(1, compared)) * (180 / Math.PI), opposite, compared };
}
