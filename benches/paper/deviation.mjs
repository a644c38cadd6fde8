// How far normals are from the true ones, sign aside.

/**
 * The deviation |n - n_true| of every point, of the sign that makes it smaller. `truth` need not have length one; a zero
 * normal counts as a right angle.
 */
export function deviations(normals, truth) {
  const result = new Float64Array(normals.length / 3);
  for (let i = 0, at = 0; i < result.length; i++, at += 3) {
    const [x, y, z] = [truth[at], truth[at + 1], truth[at + 2]];
    const [nx, ny, nz] = [normals[at], normals[at + 1], normals[at + 2]];
    // By the cross product: the cosine of a small angle has no digits left.
    const across = Math.hypot(y * nz - z * ny, z * nx - x * nz, x * ny - y * nx);
    const along = Math.abs(x * nx + y * ny + z * nz);
    const angle = across === 0 && along === 0 ? Math.PI / 2 : Math.atan2(across, along);
    result[i] = 2 * Math.sin(angle / 2);
  }
  return result;
}

const degrees = (deviation) => (2 * Math.asin(deviation / 2) * 180) / Math.PI;
/** Normals that are farther off count as wrong. */
export const WRONG = 10;

/** Mean and root mean square, the median, the worst angle in degrees, and the share that is more than `WRONG` degrees off. */
export function summary(values) {
  let [sum, squares, worst, wrong] = [0, 0, 0, 0];
  const limit = 2 * Math.sin((WRONG * Math.PI) / 360);
  for (const value of values) {
    sum += value;
    squares += value * value;
    worst = Math.max(worst, value);
    wrong += value > limit ? 1 : 0;
  }
  const count = values.length;
  return {
    mean: sum / count,
    rms: Math.sqrt(squares / count),
    median: Float64Array.from(values).sort()[count >> 1],
    worst: degrees(worst),
    wrong: wrong / count,
  };
}
