#!/usr/bin/env node
// The command line: a PLY in, the same PLY with normals out.
import { readFile } from 'node:fs/promises';
import { parseArgs } from 'node:util';
import { checkOutput, openInput, plain, writeOutput } from './disk.js';
import { type BilinormalError, createEstimator } from './node.js';
import { scannerOf } from './scanner.js';
import type { EstimateOptions, PointCloud, Progress, Report } from './types.js';

const help = `Usage: bilinormal IN.ply -o OUT.ply [options]

Computes one normal for each point of a PLY file, and writes the file with nx ny nz; every other property and element
is kept, existing normals are replaced. IN may be - for standard input, and packed with gzip; OUT.ply.gz will be.

  -o, --out FILE         where the result goes; it appears there when it is complete, so IN itself is allowed
      --method NAME      bilinear (default), knn or egg
      --cell auto        the size that noise and detail allow, place by place (default)
      --cell-scale S     ... in multiples of cbrt(volume / points), 0.1 to 100; larger averages more noise away
      --cell-size L      ... in the units of the file
      --k N              nearest points of knn (default 16), candidates of egg (default 8); at least 3
      --orient HOW       none (default), consistent, outward, viewpoint=x,y,z, up=x,y,z, or scanner: towards where the
                         file says that it stood
      --curvature        add the surface variation as the property curvature
      --threads N        1 to 256, default: one for each processor up to 16
      --ascii            write text instead of little-endian binary
      --json             print the report as one line of JSON
      --quiet            print no progress, and no report but that of --json
      --help             print this
      --version          print the version

Exit status: 0 done; 1 an error, told in one line; 2 wrong usage.
`;

const version = async (): Promise<string> =>
  JSON.parse(await readFile(new URL('../package.json', import.meta.url), 'utf8')).version;

class UsageError extends Error {}

interface Task {
  input: string;
  output: string;
  estimate: Omit<EstimateOptions, 'orient'>;
  orient: EstimateOptions['orient'] | 'scanner';
  threads: number | 'auto';
  ascii: boolean;
  json: boolean;
  quiet: boolean;
}

/** The task, or the text that was asked for. */
async function parse(args: string[]): Promise<Task | string> {
  let parsed;
  try {
    parsed = parseArgs({
      args,
      allowPositionals: true,
      options: {
        out: { type: 'string', short: 'o' },
        method: { type: 'string' },
        cell: { type: 'string' },
        'cell-scale': { type: 'string' },
        'cell-size': { type: 'string' },
        k: { type: 'string' },
        orient: { type: 'string' },
        curvature: { type: 'boolean' },
        threads: { type: 'string' },
        ascii: { type: 'boolean' },
        json: { type: 'boolean' },
        quiet: { type: 'boolean' },
        help: { type: 'boolean', short: 'h' },
        version: { type: 'boolean' },
      },
    });
  } catch (error) {
    // Node's advice in the sentences that follow is for another kind of program.
    throw new UsageError((error as Error).message.split(/[.\n] /)[0]);
  }
  const { values, positionals } = parsed;
  if (values.help) return help;
  if (values.version) return `${await version()}\n`;
  const [input, ...more] = positionals;
  if (input === undefined) throw new UsageError('no input file');
  if (more.length) throw new UsageError(`one input file at a time; ${more.join(' ')} came too`);
  if (!values.out) throw new UsageError('no output file; give one with -o');
  if (values.out === '-') throw new UsageError('the output cannot be standard output, where the report goes');
  const estimate: Task['estimate'] = {};
  if (values.method !== undefined) estimate.method = choice('method', values.method, ['bilinear', 'knn', 'egg']);
  const cells = [values.cell, values['cell-scale'], values['cell-size']].filter((value) => value !== undefined);
  if (cells.length > 1) throw new UsageError('--cell, --cell-scale and --cell-size exclude each other');
  if (values.cell !== undefined) estimate.cell = choice('cell', values.cell, ['auto']);
  if (values['cell-scale'] !== undefined) estimate.cell = { scale: number('cell-scale', values['cell-scale']) };
  if (values['cell-size'] !== undefined) estimate.cell = { size: number('cell-size', values['cell-size']) };
  if (values.k !== undefined) estimate.k = wholeNumber('k', values.k, 3);
  if (values.curvature) estimate.curvature = true;
  return {
    input,
    output: values.out,
    estimate,
    orient: values.orient === undefined ? 'none' : parseOrient(values.orient),
    threads: values.threads === undefined ? 'auto' : wholeNumber('threads', values.threads),
    ascii: values.ascii ?? false,
    json: values.json ?? false,
    quiet: values.quiet ?? false,
  };
}

function choice<const T extends string>(option: string, value: string, choices: readonly T[]): T {
  const found = choices.find((one) => one === value);
  if (found === undefined) throw new UsageError(`--${option} is ${value}; wanted ${choices.join(', ')}`);
  return found;
}

function number(option: string, value: string): number {
  const found = Number(value);
  if (value.trim() === '' || !Number.isFinite(found)) throw new UsageError(`--${option} is ${value}; wanted a number`);
  return found;
}

function wholeNumber(option: string, value: string, least = 1): number {
  const found = number(option, value);
  if (!Number.isInteger(found) || found < least)
    throw new UsageError(`--${option} is ${value}; wanted a whole number of at least ${least}`);
  return found;
}

function parseOrient(value: string): Task['orient'] {
  if (value === 'none' || value === 'consistent' || value === 'outward' || value === 'scanner') return value;
  const [how, place, rest] = value.split('=');
  if (place === undefined || rest !== undefined || (how !== 'viewpoint' && how !== 'up'))
    throw new UsageError(
      `--orient is ${value}; wanted none, consistent, outward, scanner, viewpoint=x,y,z or up=x,y,z`,
    );
  const [x, y, z, ...more] = place.split(',').map((part) => number('orient', part));
  if (z === undefined || more.length)
    throw new UsageError(`--orient is ${value}; wanted three numbers, as ${how}=x,y,z`);
  return how === 'up' ? { up: [x!, y!, z] } : { viewpoint: [x!, y!, z] };
}

/** Reads, estimates, writes. Errors name the file they belong to. */
async function run(task: Task): Promise<Report> {
  await about(task.output, () => checkOutput(task.output));
  const source = await about(task.input, () => openInput(task.input));
  let estimator = await usage(() => createEstimator({ threads: task.threads }));
  const show = task.quiet || !process.stderr.isTTY ? undefined : showProgress;
  try {
    // Wrong options before the work, not after it.
    const orient = task.orient === 'scanner' ? 'none' : task.orient;
    await usage(() => estimator.estimateNormals(new Float32Array(), { ...task.estimate, orient }));
    const { normals, curvature, report } = await about(task.input, async () => {
      const cloud = await estimator.readPointCloud(source, { onProgress: show?.('reading') });
      const orient = orientIn(cloud, task.orient);
      const options = { ...task.estimate, orient, transfer: true, onProgress: show?.('computing') };
      return estimator.estimateNormals(cloud.positions, options);
    });
    // Another one, so that the memory of the first is free again.
    estimator.dispose();
    estimator = await createEstimator({ threads: task.threads });
    const format = task.ascii ? 'ascii' : 'binary_little_endian';
    const additions = { normals, ...(curvature && { curvature }) };
    const ply = await about(task.input, () =>
      estimator.writePly(source, additions, { format, onProgress: show?.('writing') }),
    );
    await about(task.output, () => writeOutput(task.output, ply));
    return report;
  } finally {
    estimator.dispose();
    if (show) process.stderr.write('\r\x1b[K');
  }
}

/** Runs `work`; what it finds wrong with its arguments is wrong usage. */
async function usage<T>(work: () => Promise<T>): Promise<T> {
  try {
    return await work();
  } catch (error) {
    const { code, message } = error as BilinormalError;
    throw code === 'input' ? new UsageError(message) : error;
  }
}

/** Runs `work`; what it throws gets the name of the file. */
async function about<T>(file: string, work: () => Promise<T>): Promise<T> {
  try {
    return await work();
  } catch (error) {
    throw new Error(`${file}: ${plain(error)}`);
  }
}

/** The command line speaks of the file's coordinates, the estimator of positions relative to the cloud's origin. */
function orientIn(cloud: PointCloud, orient: Task['orient']): EstimateOptions['orient'] {
  if (orient === 'scanner') {
    const viewpoint = scannerOf(cloud);
    if (viewpoint) return { viewpoint };
    throw new Error('--orient is scanner, but the file does not say where it stood; give --orient viewpoint=x,y,z');
  }
  if (typeof orient !== 'object' || !('viewpoint' in orient)) return orient;
  const [x, y, z] = orient.viewpoint;
  const { origin } = cloud;
  return { viewpoint: [x - origin[0], y - origin[1], z - origin[2]] };
}

function showProgress(title: string) {
  let shown = '';
  return ({ phase, fraction }: Progress) => {
    const line = `${title} ${String(Math.floor(100 * fraction)).padStart(3)} % ${phase}`;
    if (line !== shown) process.stderr.write(`\r\x1b[K${line}`);
    shown = line;
  };
}

function format(report: Report, { method = 'bilinear' }: EstimateOptions): string {
  const { total, ...phases } = report.milliseconds;
  const count = (value: number) => value.toLocaleString('en');
  const short = (value: number) => String(Number(value.toPrecision(4)));
  const fixed = [
    ['cubes', `${count(report.cells)} of ${report.grid.map(count).join(' x ')}, ${count(report.nodes)} with a node`],
    ['cube edge', `${short(report.cellSize)} (${short(report.scale)} L)`],
    ['nodes used', report.nodesUsed.map((points, nodes) => `${nodes}: ${count(points)}`).join('   ')],
  ];
  const { noise, scales } = report;
  const share = (points: number) => `${short((100 * points) / report.points)} %`;
  const adaptive = noise !== undefined && [
    ['cubes', count(report.cells)],
    ['cube edges', scales?.map(({ cellSize, points }) => `${short(cellSize)}: ${share(points)}`).join('   ') ?? ''],
    ['noise', short(noise)],
  ];
  const rows = [
    ['points', count(report.points) + (report.unresolved ? `, ${count(report.unresolved)} without a normal` : '')],
    ['method', method],
    // The others have none.
    ...(method === 'bilinear' ? adaptive || fixed : []),
    ...surfaces(report.components),
    ['threads', report.threads + (report.fallbackReason ? ` (${report.fallbackReason})` : '')],
    ['memory', `${short(report.peakBytes / 2 ** 20)} MiB at most`],
    [
      'time',
      `${Math.round(total)} ms: ${Object.entries(phases)
        .map(([phase, time]) => `${phase} ${Math.round(time)}`)
        .join(', ')}`,
    ],
  ];
  return rows.map(([name, text]) => `${name!.padEnd(11)} ${text}\n`).join('');
}

/** The largest of the surfaces that were given one sign each; all of many would not fit a screen. */
function surfaces({ count, largest }: Report['components'] = { count: 0, largest: [] }): [string, string][] {
  const ways = {
    air: 'outwards',
    volume: 'away from the middle',
    touch: 'as what they touch',
    sight: 'towards what stands before them',
    view: 'towards the scanner',
    convention: 'to a side by convention',
  };
  const shown = largest.slice(0, 4).map(({ points, side, confidence }) => {
    const sure = side === 'convention' ? '' : `, ${Math.round(100 * confidence)} % sure`;
    return `${points.toLocaleString('en')} points ${ways[side]}${sure}`;
  });
  if (count > shown.length) shown.push(`${(count - shown.length).toLocaleString('en')} smaller`);
  return shown.map((text, i) => [i === 0 ? 'surfaces' : '', text]);
}

// Who reads the report may have had enough of it, as `head` has; anything else is told like other failures.
process.stdout.on('error', (error: NodeJS.ErrnoException) => {
  if (error.code === 'EPIPE') return;
  process.stderr.write(`bilinormal: ${plain(error)}\n`);
  process.exitCode = 1;
});

try {
  const task = await parse(process.argv.slice(2));
  if (typeof task === 'string') process.stdout.write(task);
  else {
    const report = await run(task);
    if (task.json) process.stdout.write(`${JSON.stringify(report)}\n`);
    else if (!task.quiet) process.stdout.write(format(report, task.estimate));
  }
} catch (error) {
  const usage = error instanceof UsageError;
  process.stderr.write(`bilinormal: ${plain(error)}${usage ? '\nTry bilinormal --help' : ''}\n`);
  process.exitCode = usage ? 2 : 1;
}
