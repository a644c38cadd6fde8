// How far normals are from the true ones: unsigned angles, in degrees.

/** Shares of the points whose angle is larger are told. */
export const LIMITS = [5, 10, 30];

/** The angle at each of some points; a right angle for a zero normal, not a number where there is no true one. */
export function angles(normals, truth) {
  const result = new Float64Array(normals.length / 3);
  for (let i = 0, at = 0; i < result.length; i++, at += 3) {
    const [x, y, z] = [truth[at], truth[at + 1], truth[at + 2]];
    const [nx, ny, nz] = [normals[at], normals[at + 1], normals[at + 2]];
    const isKnown = x !== 0 || y !== 0 || z !== 0;
    const isFound = nx !== 0 || ny !== 0 || nz !== 0;
    // By the cross product: the cosine of a small angle has no digits left.
    const across = Math.hypot(y * nz - z * ny, z * nx - x * nz, x * ny - y * nx);
    const angle = isFound ? Math.atan2(across, Math.abs(x * nx + y * ny + z * nz)) : Math.PI / 2;
    result[i] = isKnown ? (angle * 180) / Math.PI : NaN;
  }
  return result;
}

/** Root mean square, mean, and the shares over `LIMITS`, of the angles that are numbers. */
export function summary(all) {
  let [count, sum, squares] = [0, 0, 0];
  const over = LIMITS.map(() => 0);
  for (const angle of all) {
    if (Number.isNaN(angle)) continue;
    count++;
    sum += angle;
    squares += angle * angle;
    LIMITS.forEach((limit, i) => (over[i] += angle > limit ? 1 : 0));
  }
  return { rms: Math.sqrt(squares / count), mean: sum / count, over: over.map((value) => value / count) };
}

const isZero = (normals, at) => normals[at] === 0 && normals[at + 1] === 0 && normals[at + 2] === 0;

/** The share of the points with a true normal that have no normal; of those only that have one in `others`, if given. */
export function unresolved(normals, truth, others) {
  let [count, zeros] = [0, 0];
  for (let at = 0; at < normals.length; at += 3) {
    if (isZero(truth, at)) continue;
    count++;
    if (isZero(normals, at) && !(others && isZero(others, at))) zeros++;
  }
  return zeros / count;
}
