// Rows to text: docs/orientation-bench.md.

import { median } from '../median.mjs';
import { paragraphs, percent, sources, table, verdict } from '../format.mjs';
import { MOST_SECONDS, counted, verdicts } from './judge.mjs';
import { ENOUGH, LEAST_NOISE, MODES, RUNS, THICK, TRIED } from './measure.mjs';

/** Never rounded up: all right is told from nearly all. */
const share = (value) => `${value === 1 ? '100' : (Math.floor(1e5 * value + 1e-6) / 1e3).toFixed(3)} %`;
const hundredths = (value) => `${(Math.floor(1e4 * value) / 100).toFixed(2)} %`;
const asPercent = (value) => `${Number((100 * value).toFixed(1))} %`;
const seconds = (value) => value.toFixed(3);
const degrees = (value) => value.toFixed(2);
const least = (rows, value) => rows.reduce((a, b) => (value(b) < value(a) ? b : a));
const fullName = ({ name, variant }) => `${name}, ${variant}`;
const side = ({ side, confidence }) => `${side} ${confidence.toFixed(2)}`;

/** The whole text. `skipped`: files of the folder that were not measured; `notes`: what was done to others, by name. */
export function report(rows, { machine, minutes, hasFolder, skipped, notes }) {
  const { model, cores, node, date } = machine;
  return `${paragraphs(
    '# Orientation, measured',
    "Signs by `orient: 'consistent'` and `'outward'` against true ones, on generated shapes, on points sampled on meshes, on single views of these, and on range scans. Written by `npm run orientation`, text and all; not to be edited.",
    `${model}, ${cores} cores, Node ${node}, ${date}; took ${minutes.toFixed(1)} minutes. Shares are of the points with a true normal, and never rounded up; a point without a normal is not right. Normals must point outwards; those of an open surface, marked ○, either all to one side or all to the other. Scenes are what scanners see of a furnished room (hall, from one place) or a corner of it (scene, from three, and view, from one; benches/orientation/scene.mjs), and of open ground with trees (hills, from one; benches/orientation/hills.mjs): normals must face them. So must those of single views, which are what a scanner at one place sees of a mesh (benches/orientation/single.mjs). Clear: without the points whose normal is more than 60 degrees off the true one, either way; at sharp edges and in noise these have the normal of another face, and their sign says little. What is asked counts all points. Off: how far the lines of the normals are off the true ones, whatever their signs, in degrees, root mean square, without orientation and with it, which averages normals in noise, and without noise finds the planes of narrow faces and the faces of points next to edges. Times are of WebAssembly in Node with one thread, in seconds for a million points, the fastest of ${RUNS} runs, or of fewer where these take more than ${ENOUGH / 1_000} seconds; “a million” is that of ${MODES[0]} signs of as many points of the same surface. Attainable: what who knows the surface, and how large the noise is, reaches by the direction on whose side a noisy point most likely lies, whatever its line, told for ${TRIED} points of rows with noise of ${percent(LEAST_NOISE)} and more that miss something (benches/orientation/attainable.mjs).`,
    `Noise is normally distributed, its standard deviation a share of the diagonal of the box; stripes and gradient are patterns of density (benches/accuracy/clouds.mjs). A wall is thick that is more than ${THICK} times the deviation of the noise, along the inward normal, or that has no other side.`,
    '## In short',
    overview(rows),
    '## Each row',
    details(rows),
    withoutSides(rows),
    beside(rows),
    hasFolder
      ? sources('The meshes and scans:', aboutOf(rows, notes), skipped)
      : 'Skipped: no meshes; none were given (`--meshes FOLDER`).',
  )}\n`;
}

function overview(rows) {
  const all = rows.flatMap((row) => verdicts(row).map((verdict) => ({ ...verdict, row })));
  const kinds = [...new Set(all.map(({ kind }) => kind))];
  const signs = kinds.flatMap((kind) =>
    MODES.flatMap((mode) => {
      const group = all.filter((verdict) => verdict.kind === kind && verdict.mode === mode);
      if (group.length === 0) return [];
      const worst = least(group, ({ share }) => share);
      const met = group.filter(({ met }) => met).length;
      return [
        [
          `${kind}: ${mode}`,
          asPercent(worst.least),
          `${share(worst.share)} (${fullName(worst.row)})`,
          `${met} of ${group.length}`,
          attainableIn(worst.row, worst.part),
          verdict(met === group.length),
        ],
      ];
    }),
  );
  const times = MODES.map((mode) => {
    const slowest = least(rows, ({ modes }) => -modes[mode].seconds.orientation);
    const met = rows.filter(({ modes }) => modes[mode].seconds.orientation <= MOST_SECONDS).length;
    return [
      `seconds for a million points: ${mode}`,
      MOST_SECONDS,
      `${seconds(slowest.modes[mode].seconds.orientation)} (${fullName(slowest)})`,
      `${met} of ${rows.length}`,
      '',
      verdict(met === rows.length),
    ];
  });
  const large = rows.filter((row) => row.large);
  if (large.length > 0) {
    const slowest = least(large, (row) => -row.large);
    const met = large.filter((row) => row.large <= MOST_SECONDS).length;
    const what = `seconds for a million points, clean clouds of so many: ${MODES[0]}`;
    const worst = `${seconds(slowest.large)} (${fullName(slowest)})`;
    times.push([what, MOST_SECONDS, worst, `${met} of ${large.length}`, '', verdict(met === large.length)]);
  }
  return table(['what', 'asked', 'worst', 'rows that meet it', 'attainable there', 'verdict'], [...signs, ...times]);
}

/** What who knows the surface reaches of a part of a row's points, where that was asked. */
const attainableIn = ({ attainable }, part) => (attainable?.[part] >= 0 ? hundredths(attainable[part]) : '');

/** One line for each row whose sides are known. */
export function details(rows) {
  const known = rows.filter(({ sides }) => sides);
  if (known.length === 0) return '';
  const hasWalls = known.some((row) => row.modes[MODES[0]].signs.thick);
  const hasLarge = known.some((row) => row.large);
  const part = (row, name) =>
    MODES.map((mode) => {
      const signs = row.modes[mode].signs[name];
      return signs?.points > 0 ? share(counted(row, signs)) : '';
    });
  const thick = (row) => {
    const { signs } = row.modes[MODES[0]];
    return [
      signs.thick ? percent(signs.thick.points / signs.all.points) : '',
      ...part(row, 'thick'),
      ...part(row, 'thin'),
    ];
  };
  return table(
    [
      'row',
      ...MODES,
      ...MODES.map((mode) => `clear: ${mode}`),
      'asked',
      ...(hasWalls ? ['thick', ...MODES.map((mode) => `thick: ${mode}`), ...MODES.map((mode) => `thin: ${mode}`)] : []),
      'surfaces',
      ...MODES.map((mode) => `largest: ${mode}`),
      ...MODES.map((mode) => `s: ${mode}`),
      's: all',
      ...(hasLarge ? ['s: a million'] : []),
      'off: none',
      'off: consistent',
    ],
    known.map((row) => [
      `${fullName(row)}${row.open ? ' ○' : ''}`,
      ...part(row, 'all'),
      ...MODES.map((mode) => share(counted(row, row.modes[mode].signs.all.clear))),
      judged(row),
      ...(hasWalls ? thick(row) : []),
      ...facts(row),
      ...(hasLarge ? [row.large ? seconds(row.large) : ''] : []),
      degrees(row.lines.none),
      degrees(row.lines.consistent),
    ]),
  );
}

/** What is asked of a row, which modes miss it, and whether they do so only by normals of other faces. */
function judged(row) {
  const all = verdicts(row);
  const missed = all.filter(({ met }) => !met);
  const asked = [...new Set(all.map(({ least }) => asPercent(least)))].join(', ');
  if (missed.length === 0) return `${asked}: met`;
  const modes = MODES.filter((mode) => missed.some((verdict) => verdict.mode === mode));
  const isClearMet = missed.every(({ clear }) => clear);
  const parts = [...new Set(missed.map(({ part }) => part))].filter((part) => attainableIn(row, part));
  const attainable = parts.map((part) => `${part === 'all' ? '' : `${part}: `}${attainableIn(row, part)}`).join(', ');
  return `${asked}: **missed** by ${modes.join(' and ')}${isClearMet ? ', met where clear' : ''}${attainable && `; attainable ${attainable}`}`;
}

const facts = ({ modes }) => {
  const all = MODES.map((mode) => modes[mode]);
  return [
    [...new Set(all.map(({ components }) => components))].join(' / '),
    ...all.map(({ largest }) => side(largest)),
    ...all.map(({ seconds: { orientation } }) => seconds(orientation)),
    seconds(all[0].seconds.total),
  ];
};

/** Rows of surfaces with one side only: no signs are right, and only the report can tell. */
export function withoutSides(rows) {
  const without = rows.filter(({ sides }) => !sides);
  if (without.length === 0) return '';
  return paragraphs(
    'A Moebius band has one side only: no signs are right, and the confidence should say so.',
    table(
      ['row', 'surfaces', ...MODES.map((mode) => `largest: ${mode}`), ...MODES.map((mode) => `s: ${mode}`), 's: all'],
      without.map((row) => [fullName(row), ...facts(row)]),
    ),
  );
}

/** How often their time ours is asked to take, by the beginning of their names. */
const FASTER = { Open3D: 100, MeshLib: 20 };

/** What others reach, where they were asked. All up to one flip, which is all that they promise. */
export function beside(rows) {
  const asked = rows.filter(({ peers }) => peers);
  if (asked.length === 0) return '';
  const methods = asked[0].peers.map(({ method }) => method);
  const cell = ({ share: right, seconds, failure }) => failure ?? `${share(right)}, ${seconds.toFixed(2)} s`;
  const own = (row, mode) => {
    const { signs, seconds } = row.modes[mode];
    return { share: signs.all.eitherWay, seconds: (seconds.total * row.points) / 1e6 };
  };
  /** Undefined where none has an answer. */
  const best = (row) => row.peers.filter(({ failure }) => !failure).sort((a, b) => b.share - a.share)[0];
  const isMet = (row) => own(row, MODES[0]).share >= best(row).share;
  const answered = asked.filter(best);
  const met = answered.filter(isMet).length;
  const speeds = methods.map((method) => {
    const ratios = asked.flatMap((row) => {
      const { seconds } = row.peers.find((peer) => peer.method === method);
      return seconds ? [seconds / own(row, MODES[0]).seconds] : [];
    });
    const least = FASTER[method.match(/^\w+/)[0]] ?? 1;
    const show = (ratio) => (ratios.length ? ratio.toPrecision(2) : '');
    return [
      `${method}: their time over ours`,
      least,
      show(Math.min(...ratios)),
      show(median(ratios)),
      `${ratios.filter((ratio) => ratio >= least).length} of ${ratios.length}`,
      verdict(ratios.length > 0 && ratios.every((ratio) => ratio >= least)),
    ];
  });
  return paragraphs(
    '## Beside others',
    "Shares up to one flip of all signs, and the seconds for the cloud on one thread, normals included, measured in this run, one after the other; by benches/peers/orientation.py, which says what their numbers mean. Ours are of WebAssembly, theirs are native. All by `'consistent'`; rows without an answer do not count.",
    table(
      ['what', 'asked', 'worst', 'median', 'rows that meet it', 'verdict'],
      [
        ['right signs: the best of them', '', '', '', `${met} of ${answered.length}`, verdict(met === answered.length)],
        ...speeds,
      ],
    ),
    table(
      ['row', ...MODES, ...methods, 'at least the best'],
      asked.map((row) => [
        fullName(row),
        ...MODES.map((mode) => cell(own(row, mode))),
        ...row.peers.map(cell),
        best(row) ? verdict(isMet(row)) : '',
      ]),
    ),
  );
}

/** What is known of each mesh and scan, by name. */
const aboutOf = (rows, notes) =>
  new Map(
    rows
      .filter(({ kind }) => kind !== 'shape')
      .map(({ name, about }) => [name, [about, notes.get(name)].filter(Boolean).join('; ')]),
  );
