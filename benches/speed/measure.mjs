// One measurement, the same in Node and in a browser.

/** As long it takes engines to make the module faster, on processors that the estimate itself needs. */
const WARM_UP = 1000;

/** Runs an estimate several times after some that are not counted, for a second or once; gives the report of each. */
export async function measure(createEstimator, { positions, options, runs, threads }) {
  const estimator = await createEstimator({ threads });
  const run = async () => (await estimator.estimateNormals(positions, options)).report;
  try {
    const start = performance.now();
    do await run();
    while (performance.now() - start < WARM_UP);
    const reports = [];
    while (reports.length < runs) reports.push(await run());
    return reports;
  } finally {
    estimator.dispose();
  }
}

/**
 * The limit: milliseconds of each of some runs that copy the positions into wasm memory, and as much out of it, between
 * arrays that are in use.
 */
export function measureCopy(positions, runs) {
  const { buffer, byteOffset, byteLength } = positions;
  const outside = new Uint8Array(buffer, byteOffset, byteLength);
  const memory = new WebAssembly.Memory({ initial: Math.ceil(byteLength / 65536) });
  const inside = new Uint8Array(memory.buffer, 0, byteLength);
  const normals = new Uint8Array(byteLength);
  const times = [];
  for (let run = 0; run <= runs; run++) {
    const start = performance.now();
    inside.set(outside);
    normals.set(inside);
    if (run > 0) times.push(performance.now() - start);
  }
  return times;
}
