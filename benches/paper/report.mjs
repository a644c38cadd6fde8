// Rows to text: docs/paper.md, and its charts.

import * as article from './article.mjs';
import { chart } from './chart.mjs';
import { BAR, bar, claims, compared, ratios } from './claims.mjs';
import { median } from '../median.mjs';
import { CLASSED, OURS, VARIANTS } from './experiments.mjs';
import { count, degrees, error, millions, milliseconds, paragraphs, percent, range, ratio, table } from '../format.mjs';
import { WRONG } from './deviation.mjs';

const BASELINES = { knn: 'ENN', egg: 'EGG' };
/** What the paper calls 1.0 L, by the cubes that it counts. */
const PRINTED_SCALE = article.scaleOf(article.FREE_FORM);
const label = (variant) => BASELINES[variant] ?? variant;
const image = ({ file, title }) => `![${title}](paper/${file})`;

/** The charts, `{ name: SVG }`. */
export function charts({ spheres, scans, sweep }) {
  const axes = { x: { label: 'points', log: true }, y: { label: 'milliseconds', log: true } };
  const curves = (clouds, style) =>
    [
      ['1.0 L', 'this package, 1.0 L'],
      ['0.4 L', 'this package, 0.4 L'],
      ['knn', 'ENN, k = 16'],
      ['egg', 'EGG, k = 8'],
    ].map(([variant, name]) => ({
      name,
      style,
      points: clouds.map(({ points, methods }) => [points, methods[variant].module]),
    }));
  const printed = (key, name) => ({
    name,
    style: 'dashed',
    points: article.TABLE.map((row) => [row.points, row[key]]),
  });
  const factors = { label: 'edge of the cubes in multiples of L', log: true, ticks: [0.3, 0.5, 1, 1.5, 2, 3, 4, 6] };
  const band = { from: PRINTED_SCALE, to: 3 * PRINTED_SCALE, label: 'paper’s “1.0–3.0 L”' };
  const steps = (clouds, value) =>
    clouds.map(({ name, points, steps }) => ({
      name,
      points: steps.map((step) => [step.factor, value(step, points)]),
    }));
  return {
    'time-spheres': chart({ title: 'Time against points: spheres', ...axes, series: curves(spheres) }),
    ...(scans.length > 0 && {
      'time-scans': chart({
        title: 'Time against points: scans',
        ...axes,
        series: [...curves(scans, 'dots'), printed('one', 'paper, “1.0 L”, i5'), printed('egg', 'paper, EGG, i5')],
      }),
    }),
    'time-edge': chart({
      title: 'Time against the edge of the cubes',
      x: factors,
      y: { label: 'nanoseconds a point' },
      series: steps(sweep, ({ module }, points) => (1e6 * module) / points),
      band,
    }),
    'error-edge': chart({
      title: 'Mean deviation against the edge of the cubes',
      x: factors,
      y: { label: 'mean |n - n_true|', log: true },
      series: steps(
        sweep.filter(({ steps }) => steps[0].error),
        ({ error }) => error.mean,
      ),
      band,
    }),
  };
}

/** The whole text. `pictures` are missing where there is no browser; `skipped` are files that were not measured. */
export function report(rows, { machine, minutes, pictures, skipped, hasFolder }) {
  const { model, cores, node, date } = machine;
  const spreads = compared(rows).flatMap(({ methods }) => Object.values(methods).map(({ spread }) => spread));
  return `${paragraphs(
    '# The paper, reproduced',
    '“An Investigation of the High Efficiency Estimation Approach of the Large-Scale Scattered Point Cloud Normal Vector”, its experiments with this package. Written by `npm run paper`, text and all; not to be edited.',
    `${model}, ${cores} cores, Node ${node}, ${date}; took ${minutes.toFixed(1)} minutes. All times are of the single-threaded WebAssembly build in Node, on one core, in milliseconds: the phases inside the module, for all methods alike. The clouds lie in memory in random order, scans in that of their files. Each time is the median of ${rows.rounds} runs, of ENN and EGG ${Math.ceil(rows.rounds / 2)}, in turn with each other, a run being the median of as many estimates as ${rows.least} ms hold; half of them spread by less than ±${percent(median(spreads))}, the widest by ±${percent(Math.max(...spreads))}. The paper’s times are from an ${article.MACHINE}.`,
    "**ENN** is `method: 'knn'` with k = 16, **EGG** is `method: 'egg'` with k = 8; **L** is that of the paper’s Eq. 1, so that “1.0 L” is `cell: { scale: 1 }`, and **auto** is what the package does by itself. Errors are the paper’s deviation |n - n_true|, sign aside.",
    '## What the paper claims',
    claimed(rows),
    '## Our bar',
    measuredBar(rows),
    '## Spheres (Figures 6 and 7b)',
    spheres(rows, pictures),
    '## How many nodes a point has',
    nodes(rows),
    '## A free-form surface (Figure 4)',
    surface(rows, pictures),
    '## The edge of the cubes (Figure 8)',
    edge(rows),
    '## Scans (Table 1, Figures 5 and 7a)',
    scans(rows, { pictures, skipped, hasFolder }),
    pictures ? undefined : 'No pictures: there was no browser to take them.',
  )}\n`;
}

function claimed(rows) {
  const all = claims(rows);
  const held = all.filter(({ holds }) => holds).length;
  const reasons = all.filter(({ why }) => why).map(({ claim, why }) => `- *${claim}* ${why}`);
  return paragraphs(
    `${held} of ${all.length} hold.`,
    table(
      ['claim, as it is checked', 'paper', 'here', ''],
      all.map(({ claim, paper, here, holds }) => [claim, paper, here, holds ? 'holds' : '**does not hold**']),
    ).replace('| --- | --: | --: | --: |', '| --- | --- | --- | --- |'),
    reasons.join('\n'),
  );
}

function measuredBar(rows) {
  const all = bar(rows);
  const toEnn = (cloud) => ratios([cloud], 'knn', '1.0 L')[0];
  const order = compared(rows).sort((a, b) => toEnn(a) - toEnn(b));
  const named = (name) => (rows.spheres.some((sphere) => sphere.name === name) ? `the sphere of ${name}` : name);
  const filled = ({ name, points, methods }) =>
    `${named(name)} (${(points / methods['1.0 L'].cells).toFixed(1)} points a cube)`;
  const names = (met) => all.filter(met).map(({ variant }) => variant);
  const verdict = (baseline) => {
    const met = names((row) => row[baseline].met === row.clouds);
    const missed = names((row) => row[baseline].met < row.clouds);
    return (
      `${BAR[baseline]} times faster than ${BASELINES[baseline]} on every row: ` +
      [met.length && `met at ${met.join(', ')}`, missed.length && `**missed** at ${missed.join(', ')}`]
        .filter(Boolean)
        .join('; ')
    );
  };
  return paragraphs(
    `Wanted: at least ${BAR.knn} times faster than our own ENN and at least ${BAR.egg} times faster than our own EGG on every row of this page, WebAssembly on one thread against the same. ${verdict('knn')}. ${verdict('egg')}.`,
    table(
      [
        'cubes',
        'times faster than ENN',
        `at least ${BAR.knn}`,
        'than EGG',
        `at least ${BAR.egg}`,
        'fastest runs: ENN',
        'EGG',
        'with copies: ENN',
        'EGG',
      ],
      all.map(({ variant, clouds, knn, egg }) => [
        variant,
        range(knn.values, ratio),
        `${knn.met} of ${clouds}`,
        range(egg.values, ratio),
        `${egg.met} of ${clouds}`,
        range(knn.fastest, ratio),
        range(egg.fastest, ratio),
        range(knn.totals, ratio),
        range(egg.totals, ratio),
      ]),
    ),
    `The ratios are medians of those of each round, in which the two ran seconds apart; then of the fastest run of each, which what else the machine does hits least; then of what the caller waits for, with copies into the worker and out of it. At 1.0 L the ratio to ENN is lowest on ${filled(order[0])} and highest on ${filled(order.at(-1))}. The two bars stand apart, the two baselines do not: EGG takes ${range(ratios(compared(rows), 'egg', 'knn'), (value) => value.toFixed(2))} times as long as ENN.`,
  );
}

/** Who leaves points without a normal. */
function without(clouds) {
  const missing = Object.keys(VARIANTS).map((variant) => {
    const shares = clouds.map(({ methods }) => methods[variant].unresolved / methods[variant].points);
    return shares.some((share) => share > 0) && `${label(variant)}: ${range(shares, percent)}`;
  });
  const named = missing.filter(Boolean).join(', ');
  return named ? `Points that get no normal (in errors a right angle): ${named}.` : 'Every point gets a normal.';
}

function spheres({ spheres }, pictures) {
  const medians = (variant) =>
    range(
      spheres.map(({ methods }) => methods[variant].error.median),
      error,
    );
  const variants = [...OURS, 'knn', 'egg'];
  const time = (row, variant) => milliseconds(row.methods[variant].module);
  const errors = ({ mean, rms, worst }) => `${error(mean)}, ${error(rms)}, ${degrees(worst)}`;
  const wrong = spheres.map(({ methods }) => methods.egg.error.wrong);
  return paragraphs(
    pictures && strip(pictures.spheres, 'Normals at 1.0 L.', 5),
    '![Time against points](paper/time-spheres.svg)',
    table(
      ['points', ...variants.map(label), 'ENN / 1.0 L', 'EGG / 1.0 L', 'ENN / 1.5 L', 'EGG / 1.5 L'],
      spheres.map((row) => [
        row.name,
        ...variants.map((variant) => time(row, variant)),
        ...['1.0 L', '1.5 L'].flatMap((variant) =>
          ['knn', 'egg'].map((baseline) => ratio(ratios([row], baseline, variant)[0])),
        ),
      ]),
    ),
    `Milliseconds. The paper draws them (Figure 7b) without numbers, and says ${article.FASTER_THAN_EGG.join(' to ')} times for EGG. Nanoseconds a point at 1.0 L, from the smallest to the largest sphere: ${spheres.map(({ points, methods }) => ((1e6 * methods['1.0 L'].module) / points).toFixed(0)).join(', ')}.`,
    'With copies into the worker and out of it (`total`):',
    table(
      ['points', ...variants.map(label)],
      spheres.map((row) => [row.name, ...variants.map((variant) => milliseconds(row.methods[variant].total))]),
    ),
    `Mean deviation, root mean square, worst angle; the paper: mean below ${article.DEVIATION}.`,
    table(
      ['points', ...variants.map(label)],
      spheres.map((row) => [row.name, ...variants.map((variant) => errors(row.methods[variant].error))]),
    ),
    `The median is ${medians('1.0 L')} at 1.0 L, ${medians('knn')} by ENN and ${medians('egg')} by EGG, which has ${range(wrong, percent)} of its normals off by more than ${WRONG} degrees. ${without(spheres)}`,
  );
}

function nodes({ spheres }) {
  const cell = ({ share, error: mean, count }) => (count > 0 ? `${percent(share)}: ${error(mean)}` : 'none');
  const rows = CLASSED.flatMap((variant) =>
    spheres.map(({ name, methods }) => {
      const { classes, cells, points } = methods[variant];
      const few = { share: classes[0].share + classes[1].share, count: classes[0].count + classes[1].count };
      few.error = (classes[0].count * (classes[0].error || 0) + classes[1].count * (classes[1].error || 0)) / few.count;
      return [`${name}, ${variant}`, (points / cells).toFixed(1), ...[4, 3, 2].map((n) => cell(classes[n])), cell(few)];
    }),
  );
  const all = spheres.flatMap(({ methods }) => CLASSED.map((variant) => methods[variant]));
  const miscounted = all.reduce((sum, { miscounted }) => sum + miscounted, 0);
  const points = all.reduce((sum, { points }) => sum + points, 0);
  return paragraphs(
    'Share of the points that are interpolated from so many nodes, and their mean deviation.',
    table(
      ['sphere', 'points a cube', '4 nodes', '3 nodes', '2 nodes', '1 or none'],
      [['paper', '', ...article.CLASSES.map(({ share, error }) => `${percent(share)}: ${error}`), ''], ...rows],
    ),
    `The package reports how many points there are of each class; which they are is found by a second, plain implementation in double precision (benches/paper/classes.mjs). It puts ${count(miscounted)} of ${count(points)} points into another class than the package does.`,
  );
}

function surface({ freeForm }, pictures) {
  const { points, methods } = freeForm;
  const { grid, cells, milliseconds: time, interpolation, enn } = article.FREE_FORM;
  const cubes = (grid) => `${grid.map(count).join(' × ')}`;
  const rest = ({ module, phases }) => milliseconds(module - phases.interpolation);
  const facts = (variant) => {
    const { error: found, ...method } = methods[variant];
    const isOurs = method.cells > 0;
    return [
      `here, ${label(variant)}`,
      ...(isOurs ? [cubes(method.grid), count(method.cells), percent(1 - method.cells / points)] : ['', '', '']),
      milliseconds(method.module),
      ...(method.phases.interpolation ? [milliseconds(method.phases.interpolation), rest(method)] : ['', '']),
      ratio(methods.knn.module / method.module),
      error(found.mean),
      error(found.median),
      percent(found.wrong),
    ];
  };
  return paragraphs(
    pictures && strip(pictures.surface, ''),
    pictures && strip(pictures.detail, 'Where ridge, groove and ripples meet. The paper’s Figures 4a and 4c, and 4d.'),
    `${count(points)} points on a generated surface with a ridge, a steep edge, a groove and ripples, its box as that of the paper’s.`,
    table(
      [
        '',
        'cubes',
        'occupied',
        'fewer planes than points',
        'time',
        'interpolation',
        'rest',
        'ENN takes',
        'mean deviation',
        'median',
        `over ${WRONG}°`,
      ],
      [
        [
          'paper, “1.0 L”',
          cubes(grid),
          count(cells),
          percent(1 - cells / article.FREE_FORM.points),
          count(time),
          count(interpolation),
          count(time - interpolation),
          ratio(enn / time),
          '',
          '',
          '',
        ],
        ['paper, ENN', '', '', '', count(enn), '', '', '', '', '', ''],
        ...[...OURS, 'knn', 'egg'].map(facts),
      ],
    ),
    `Of the normals ${percent(methods['1.0 L'].error.wrong)} are off by more than ${WRONG} degrees at 1.0 L, ${percent(methods['0.4 L'].error.wrong)} at 0.4 L, which is about the cubes that the paper counts, and ${percent(methods.knn.error.wrong)} by ENN. The ridge is a true edge: on it no plane is right. ${without([freeForm])}`,
  );
}

function edge({ sweep }) {
  const withError = sweep.filter(({ steps }) => steps[0].error);
  const head = sweep.flatMap(({ name }) => [
    `${name}: ms`,
    ...(withError.some((s) => s.name === name) ? ['mean deviation'] : []),
  ]);
  return paragraphs(
    '![Time against the edge of the cubes](paper/time-edge.svg)',
    '![Mean deviation against the edge of the cubes](paper/error-edge.svg)',
    table(
      ['edge', ...head],
      sweep[0].steps.map(({ factor }, i) => [
        `${factor} L`,
        ...sweep.flatMap(({ steps }) => [
          milliseconds(steps[i].module),
          ...(steps[i].error ? [error(steps[i].error.mean)] : []),
        ]),
      ]),
    ),
    `The sphere has ${millions(sweep[0].points)} million points. The paper’s curves go from 1.0 to 3.0 L. By the cubes that it counts that is ${PRINTED_SCALE.toFixed(1)} to ${(3 * PRINTED_SCALE).toFixed(1)} L of its Eq. 1 (shaded), and its advice, ${article.ADVICE} L, is ${(article.ADVICE * PRINTED_SCALE).toFixed(1)} L.`,
  );
}

function scans({ scans }, { pictures, skipped, hasFolder }) {
  const cubes = (grid) => grid.map(count).join(' × ');
  const printed = article.TABLE.map((row) => [
    `paper: ${row.name}`,
    millions(row.points),
    millions(row.nodes),
    cubes(row.grid),
    '',
    `${count(row.one)} (at ${article.scaleOf(row).toFixed(2)} L)`,
    '',
    `${count(row.three)} (at ${(3 * article.scaleOf(row)).toFixed(2)} L)`,
    count(row.egg),
    '',
    ratio(row.egg / row.one),
    '',
  ]);
  const ours = scans.map((row) => {
    const { nodes, cells, grid } = row.methods['1.0 L'];
    const time = (variant) => milliseconds(row.methods[variant].module);
    return [
      row.name,
      millions(row.points),
      millions(nodes),
      cubes(grid),
      count(cells),
      ...['0.4 L', '1.0 L', '3.0 L', 'egg', 'knn'].map(time),
      ...['egg', 'knn'].map((baseline) => ratio(ratios([row], baseline, '1.0 L')[0])),
    ];
  });
  if (scans.length === 0) {
    const why = hasFolder
      ? 'the folder holds none that is large enough'
      : 'none were given (`npm run paper -- --scans FOLDER`)';
    return paragraphs(`Skipped: no scans; ${why}.`, left(skipped));
  }
  return paragraphs(
    pictures?.scans.length && strip(pictures.scans, 'Normals at 0.4 L.'),
    '![Time against points](paper/time-scans.svg)',
    table(
      [
        '',
        'points, million',
        'nodes, million',
        'cubes',
        'occupied',
        '0.4 L',
        '1.0 L',
        '3.0 L',
        'EGG',
        'ENN',
        'EGG / 1.0 L',
        'ENN / 1.0 L',
      ],
      [...printed, ...ours],
    ),
    'Nodes, cubes and occupied cubes are those at 1.0 L. The paper’s times stand in the columns by its own names; its ratio is that of its own columns. ' +
      without(scans),
    `The scans:\n\n${scans.map(({ name, about }) => `- ${name}${about ? `: ${about}` : ''}`).join('\n')}`,
    left(skipped),
  );
}

const left = (skipped) =>
  skipped.length > 0 && `Not measured:\n\n${skipped.map(({ name, reason }) => `- ${name}: ${reason}`).join('\n')}`;

/** Pictures in rows, each with its title below. */
function strip(pictures, what, across = 3) {
  const rows = [];
  for (let at = 0; at < pictures.length; at += across) {
    const some = Array.from({ length: Math.min(across, pictures.length) }, (_, i) => pictures[at + i]);
    rows.push(
      some.map((picture) => (picture ? image(picture) : '')),
      some.map((picture) => picture?.title ?? ''),
    );
  }
  const [head, ...others] = rows.map((cells) => `| ${cells.join(' | ')} |`);
  const rule = `|${rows[0].map(() => ' --- |').join('')}`;
  return [head, rule, ...others].join('\n') + (what && `\n\n*${what}*`);
}
