// One measurement, the same in Node and in a browser.

/** Runs an estimate several times after one that is not counted; gives the report of each. */
export async function measure(createEstimator, { positions, cell, runs, threads }) {
  const estimator = await createEstimator({ threads });
  try {
    const reports = [];
    for (let run = 0; run <= runs; run++) {
      const { report } = await estimator.estimateNormals(positions, { cell });
      if (run > 0) reports.push(report);
    }
    return reports;
  } finally {
    estimator.dispose();
  }
}
