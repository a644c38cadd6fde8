// How far normals are from the true ones, sign aside.

import { angles } from '../accuracy/judge.mjs';

/** How long the difference is of two unit vectors so many degrees apart. */
const chord = (degrees) => 2 * Math.sin((degrees * Math.PI) / 360);

/** The deviation |n - n_true| of every point, of the sign that makes it smaller; a zero normal counts as a right angle. */
export const deviations = (normals, truth) => angles(normals, truth).map(chord);

const degrees = (deviation) => (2 * Math.asin(deviation / 2) * 180) / Math.PI;
/** Normals that are farther off count as wrong. */
export const WRONG = 10;

/** Mean and root mean square, the median, the worst angle in degrees, and the share that is more than `WRONG` degrees off. */
export function summary(values) {
  let [sum, squares, worst, wrong] = [0, 0, 0, 0];
  const limit = chord(WRONG);
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
