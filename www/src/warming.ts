// A cloud to warm up on. Engines compile WebAssembly for speed only while it runs: the first scan after the page was opened
// took half as long again without.
import { onSphere } from './spiral';

const POINTS = 60_000;

/** A ball, smooth above and rough below: each takes a way of its own through the estimator. */
export function warmingCloud(): Float32Array {
  const positions = new Float32Array(3 * POINTS);
  for (let i = 0; i < POINTS; i++) {
    const place = onSphere(i, POINTS);
    const radius = place[2] > 0 ? 1 : 1 + 0.02 * ((i * 0.7548777) % 1);
    positions.set(
      place.map((coordinate) => radius * coordinate),
      3 * i,
    );
  }
  return positions;
}
