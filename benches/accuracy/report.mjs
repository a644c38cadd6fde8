// Rows to text: docs/accuracy.md.

import { count, paragraphs, percent, sources, table } from '../format.mjs';
import { PCPNET, VARIANTS } from './clouds.mjs';
import { LIMITS } from './judge.mjs';
import { ALL, ENOUGH, JET, KNN, LEAST, METHODS, NEIGHBOURS, RUNS, geometricMean } from './measure.mjs';

const degrees = (value) => (value < 9.95 ? value.toFixed(2) : value.toFixed(1));
const times = (value) => value.toFixed(2);
const variants = Object.keys(VARIANTS);
const LABELS = {
  clean: 'clean',
  'noise0.12': 'noise 0.12 %',
  'noise0.6': 'noise 0.6 %',
  'noise1.2': 'noise 1.2 %',
  stripes: 'stripes',
  gradient: 'gradient',
  steps: 'steps',
};
/** Root mean square of a method: over all points, of a jet over the sampled ones. */
const rms = ({ rms, sampled }) => rms ?? sampled;
const least = (values) => values.reduce((a, b) => (b.value < a.value ? b : a));
const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
const most = (rows, value) => rows.reduce((a, b) => (value(b) > value(a) ? b : a));

/** The whole text. `skipped`: files of the folder of meshes that were not measured; `sampled`: the points of a jet. */
export function report(rows, { machine, threads, minutes, sampled, hasFolder, skipped }) {
  const { model, cores, node, date } = machine;
  const measured = variants.filter((variant) => rows.some((row) => row.variant === variant));
  const shapes = rows.filter(({ isMesh }) => !isMesh);
  const meshes = rows.filter(({ isMesh }) => isMesh);
  return `${paragraphs(
    '# Accuracy',
    'Normals against true ones, on generated shapes and on points sampled on meshes. Written by `npm run accuracy`, text and all; not to be edited.',
    `${model}, ${cores} cores, Node ${node}, ${date}; took ${minutes.toFixed(1)} minutes. Errors are unsigned angles in degrees, mostly their root mean square; a point without a normal counts as 90, outliers do not count. Times are of WebAssembly in Node with ${threads} ${threads === 1 ? 'thread' : 'threads'}, what the caller waits for, the fastest of ${RUNS} runs, or of fewer where these take more than ${ENOUGH} ms.`,
    "**auto** is what the package does by itself; **L** is that of the paper’s Eq. 1, so that “1 L” is `cell: { scale: 1 }`; **knn** is `method: 'knn'`, the plane of the k nearest points. " +
      `**jet** is a quadratic height function fitted to the k nearest points, by a reference in JavaScript (benches/accuracy/jet.mjs), at ${count(sampled)} points of each row among all of its points.`,
    `**Best k** is the knn of smallest error among k = ${NEIGHBOURS.join(', ')}, chosen in hindsight; the ratio is the error of auto over that of the best k, where errors below ${LEAST} degrees count as ${LEAST}. The rows are described in benches/accuracy/shapes.mjs and clouds.mjs; the variants follow PCPNet’s data: noise is normally distributed, its standard deviation a share of the diagonal of the box; in stripes every second of ten bands along the longest side has a tenth of the density; a gradient falls along it to a twentieth. Not of these are steps: coordinates rounded to 1/400 of that diagonal, as of voxels; once turned these are no multiples any more.`,
    '## In short',
    overview(rows, measured),
    '## As PCPNet’s table: generated shapes',
    columns(shapes),
    '## As PCPNet’s table: meshes',
    meshes.length > 0 ? columns(meshes) : meshNote(hasFolder),
    sources('The meshes:', new Map(meshes.map(({ name, about }) => [name, about])), skipped),
    ...measured.flatMap((variant) => [
      `## ${LABELS[variant]}`,
      ...details(rows.filter((row) => row.variant === variant)),
    ]),
  )}\n`;
}

function overview(rows, measured) {
  const line = (label, rows) => {
    const worst = most(rows, ({ ratio }) => ratio);
    const turned = most(rows, ({ turning }) => turning);
    const missed = most(rows, ({ methods }) => methods.auto.missed);
    return [
      label,
      rows.length,
      times(geometricMean(rows.map(({ ratio }) => ratio))),
      `${times(worst.ratio)} (${worst.name}, ${LABELS[worst.variant]})`,
      rows.filter(({ ratio }) => ratio <= 1).length,
      times(geometricMean(rows.map(({ ratioOfAll }) => ratioOfAll))),
      missed.methods.auto.missed > 0 ? `${percent(missed.methods.auto.missed)} (${missed.name})` : '0',
      `${turned.turning.toFixed(3)} (${turned.name}, ${LABELS[turned.variant]})`,
    ];
  };
  const groups = [
    ['generated', rows.filter(({ isMesh }) => !isMesh)],
    ['meshes', rows.filter(({ isMesh }) => isMesh)],
  ].filter(([, group]) => group.length > 0);
  return paragraphs(
    table(
      [
        'rows',
        'number',
        'auto / best k',
        'worst',
        'not above 1',
        'auto / best of knn and jet',
        'missed at most',
        'turned',
      ],
      [
        ...measured.map((variant) =>
          line(
            LABELS[variant],
            rows.filter((row) => row.variant === variant),
          ),
        ),
        ...groups.map(([label, group]) => line(label, group)),
        line('all', rows),
      ],
    ),
    'Ratios are geometric means over the rows. That of knn and jet is against the best of all of the same k, all at the sampled points. Missed: the largest share of the points of a row that have no normal by auto, but have one by knn with k = 16. Turned: by how many times the error of a row changes at the most, to either side, when the cloud is turned about no special axis.',
  );
}

/** Mean over the clouds that are there in all six variants of PCPNet, as its table has it. */
function columns(rows) {
  const names = [...new Set(rows.map(({ name }) => name))].filter((name) =>
    PCPNET.every((variant) => rows.some((row) => row.name === name && row.variant === variant)),
  );
  if (names.length === 0) return 'No cloud is there in all six variants.';
  const of = (variant) => rows.filter((row) => row.variant === variant && names.includes(row.name));
  const value = (variant, method) => mean(of(variant).map(({ methods }) => rms(methods[method])));
  const line = (label, values, show = ({ value }) => degrees(value)) => [
    label,
    ...values.map(show),
    degrees(mean(values.map(({ value }) => value))),
  ];
  const bestOf = (methods) =>
    PCPNET.map((variant) => least(methods.map((name) => ({ name, value: value(variant, name) }))));
  const withName = ({ name, value }) => `${degrees(value)} (${name.replace(/^\S+ /, '')})`;
  return paragraphs(
    table(
      ['', ...PCPNET.map((variant) => LABELS[variant]), 'mean'],
      [
        ...ALL.map((method) =>
          line(
            method,
            PCPNET.map((variant) => ({ value: value(variant, method) })),
          ),
        ),
        line('best k of each column, knn', bestOf(KNN), withName),
        line('best k of each column, jet', bestOf(JET), withName),
        line(
          'best k of each row, knn',
          PCPNET.map((variant) => ({ value: mean(of(variant).map(({ methods, best }) => methods[best].rms)) })),
        ),
      ],
    ),
    `Root mean square of each cloud, and the mean of those of ${names.length} clouds: ${names.join(', ')}.`,
  );
}

const meshNote = (hasFolder) =>
  hasFolder ? 'No file of the folder is a mesh.' : 'Skipped: no meshes; none were given (`--meshes FOLDER`).';

/** Two tables for the rows of one variant: errors of all methods; and auto and the best k more closely. */
export function details(rows) {
  const close = ({ mean, over, unresolved, milliseconds }) => [
    degrees(mean),
    ...over.map(percent),
    unresolved > 0 ? percent(unresolved) : '0',
    milliseconds.toFixed(0),
  ];
  const head = ['mean', ...LIMITS.map((limit) => `over ${limit}°`), 'unresolved', 'ms'];
  return [
    'Root mean square:',
    table(
      ['', ...ALL, 'auto / best k'],
      rows.map(({ name, methods, ratio }) => [
        name,
        ...ALL.map((method) => degrees(rms(methods[method]))),
        times(ratio),
      ]),
    ),
    'Auto, and the best k:',
    table(
      ['', ...head.map((label) => `auto: ${label}`), 'missed', 'best k', ...head],
      rows.map(({ name, methods, best }) => [
        name,
        ...close(methods.auto),
        methods.auto.missed > 0 ? percent(methods.auto.missed) : '0',
        METHODS[best].k,
        ...close(methods[best]),
      ]),
    ),
  ];
}
