// A cloud to warm up on. Engines compile WebAssembly for speed only while it runs: the first scan after the page was opened
// took half as long again without.

const POINTS = 60_000;
const GOLDEN_ANGLE = Math.PI * (3 - Math.sqrt(5));

/** A ball, smooth above and rough below: each takes a way of its own through the estimator. */
export function warmingCloud(): Float32Array {
  const positions = new Float32Array(3 * POINTS);
  for (let i = 0; i < POINTS; i++) {
    const z = 1 - (2 * i + 1) / POINTS;
    const radius = z > 0 ? 1 : 1 + 0.02 * ((i * 0.7548777) % 1);
    const across = radius * Math.sqrt(1 - z * z);
    positions[3 * i] = across * Math.cos(i * GOLDEN_ANGLE);
    positions[3 * i + 1] = across * Math.sin(i * GOLDEN_ANGLE);
    positions[3 * i + 2] = radius * z;
  }
  return positions;
}
