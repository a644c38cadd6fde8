// Rows of the speed bench to Markdown.

import { machine } from '../machine.mjs';
import { median } from '../median.mjs';
import { paragraphs, range, table, verdict } from '../format.mjs';
import { THREADS } from './engines.mjs';

/** Of fixed cells, and of 'auto'. */
const PHASES = ['bounds', 'cellSize', 'sort', 'nodes', 'interpolation', 'surfaces', 'vote', 'detail'];

const times = (value) => value.toFixed(1);
const total = ({ reports }) => median(reports.map((report) => report.milliseconds.total));
const eachPoint = (row) => total(row) / row.size;
/** The peak of wasm or native memory: at that moment neither the input nor the normals need be there. */
const peakBytes = ({ reports, size }) => reports[0].peakBytes / size;
const isAlike = (a, b, names) => names.every((name) => a[name] === b[name]);
const isWasm = ({ engine }) => engine !== 'native';
const hasNoReason = ({ reports }) => !reports[0].fallbackReason;

/** One line for everything that is asked: what, of what, the least and the most that was found, whether that is well. */
function verdicts(rows, drop) {
  const spheres = rows.filter((row) => row.shape === 'sphere' && isWasm(row) && hasNoReason(row));
  const lines = [];
  const judge = (what, of, values, asked, isMet) => {
    if (values.length === 0) return;
    const met = values.filter(isMet).length;
    const found =
      met === values.length ? verdict(true) : `${verdict(false)} by ${values.length - met} of ${values.length}`;
    lines.push([what, of, range(values, times), asked, found]);
  };
  const sizes = spheres.map(({ size }) => size);
  const [smallest, largest] = [Math.min(...sizes), Math.max(...sizes)];
  for (const cell of new Set(spheres.map((row) => row.cell))) {
    const mine = spheres.filter((row) => row.cell === cell);
    // Small clouds lose time that has nothing to do with their points: the fastest of all smaller ones counts.
    const growths = mine
      .filter(({ size }) => size === largest && largest > smallest)
      .map((row) => {
        const smaller = mine.filter(
          (other) => other.size < largest && isAlike(row, other, ['order', 'engine', 'threads']),
        );
        return eachPoint(row) / Math.min(...smaller.map(eachPoint));
      });
    judge(
      `${cell}: time per point, ${largest / 1e6} M over the best of the smaller`,
      'wasm',
      growths,
      'at most 1.5',
      (x) => x <= 1.5,
    );
    const gains = mine
      .filter(({ threads, size }) => threads > 1 && size >= 750_000)
      .map((row) => {
        const alone = mine.find((other) => other.threads === 1 && isAlike(row, other, ['size', 'order', 'engine']));
        return total(alone) / total(row);
      });
    judge(`${cell}: one thread over ${THREADS}, from 0.75 M`, 'wasm', gains, 'at least 1.8', (x) => x >= 1.8);
    const peaks = mine.filter(({ size }) => size >= 750_000).map(peakBytes);
    judge(`${cell}: bytes a point in all, from 0.75 M`, 'wasm', peaks, 'at most 40', (x) => x <= 40);
  }
  const chromium = spheres.filter(
    ({ engine, threads, cell, size }) => engine.endsWith('Chromium') && threads > 1 && cell === '1.5' && size === 3e6,
  );
  const copies = chromium.map((row) => total(row) / median(row.copy));
  judge('1.5, 3 M: time over that of the copies', `Chromium, ${THREADS} threads`, copies, 'at most 8', (x) => x <= 8);
  if (drop) {
    judge(
      'from a file to normals handed to WebGL, over the estimate alone',
      'the page',
      [drop.whole / drop.estimate],
      'at most 3',
      (x) => x <= 3,
    );
  }
  return lines;
}

function cells(row) {
  const { shape, size, order, cell, engine, threads, reports, copy } = row;
  const totals = reports.map((report) => report.milliseconds.total);
  const spread = ((Math.max(...totals) - Math.min(...totals)) / total(row)) * 50;
  return [
    `${shape} ${Number((size / 1e6).toFixed(4))} M, ${order}`,
    cell,
    engine,
    threads,
    total(row).toFixed(total(row) < 100 ? 1 : 0),
    `±${spread.toFixed(0)} %`,
    copy ? times(total(row) / median(copy)) : '',
    (size / total(row) / 1e3).toFixed(1),
    peakBytes(row).toFixed(0),
    ...PHASES.map((phase) => {
      const found = reports.map((report) => report.milliseconds[phase]);
      return found[0] === undefined ? '' : median(found).toFixed(1);
    }),
  ];
}

/** `drop` has the milliseconds of the page, if there was a browser. */
export function report(rows, drop, runs) {
  const { model, cores, node, date } = machine();
  const head = ['cloud', 'cell', 'engine', 'threads', 'ms', 'spread', 'copies', 'M points/s', 'bytes/point', ...PHASES];
  return `${paragraphs(
    '# Speed, measured',
    'Written by `npm run bench`, text and all; not to be edited.',
    `${model}, ${cores} cores, Node ${node}, ${date}; medians of ${runs} runs, of WebAssembly after a second of others. Spheres are evenly covered, their points in random order or sorted (Morton), so that neighbours in space are neighbours in memory. Cell is \`'auto'\` or a multiple of the paper's L.`,
    '“ms” is what the caller waits for, in WebAssembly with the copies in and out; native code takes the input as it lies. “Spread” is half of what lies between the fastest run and the slowest. “Copies” is how often that is the time of the bare copies, 12 bytes a point into wasm memory and 12 out of it, between arrays that are in use, by one thread. “Bytes/point” is the peak of the engine’s memory, input and normals included. The phases are in milliseconds.',
    drop &&
      `The page, opened anew for each run and given some seconds, with a PLY file of ${drop.points / 1e6} million points with colours: ${drop.whole.toFixed(0)} ms from the choice of the file until its normals were handed to WebGL; the same estimate alone, with signs, ${drop.estimate.toFixed(0)} ms. Drawing is switched off, for it would run on the processors.`,
    '## What is asked',
    table(['what', 'of', 'found', 'asked', 'verdict'], verdicts(rows, drop)),
    '## All rows',
    table(head, rows.map(cells)),
  )}\n`;
}
