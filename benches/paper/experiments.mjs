// The measurements: clouds in, rows of plain numbers out. What the paper says, and how a row is shown, is not known here.

import { freeForm, sphere } from '../clouds.mjs';
import { median } from '../median.mjs';
import { SPHERES } from './article.mjs';
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

/**
 * How much is measured. `rounds`: runs of each variant; the baselines take so much longer that every other round does. A run
 * is as many estimates as it takes to fill `least` milliseconds: the processor's speed changes within tens of these, and
 * what is short must not meet other conditions than what is long.
 */
export const FULL = {
  spheres: SPHERES,
  freeForm: 712_000,
  sweep: 750_000,
  factors: [0.3, 0.4, 0.5, 0.8, 1, 1.2, 1.5, 2, 2.4, 3, 4, 5, 6],
  leastScan: 100_000,
  rounds: 7,
  least: 150,
};
/** For tests: seconds. */
export const SMALL = {
  spheres: [93_750, 187_500],
  freeForm: 40_000,
  sweep: 93_750,
  factors: [0.4, 0.8, 1, 1.2, 1.5, 2, 2.4, 3, 6],
  leastScan: 1_000,
  rounds: 1,
  least: 0,
};

/** All experiments; `tell` hears what is being measured. */
export async function measureAll(estimator, { plan, scans, tell }) {
  const patch = freeForm(plan.freeForm);
  const surface = { name: 'free-form surface', positions: patch.positions, truth: patch.normals };
  const clouds = [...plan.spheres.map((points) => ball(`${points / 1e6} M`, points, CLASSED)), surface, ...scans];
  const { rounds, least } = plan;
  // The engine compiles what is hot once more, better: not during what counts.
  await compare(estimator, [ball('warm-up', 50_000)], { variants: VARIANTS, rounds: 2, least: 0, tell: () => {} });
  const compared = await compare(estimator, clouds, { variants: VARIANTS, rounds, least, tell });

  const factors = Object.fromEntries(plan.factors.map((scale) => [scale, { cell: { scale } }]));
  const swept = [ball('sphere', plan.sweep), surface, ...scans.slice(-1)];
  const sweep = await compare(estimator, swept, { variants: factors, rounds, least, tell });
  return {
    rounds,
    least,
    spheres: compared.slice(0, plan.spheres.length),
    freeForm: compared[plan.spheres.length],
    scans: compared.slice(plan.spheres.length + 1),
    sweep: sweep.map(({ methods, ...cloud }) => ({
      ...cloud,
      steps: plan.factors.map((factor) => ({ factor, ...methods[factor] })),
    })),
  };
}

/** A sphere, whose true normals are its points. */
function ball(name, points, classed = []) {
  const positions = sphere(points);
  return { name, positions, truth: positions, classed };
}

/**
 * Runs all variants on all clouds in turn, round by round, so that whatever else the machine does hits all of them. A
 * cloud with `truth`, the true normals, gets errors too; `classed` are the variants whose points are told apart by nodes.
 */
async function compare(estimator, clouds, { variants, rounds, least, tell }) {
  const rows = clouds.map(({ name, about, positions }) => ({ name, about, points: positions.length / 3, methods: {} }));
  for (let round = 0; round < rounds; round++) {
    for (const [i, { positions, truth, classed = [] }] of clouds.entries()) {
      tell(`round ${round + 1} of ${rounds}: ${rows[i].name}`);
      for (const [name, options] of Object.entries(variants)) {
        if (options.method && round % 2 === 1) continue;
        const { normals, report } = await run(estimator, positions, options, least);
        const errors = () => truth && judge(positions, truth, normals, report, classed.includes(name));
        rows[i].methods[name] ??= { reports: [], errors: errors() };
        rows[i].methods[name].reports[round] = report;
      }
    }
  }
  for (const { methods } of rows) {
    for (const [name, { reports, errors }] of Object.entries(methods)) methods[name] = { ...times(reports), ...errors };
  }
  return rows;
}

/** One estimate after the other until `least` milliseconds have passed: the last, with the medians of their times. */
async function run(estimator, positions, options, least) {
  const all = [];
  const start = performance.now();
  let result;
  do {
    result = await estimator.estimateNormals(positions, options);
    all.push(result.report.milliseconds);
  } while (performance.now() - start < least);
  const middle = (phase) => median(all.map((milliseconds) => milliseconds[phase]));
  const milliseconds = Object.fromEntries(Object.keys(all[0]).map((phase) => [phase, middle(phase)]));
  return { normals: result.normals, report: { ...result.report, milliseconds } };
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

/**
 * Medians of the runs of some rounds, in milliseconds: `module`, the sum of the phases inside the wasm module, of which
 * there is also the `fastest`; `total`, what the caller waits for, with copies in and out. Both round by round too, with
 * gaps where there was no run: `rounds`. And what the report tells besides.
 */
function times(byRound) {
  const reports = byRound.filter(Boolean);
  const { milliseconds, ...facts } = reports[0];
  const phases = Object.keys(milliseconds).filter((phase) => phase !== 'total');
  const sum = (report) => phases.reduce((sum, phase) => sum + report.milliseconds[phase], 0);
  const sums = reports.map(sum);
  return {
    ...facts,
    module: median(sums),
    fastest: Math.min(...sums),
    total: median(reports.map((report) => report.milliseconds.total)),
    rounds: { module: byRound.map(sum), total: byRound.map((report) => report.milliseconds.total) },
    phases: Object.fromEntries(
      phases.map((phase) => [phase, median(reports.map((report) => report.milliseconds[phase]))]),
    ),
    /** Half the range of the runs, against their median. */
    spread: (Math.max(...sums) - Math.min(...sums)) / 2 / median(sums),
  };
}

/** The exponent of the power law that fits some (x, y) best on logarithmic axes: 1 is linear. */
export function exponent(pairs) {
  const logs = pairs.map((pair) => pair.map(Math.log));
  const [meanX, meanY] = [0, 1].map((i) => logs.reduce((sum, pair) => sum + pair[i], 0) / logs.length);
  const along = logs.reduce((sum, [x]) => sum + (x - meanX) ** 2, 0);
  return logs.reduce((sum, [x, y]) => sum + (x - meanX) * (y - meanY), 0) / along;
}
