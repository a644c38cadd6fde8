// What the paper claims, held against the rows of experiments.mjs: each claim holds or does not, by a rule in numbers.

import * as article from './article.mjs';
import { median } from '../median.mjs';
import { CLASSED, OURS, exponent } from './experiments.mjs';
import { error, milliseconds, percent, range, ratio } from '../format.mjs';

/** Our own bar: our method is so many times faster than our baselines on every row. */
export const BAR = { knn: 10, egg: 20 };

/** All clouds whose methods were compared, in the order of the report. */
export const compared = ({ spheres, freeForm, scans }) => [...spheres, freeForm, ...scans];

/**
 * How many times as long as `variant` a baseline takes on each cloud; `clock` is `module` or `total`, for the median of the
 * ratios round by round, as what a round meets it meets in both; or `fastest`.
 */
export const ratios = (clouds, baseline, variant, clock = 'module') =>
  clouds.map(({ methods: { [baseline]: slow, [variant]: fast } }) =>
    clock === 'fastest'
      ? slow.fastest / fast.fastest
      : median(slow.rounds[clock].map((time, round) => time / fast.rounds[clock][round]).filter(Number.isFinite)),
  );

/** For each size of the cubes the ratios, on how many clouds they reach the bar, and of how many. */
export function bar(rows) {
  const clouds = compared(rows);
  return OURS.map((variant) => {
    const reached = Object.entries(BAR).map(([baseline, least]) => {
      const [values, fastest, totals] = ['module', 'fastest', 'total'].map((clock) =>
        ratios(clouds, baseline, variant, clock),
      );
      return [baseline, { values, fastest, totals, met: values.filter((value) => value >= least).length }];
    });
    return { variant, clouds: clouds.length, ...Object.fromEntries(reached) };
  });
}

/** `{ claim, paper, here, holds, why }`: `why` says where a difference comes from, and may be missing. */
export function claims(rows) {
  return [deviation, shares, order, againstEgg, againstEnn, linear, settles, grows, advice, few, split, cubes].map(
    (check) => check(rows),
  );
}

function deviation({ spheres }) {
  const means = spheres.map(({ methods }) => methods['1.0 L'].error.mean);
  const larger = spheres.map(({ methods }) => methods['1.5 L'].error.mean);
  return {
    claim: 'On spheres the mean deviation stays below a bound.',
    paper: `below ${article.DEVIATION}`,
    here: `${range(means, error)} at 1.0 L, ${range(larger, error)} at 1.5 L`,
    holds: [...means, ...larger].every((mean) => mean < article.DEVIATION),
  };
}

const shareOf = (methods, variant, nodes) => methods[variant].nodesUsed[nodes] / methods[variant].points;

/** Of the spheres at all sizes of `CLASSED` the one with the fewest points in a cube, one between, and the fullest. */
function byFilling(spheres) {
  const all = spheres.flatMap(({ points, methods }) =>
    CLASSED.map((variant) => ({ points, method: methods[variant] })),
  );
  const filling = ({ points, method }) => points / method.cells;
  all.sort((a, b) => filling(a) - filling(b));
  return [all[0], all[all.length >> 1], all.at(-1)].map((one) => ({ ...one, filling: filling(one).toFixed(1) }));
}

function shares({ spheres }) {
  const found = (variant) =>
    article.CLASSES.map(({ nodes }) =>
      range(
        spheres.map(({ methods }) => shareOf(methods, variant, nodes)),
        percent,
      ),
    );
  const isNear = ({ methods }) =>
    article.CLASSES.every(({ nodes, share }) => Math.abs(shareOf(methods, '1.0 L', nodes) - share) < 0.05);
  return {
    claim: 'On spheres so many points are interpolated from 4, 3 and 2 nodes (within 5 percentage points).',
    paper: article.CLASSES.map(({ share }) => percent(share)).join(', '),
    here: CLASSED.map((variant) => `${found(variant).join(', ')} at ${variant}`).join('; '),
    holds: spheres.every(isNear),
    why: `What counts is how many points a cube holds. From four nodes are interpolated: ${byFilling(spheres)
      .map(({ points, filling, method }) => `${percent(method.nodesUsed[4] / points)} with ${filling} points a cube`)
      .join(', ')}. A cube that the surface only grazes is empty when points are few, and an empty cube has no node.`,
  };
}

function order({ spheres }) {
  const rows = spheres.flatMap(({ name, methods }) =>
    CLASSED.map((variant) => {
      const enough = methods[variant].classes.filter(({ nodes, count }) => nodes >= 2 && count >= 100).reverse();
      return {
        name: `${name} at ${variant}`,
        enough,
        isOrdered: enough.every((c, i) => !i || c.error > enough[i - 1].error),
      };
    }),
  );
  const errors = (nodes) => rows.flatMap(({ enough }) => enough.filter((c) => c.nodes === nodes).map((c) => c.error));
  const broken = rows.filter(({ isOrdered }) => !isOrdered);
  const cost = byFilling(spheres).map(
    ({ method: { classes }, filling }) =>
      `${(classes[3].error / classes[4].error).toFixed(2)} times the error with ${filling} points a cube`,
  );
  return {
    claim: 'The fewer the nodes, the larger the mean error (classes of at least 100 points).',
    paper: article.CLASSES.map(({ nodes, error }) => `${error} (${nodes})`).join(', '),
    here: article.CLASSES.filter(({ nodes }) => errors(nodes).length > 0)
      .map(({ nodes }) => `${range(errors(nodes), error)} (${nodes})`)
      .join(', '),
    holds: broken.length === 0,
    why:
      `It is so on ${rows.length - broken.length} of ${rows.length} rows` +
      (broken.length > 0 ? `, not on ${broken.map(({ name }) => name).join(', ')}. ` : '. ') +
      `The more points the other nodes rest on, the less a missing one costs: three against four have ${cost.join(', ')}.`,
  };
}

function againstEgg(rows) {
  const values = ratios(compared(rows), 'egg', '1.0 L');
  const printed = article.TABLE.map(({ egg, one }) => egg / one);
  return {
    claim: 'EGG takes more than three times as long, on every cloud.',
    paper: `${article.FASTER_THAN_EGG.join(' to ')} times; its table: ${range(printed, ratio)}`,
    here: `${range(values, ratio)} times at 1.0 L, ${range(ratios(compared(rows), 'egg', '0.4 L'), ratio)} at 0.4 L`,
    holds: [...values, ...ratios(compared(rows), 'egg', '0.4 L')].every((value) => value > article.FASTER_THAN_EGG[0]),
    why: 'The 27 cubes are summed up from ten sums each, without looking at their points again, and no matrix is decomposed by iteration.',
  };
}

function againstEnn({ freeForm }) {
  const printed = article.FREE_FORM.enn / article.FREE_FORM.milliseconds;
  const value = (variant) => ratios([freeForm], 'knn', variant)[0];
  return {
    claim: 'On the free-form surface ENN takes so many times as long, or more.',
    paper: ratio(printed),
    here: `${ratio(value('1.0 L'))} at 1.0 L, ${ratio(value('0.4 L'))} at 0.4 L`,
    holds: value('1.0 L') >= printed && value('0.4 L') >= printed,
  };
}

function linear({ spheres }) {
  const power = (variant) => exponent(spheres.map(({ points, methods }) => [points, methods[variant].module]));
  return {
    claim: 'On spheres the time is linear in the number of points (exponent of the fit within 0.1 of 1).',
    paper: 'linear',
    here: `exponent ${['1.0 L', '1.5 L'].map((variant) => `${power(variant).toFixed(2)} at ${variant}`).join(', ')}; ENN ${power('knn').toFixed(2)}, EGG ${power('egg').toFixed(2)}`,
    holds: ['1.0 L', '1.5 L'].every((variant) => Math.abs(power(variant) - 1) < 0.1),
  };
}

/** The step of a sweep at a factor. */
const step = ({ steps }, wanted) => steps.find(({ factor }) => factor === wanted);

/** In the paper's own unit, that of its cube counts. */
const own = (factor) => Math.round(10 * article.scaleOf(article.FREE_FORM) * factor) / 10;

function settles({ sweep: [sphere] }) {
  const fall = (from, to) => step(sphere, to).module / step(sphere, from).module;
  const [first, settled, last] = [1, article.TIME_SETTLES, article.ERROR_GROWS];
  const [before, after] = [fall(first, settled), fall(settled, last)];
  const edges = [sphere.steps[0].factor, first, last];
  const phase = (name) =>
    `${name} ${edges.map((factor) => milliseconds(step(sphere, factor).phases[name])).join(', ')}`;
  return {
    claim: 'From 1.0 to 2.0 L the time falls sharply (by a third or more), from there to 3.0 L it stays (within 15 %).',
    paper: 'a curve without numbers',
    here:
      `times ${before.toFixed(2)} and ${after.toFixed(2)}; in the unit of its cube counts, ` +
      `${own(first)}, ${own(settled)} and ${own(last)} L, times ${fall(own(first), own(settled)).toFixed(2)} and ${fall(own(settled), own(last)).toFixed(2)}`,
    holds: before < 2 / 3 && Math.abs(after - 1) < 0.15,
    why:
      `What is done for each cube falls with the number of cubes, what is done for each point stays; in milliseconds at ` +
      `${edges.join(', ')} L: ${['sort', 'nodes', 'interpolation'].map(phase).join('; ')}.`,
  };
}

function grows({ sweep: [sphere] }) {
  const growth = (from, to) => step(sphere, to).error.mean / step(sphere, from).error.mean;
  const limit = article.ERROR_GROWS;
  return {
    claim: 'Above 3.0 L the error grows greatly (twice the edge, more than twice the error).',
    paper: 'a curve without numbers',
    here:
      `times ${growth(limit, 2 * limit).toFixed(1)} from 3.0 to 6.0 L, but times ${growth(limit / 2, limit).toFixed(1)} already from 1.5 to 3.0 L; ` +
      `in the unit of its cube counts, from ${own(limit)} to ${2 * own(limit)} L, times ${growth(own(limit), 2 * own(limit)).toFixed(1)}`,
    holds: growth(limit, 2 * limit) > 2,
  };
}

function advice({ sweep: [sphere] }) {
  const [here, settled] = [step(sphere, article.ADVICE), step(sphere, article.TIME_SETTLES)];
  return {
    claim: '1.5 L is both fast (within a quarter of the time at 2.0 L) and accurate (below the bound on spheres).',
    paper: 'its advice',
    here: `times ${(here.module / settled.module).toFixed(2)} of the time at 2.0 L, mean deviation ${error(here.error.mean)}`,
    holds: here.module < 1.25 * settled.module && here.error.mean < article.DEVIATION,
  };
}

function few(rows) {
  const share = ({ methods }, variant) => methods[variant].nodes / methods[variant].points;
  const at = (variant) => compared(rows).map((row) => share(row, variant));
  return {
    claim: 'There are far fewer nodes than points, less than a third, on every cloud at 1.0 L.',
    paper: `its table: ${range(
      article.TABLE.map(({ nodes, points }) => nodes / points),
      percent,
    )}`,
    here: `${range(at('1.0 L'), percent)} at 1.0 L, ${range(at('0.4 L'), percent)} at 0.4 L`,
    holds: at('1.0 L').every((value) => value < 1 / 3),
  };
}

function split({ freeForm: { methods } }) {
  const printed = article.FREE_FORM.interpolation / article.FREE_FORM.milliseconds;
  const share = (variant) => methods[variant].phases.interpolation / methods[variant].module;
  const { nodes, interpolation } = methods['0.4 L'].phases;
  return {
    claim: 'On the free-form surface interpolation is the smaller part of the time (below a half).',
    paper: `${percent(printed)}: ${article.FREE_FORM.interpolation} of ${article.FREE_FORM.milliseconds} ms`,
    here: `${percent(share('1.0 L'))} at 1.0 L, ${percent(share('0.4 L'))} at 0.4 L`,
    holds: share('1.0 L') < 0.5 && share('0.4 L') < 0.5,
    why: `There is no neighbour search: at 0.4 L all nodes take ${milliseconds(nodes)} ms, the interpolation ${milliseconds(interpolation)} ms. What costs most in the paper costs little here.`,
  };
}

const filling = ({ points, grid: [x, y, z] }) => (x * y * z) / points;

function cubes(rows) {
  const printed = [article.FREE_FORM, ...article.TABLE].map(filling);
  const scales = [article.FREE_FORM, ...article.TABLE].map(article.scaleOf);
  const ours = compared(rows).map(({ methods }) => filling(methods['1.0 L']));
  return {
    claim: 'At 1.0 L, by Eq. 1, the box holds as many cubes as there are points (less than twice as many).',
    paper: `its tables: ${range(printed, ratio)} times as many`,
    here: `${range(ours, ratio)} times as many`,
    holds: [...printed, ...ours].every((value) => value < 2),
    why: `So the cubes that the paper calls 1.0 L have an edge of ${range(scales, (value) => value.toFixed(2))} of what its Eq. 1 says: the rows at 0.4 L are the ones to hold against its tables.`,
  };
}
