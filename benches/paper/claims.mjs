// What the paper claims, held against the rows of experiments.mjs: each claim holds or does not, by a rule in numbers.

import * as article from './article.mjs';
import { CLASSED, OURS, exponent } from './experiments.mjs';
import { count, error, milliseconds, percent, range, ratio } from './format.mjs';

/** The issue's bar: our method against our own baselines, so many times faster on every row. */
export const BAR = { knn: 10, egg: 20 };

/** All clouds whose methods were compared, in the order of the report. */
export const compared = ({ spheres, freeForm, scans }) => [...spheres, freeForm, ...scans];

/** How many times as long as `variant` a baseline takes on each cloud; `clock` is `module` or `total`. */
export const ratios = (clouds, baseline, variant, clock = 'module') =>
  clouds.map(({ methods }) => methods[baseline][clock] / methods[variant][clock]);

/** For each size of the cubes the ratios, on how many clouds they reach the bar, and of how many. */
export function bar(rows) {
  const clouds = compared(rows);
  return OURS.map((variant) => {
    const reached = Object.entries(BAR).map(([baseline, least]) => {
      const values = ratios(clouds, baseline, variant);
      const totals = ratios(clouds, baseline, variant, 'total');
      return [baseline, { values, totals, met: values.filter((value) => value >= least).length }];
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
  const smallest = spheres[0].methods;
  return {
    claim: 'On spheres so many points are interpolated from 4, 3 and 2 nodes (within 5 points of 100).',
    paper: article.CLASSES.map(({ share }) => percent(share)).join(', '),
    here: CLASSED.map((variant) => `${found(variant).join(', ')} at ${variant}`).join('; '),
    holds: spheres.every(isNear),
    why:
      `The smaller the cubes, the fewer nodes are good: on ${count(smallest.auto.points)} points ` +
      `${percent(smallest['1.0 L'].nodes / smallest['1.0 L'].cells)} of the cubes hold theirs at 1.0 L ` +
      `(${(smallest['1.0 L'].points / smallest['1.0 L'].cells).toFixed(1)} points a cube), ` +
      `and a column with two occupied cubes needs only one of them; at 0.4 L ` +
      `(${(smallest['0.4 L'].points / smallest['0.4 L'].cells).toFixed(1)} points a cube) the shares come near the paper's.`,
  };
}

function order({ spheres }) {
  const rows = spheres.flatMap(({ methods }) => CLASSED.map((variant) => methods[variant].classes));
  const enough = rows.map((classes) => classes.filter(({ nodes, count }) => nodes >= 2 && count >= 100));
  const errors = (nodes) => enough.flatMap((classes) => classes.filter((c) => c.nodes === nodes).map((c) => c.error));
  return {
    claim: 'The fewer the nodes, the larger the mean error (from classes of at least 100 points).',
    paper: article.CLASSES.map(({ nodes, error }) => `${error} (${nodes})`).join(', '),
    here: article.CLASSES.filter(({ nodes }) => errors(nodes).length > 0)
      .map(({ nodes }) => `${range(errors(nodes), error)} (${nodes})`)
      .join(', '),
    holds: enough.every((classes) => classes.every(({ error }, i) => i === 0 || classes[i - 1].error > error)),
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

function settles({ sweep: [sphere] }) {
  const time = (factor) => step(sphere, factor).module;
  const [before, after] = [time(article.TIME_SETTLES) / time(1), time(3) / time(article.TIME_SETTLES)];
  const finest = sphere.steps[0];
  return {
    claim: 'Up to 2.0 L the time falls sharply (by a third or more), from there to 3.0 L it stays (within 15 %).',
    paper: 'a curve without numbers',
    here: `times ${before.toFixed(2)} from 1.0 to 2.0 L, ${after.toFixed(2)} from 2.0 to 3.0 L`,
    holds: before < 2 / 3 && Math.abs(after - 1) < 0.15,
    why: `What falls is the time of the nodes, ${percent(step(sphere, 1).phases.nodes / time(1))} of the time at 1.0 L and ${percent(finest.phases.nodes / finest.module)} at ${finest.factor} L: sorting and interpolating the points takes about the same time at any size.`,
  };
}

function grows({ sweep: [sphere] }) {
  const mean = (factor) => step(sphere, factor).error.mean;
  const [before, after] = [mean(article.ERROR_GROWS) / mean(1.5), mean(6) / mean(article.ERROR_GROWS)];
  return {
    claim: 'Above 3.0 L the error grows greatly (doubling the edge more than doubles it).',
    paper: 'so it says',
    here: `times ${after.toFixed(1)} from 3.0 to 6.0 L; times ${before.toFixed(1)} already from 1.5 to 3.0 L`,
    holds: after > 2,
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
