// The measurements: clouds in, rows of plain numbers out. What the paper says, and how a row is shown, is not known here.

import { freeForm, sphere } from '../clouds.mjs';
import { classes } from './classes.mjs';
import { deviations, summary } from './deviation.mjs';

/** What is compared on every cloud. The cubes of 0.4 L are about as many as in the paper's tables (article.mjs). */
export const VARIANTS = {
  '0.4 L': { cell: { scale: 0.4 } },
  '1.0 L': { cell: { scale: 1.0 } },
  '1.5 L': { cell: { scale: 1.5 } },
  '3.0 L': { cell: { scale: 3.0 } },
  auto: { cell: 'auto' },
  knn: { method: 'knn', k: 16 },
  egg: { method: 'egg', k: 8 },
};
/** Those of the paper's method. */
export const OURS = Object.keys(VARIANTS).filter((name) => !VARIANTS[name].method);
/** Those whose points are told apart by the number of their nodes. */
export const CLASSED = ['0.4 L', '1.0 L'];

/** How much is measured. `rounds`: runs of each variant; the baselines take so much longer that every other round does. */
export const FULL = {
  spheres: [187_500, 375_000, 750_000, 1_500_000, 3_000_000],
  freeForm: 712_000,
  sweep: 750_000,
  factors: [0.3, 0.4, 0.5, 0.8, 1, 1.2, 1.5, 2, 2.4, 3, 4, 5, 6],
  leastScan: 100_000,
  rounds: 7,
};
/** For tests: seconds. */
export const SMALL = {
  spheres: [93_750, 187_500],
  freeForm: 40_000,
  sweep: 93_750,
  factors: [0.4, 0.8, 1, 1.2, 1.5, 2, 2.4, 3, 6],
  leastScan: 1_000,
  rounds: 1,
};

/** All experiments; `tell` hears what is being measured. */
export async function measureAll(estimator, { plan, scans, tell }) {
  // The engine compiles what is hot once more, better: not during what counts.
  await compare(estimator, { positions: sphere(50_000) }, { variants: VARIANTS, rounds: 2 });

  const { rounds } = plan;
  const spheres = [];
  for (const points of plan.spheres) {
    tell(`sphere of ${points} points`);
    const positions = sphere(points);
    const ball = { positions, truth: positions };
    const methods = await compare(estimator, ball, { variants: VARIANTS, rounds, classed: CLASSED });
    spheres.push({ name: `${points / 1e6} M`, points, methods });
  }

  tell('free-form surface');
  const patch = freeForm(plan.freeForm);
  const surface = { positions: patch.positions, truth: patch.normals };
  const methods = await compare(estimator, surface, { variants: VARIANTS, rounds });

  const rows = [];
  for (const { name, about, positions } of scans) {
    tell(name);
    const methods = await compare(estimator, { positions }, { variants: VARIANTS, rounds });
    rows.push({ name, about, points: positions.length / 3, methods });
  }

  tell('edge of the cubes');
  const variants = Object.fromEntries(plan.factors.map((scale) => [scale, { cell: { scale } }]));
  const positions = sphere(plan.sweep);
  const clouds = { sphere: { positions, truth: positions }, 'free-form surface': surface };
  const largest = scans.at(-1);
  if (largest) clouds[largest.name] = largest;
  const sweep = [];
  for (const [name, cloud] of Object.entries(clouds)) {
    const measured = await compare(estimator, cloud, { variants, rounds });
    const steps = plan.factors.map((factor) => ({ factor, ...measured[factor] }));
    sweep.push({ name, points: cloud.positions.length / 3, steps });
  }
  return {
    rounds,
    spheres,
    freeForm: { name: 'free-form surface', points: plan.freeForm, methods },
    scans: rows,
    sweep,
  };
}

/**
 * Runs all variants on a cloud in turn, round by round, so that whatever else the machine does hits all of them. For
 * each the medians of its times in milliseconds: `module`, the sum of the phases inside the wasm module; `total`, what
 * the caller waits for, with copies in and out. With `truth`, the true normals, also the errors.
 */
async function compare(estimator, { positions, truth }, { variants, rounds, classed = [] }) {
  const measured = {};
  for (let round = 0; round < rounds; round++) {
    for (const [name, options] of Object.entries(variants)) {
      if (options.method && round % 2 === 1) continue;
      const { normals, report } = await estimator.estimateNormals(positions, options);
      measured[name] ??= {
        reports: [],
        ...(truth && judge(positions, truth, normals, report, classed.includes(name))),
      };
      measured[name].reports.push(report);
    }
  }
  return Object.fromEntries(
    Object.entries(measured).map(([name, { reports, ...errors }]) => [name, { ...times(reports), ...errors }]),
  );
}

function judge(positions, truth, normals, report, isClassed) {
  const errors = deviations(normals, truth);
  return { error: summary(errors), ...(isClassed && byClass(classes(positions, report), errors, report)) };
}

/** Share and mean error of the points from 0 to 4 nodes; and how many points the report counts in another class. */
function byClass(classOf, errors, { points, nodesUsed }) {
  const all = nodesUsed.map((_, nodes) => ({ nodes, points: 0, sum: 0 }));
  classOf.forEach((nodes, i) => {
    all[nodes].points++;
    all[nodes].sum += errors[i];
  });
  return {
    classes: all.map(({ nodes, points: count, sum }) => ({ nodes, count, share: count / points, error: sum / count })),
    miscounted: all.reduce((sum, { points: count }, nodes) => sum + Math.abs(count - nodesUsed[nodes]), 0) / 2,
  };
}

function times(reports) {
  const { milliseconds, ...facts } = reports[0];
  const phases = Object.keys(milliseconds).filter((phase) => phase !== 'total');
  const sums = reports.map((report) => phases.reduce((sum, phase) => sum + report.milliseconds[phase], 0));
  return {
    ...facts,
    module: median(sums),
    total: median(reports.map((report) => report.milliseconds.total)),
    phases: Object.fromEntries(
      phases.map((phase) => [phase, median(reports.map((report) => report.milliseconds[phase]))]),
    ),
    /** Half the range of the runs, against their median. */
    spread: (Math.max(...sums) - Math.min(...sums)) / 2 / median(sums),
  };
}

export function median(values) {
  const ascending = [...values].sort((a, b) => a - b);
  return (ascending[(values.length - 1) >> 1] + ascending[values.length >> 1]) / 2;
}

/** The exponent of the power law that fits some (x, y) best on logarithmic axes: 1 is linear. */
export function exponent(pairs) {
  const logs = pairs.map((pair) => pair.map(Math.log));
  const [meanX, meanY] = [0, 1].map((i) => logs.reduce((sum, pair) => sum + pair[i], 0) / logs.length);
  const along = logs.reduce((sum, [x]) => sum + (x - meanX) ** 2, 0);
  return logs.reduce((sum, [x, y]) => sum + (x - meanX) * (y - meanY), 0) / along;
}
