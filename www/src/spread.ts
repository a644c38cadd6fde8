const GOLDEN = 0.618034;

/**
 * The first `count` indices of a fixed order of `all` points in which every beginning is spread evenly over the whole:
 * steps of the golden ratio. Files are mostly in scan order, so that a plain beginning would be one corner of the scan.
 */
export function spread(all: number, count: number): Uint32Array {
  let step = Math.round(all * GOLDEN);
  while (gcd(step, all) !== 1) step++;
  const order = new Uint32Array(count);
  for (let i = 0, at = 0; i < count; i++) {
    order[i] = at;
    at += step;
    if (at >= all) at -= all;
  }
  return order;
}

/**
 * The index of the `k`th of `count` points that stand for `all`, from the first to the last: one of each run of as many, at a
 * place within it that follows no order of the file, such as the beams of a scanner that fire in turns.
 */
export function nth(k: number, all: number, count: number): number {
  const place = k * GOLDEN;
  return Math.floor((k + place - Math.floor(place)) * (all / count));
}

function gcd(a: number, b: number): number {
  while (b !== 0) [a, b] = [b, a % b];
  return a;
}
