// An estimator: one worker, and the calls that wait for it.
import { BilinormalError, type Failure } from './error.js';
import { detect } from './features.js';
import type { Bytes, Call, Link, Reply, StartWorker } from './protocol.js';
import { copyOf, describe, kindOf, resolve } from './source.js';
import type { Estimator, EstimatorOptions, PointCloud, Positions, ReadOptions } from './types.js';

/** What an estimator needs from where it runs. */
export interface Host {
  startWorker: StartWorker;
  /** Whether addresses of local files can be opened. */
  files: boolean;
  /** What relative addresses count from. */
  base(): string;
}

/** What a call hands to the worker. */
interface Parcel {
  call: Call;
  transfer: Transferable[];
  /** Where the worker's share of the progress begins. */
  from?: number;
}

interface Job extends Required<Parcel> {
  tell(phase: string, fraction: number): void;
  resolve(result: any): void;
  reject(error: unknown): void;
  begun: number;
}

const input = (message: string) => new BilinormalError('input', message);
const whole = (value: number, from: number, to: number) => Number.isInteger(value) && value >= from && value <= to;

/** Starts an estimator; resolves when its worker is ready. */
export async function createEstimator(host: Host, options: EstimatorOptions = {}): Promise<Estimator> {
  const { threads = 'auto', memoryMaxMiB = 4096 } = options;
  if (threads !== 'auto' && !whole(threads, 1, 256))
    throw input(`threads is ${threads}; wanted 'auto' or a whole number from 1 to 256`);
  if (!whole(memoryMaxMiB, 16, 4096))
    throw input(`memoryMaxMiB is ${memoryMaxMiB}; wanted a whole number from 16 to 4096`);
  let wasmUrl: string | undefined;
  try {
    // With a slash at its end, for it names a folder.
    if (options.wasmUrl) wasmUrl = new URL(`${options.wasmUrl}`.replace(/\/*$/, '/'), host.base()).href;
  } catch {
    throw input(`wasmUrl is ${options.wasmUrl}; wanted the address of a folder`);
  }
  const [estimator, ready] = openEstimator(host, { threads, memoryMaxMiB, wasmUrl });
  await ready();
  return estimator;
}

/** An estimator that starts its worker with its first call, and a call that does no more than that. */
export function openEstimator(host: Host, options: EstimatorOptions): [Estimator, () => Promise<unknown>] {
  const queue: Job[] = [];
  let running: Job | undefined;
  let link: Link | undefined;
  let channel: BroadcastChannel | undefined;
  let disposed = false;

  function end() {
    link?.end();
    channel?.close();
    link = channel = undefined;
  }

  /** Takes the running job off, settles it, and goes on with the next. */
  function finish(settle: (job: Job) => void) {
    const job = running;
    running = undefined;
    if (job) settle(job);
    next();
  }

  function next() {
    if (running) return;
    running = queue.shift();
    if (!running) return link?.hold(false);
    try {
      running.begun = performance.now();
      running.tell('start', 0);
      link ??= start();
      link.hold(true);
      link.post(running.call, running.transfer);
    } catch (error) {
      end();
      finish((job) => job.reject(error));
    }
  }

  function start(): Link {
    let answered = false;
    const stop = (error: BilinormalError) => {
      if (mine !== link) return;
      end();
      finish((job) => job.reject(error));
    };
    const broke = (reason: string) =>
      stop(
        new BilinormalError(
          'limit',
          `the wasm module stopped (${reason}), most likely for want of memory; use fewer points or larger cells`,
        ),
      );
    const name = `bilinormal ${Math.random()}`;
    channel = new BroadcastChannel(name);
    channel.onmessage = (event) => broke(event.data);
    // Node: a channel alone does not keep the process alive.
    (channel as { unref?(): void }).unref?.();
    const mine = host.startWorker(
      (reply: Reply) => {
        answered = true;
        if (mine !== link || !running) return;
        if ('phase' in reply) {
          try {
            running.tell(reply.phase, running.from + (1 - running.from) * reply.fraction);
          } catch (error) {
            // The caller's own function threw.
            end();
            finish((job) => job.reject(error));
          }
        } else if ('result' in reply) {
          finish((job) => job.resolve(reply.result));
        } else {
          const { code, message, fatal, ...details }: Failure = reply.failure;
          if (!code) return broke(message);
          if (fatal) end();
          finish((job) => job.reject(new BilinormalError(code, message, details)));
        }
      },
      (reason) =>
        answered ? broke(reason) : stop(new BilinormalError('unsupported', `the worker did not start: ${reason}`)),
    );
    mine.post({ ...options, kind: 'start', channel: name });
    return mine;
  }

  /** Queues what `prepare` makes, which copies or takes the arguments before its first wait. */
  async function run(
    { signal, onProgress }: ReadOptions,
    prepare: (tell: Job['tell']) => Parcel | Promise<Parcel>,
  ): Promise<any> {
    signal?.throwIfAborted();
    let told = 0;
    const tell = (phase: string, fraction: number) => {
      told = Math.max(told, Math.min(1, fraction));
      onProgress?.({ phase, fraction: told });
    };
    let parcel: Parcel;
    try {
      parcel = await prepare(tell);
    } catch (error) {
      throw signal?.aborted ? signal.reason : error;
    }
    signal?.throwIfAborted();
    if (disposed) throw gone();

    let abort!: () => void;
    let job: Job;
    const done = new Promise<any>((resolve, reject) => {
      job = { from: 0, ...parcel, tell, resolve, reject, begun: 0 };
      abort = () => {
        if (running === job) {
          end();
          running = undefined;
        } else queue.splice(queue.indexOf(job), 1);
        reject(signal!.reason);
        next();
      };
      signal?.addEventListener('abort', abort);
      queue.push(job);
      next();
    });
    try {
      const result = await done;
      const total = performance.now() - job!.begun;
      tell('done', 1);
      if (result?.report) result.report.milliseconds.total = total;
      return result;
    } finally {
      signal?.removeEventListener('abort', abort);
    }
  }

  const gone = () => input('the estimator was disposed; create another');

  const estimator: Estimator = {
    estimateNormals: (positions, options = {}) => run(options, () => packPositions(positions, options)),

    readPointCloud: (source, options = {}) =>
      run(options, async (tell) => {
        const { maxPoints } = options;
        if (maxPoints !== undefined && !whole(maxPoints, 0, 2 ** 53))
          throw input(`maxPoints is ${maxPoints}; wanted a whole number`);
        const { bytes: file, from } = await fetchSource(source, tell, options.signal);
        return { call: { kind: 'read', file, maxPoints }, transfer: buffersOf(file), from };
      }),

    writePly: (cloud, add, options = {}) =>
      run(options, async (tell) => {
        const { format = 'binary_little_endian' } = options;
        const ascii = format === 'ascii';
        if (!ascii && format !== 'binary_little_endian')
          throw input(`format is ${format}; wanted 'binary_little_endian' or 'ascii'`);
        if ('positions' in cloud) return packCloud(cloud, add ?? {}, ascii);
        const normals = floats(add?.normals, 'normals');
        const curvature = floats(add?.curvature, 'curvature');
        const { bytes: file, from } = await fetchSource(cloud, tell, options.signal);
        const call: Call = { kind: 'write', file, normals, curvature, ascii };
        return { call, transfer: buffersOf(file, normals, curvature), from };
      }),

    features: async () => detect(),

    dispose() {
      disposed = true;
      end();
      const error = gone();
      for (const job of [running, ...queue.splice(0)]) job?.reject(error);
      running = undefined;
    },
  };

  /** A download takes the first half of the progress. */
  async function fetchSource(source: unknown, tell: Job['tell'], signal?: AbortSignal) {
    const tellDownload = (fraction: number) => tell('download', fraction / 2);
    const { bytes, downloaded } = await resolve(source, host.files, tellDownload, signal);
    return { bytes, from: downloaded ? 0.5 : 0 };
  }

  return [estimator, () => run({}, () => ({ call: { kind: 'hello' }, transfer: [] }))];
}

/** The buffers among these, which go to the worker without another copy. */
const buffersOf = (...parts: (Bytes | undefined)[]) =>
  parts.flatMap((part) => (part instanceof Uint8Array ? [part.buffer as ArrayBuffer] : []));

/** A copy of an optional array of floats, checked. */
function floats(array: unknown, name: string, length?: number): Uint8Array | undefined {
  if (array === undefined) return;
  if (kindOf(array) !== 'Float32Array') throw input(`${name} is ${describe(array)}; wanted a Float32Array`);
  return sized(array as Float32Array, name, length);
}

function sized(array: Float32Array | Uint8Array, name: string, length = array.length): Uint8Array {
  if (array.length !== length) throw input(`${name} has ${array.length} numbers; wanted ${length}`);
  return copyOf(array);
}

function checkPositions(positions: unknown, kinds: string[]): asserts positions is Positions {
  if (!kinds.includes(kindOf(positions)))
    throw input(`positions is ${describe(positions)}; wanted a ${kinds.join(' or ')} with x y z of each point`);
  const { length } = positions as Positions;
  if (length % 3) throw input(`positions has ${length} numbers; wanted a multiple of 3 (x y z of each point)`);
}

function packPositions(positions: Positions, options: object): Parcel {
  checkPositions(positions, ['Float32Array', 'Float64Array']);
  const { method, cell, k, orient, curvature, transfer } = options as any;
  const { buffer, byteLength } = positions;
  const double = positions.BYTES_PER_ELEMENT === 8;
  let plain: object;
  let bytes: Uint8Array;
  try {
    // What waits in the queue must not change with what the caller does to its own.
    plain = structuredClone({ method, cell, k, orient, curvature });
  } catch (error) {
    throw input(`the options cannot be passed to a worker: ${(error as Error).message}`);
  }
  if (transfer && byteLength === buffer.byteLength && byteLength && kindOf(buffer) === 'ArrayBuffer') {
    try {
      bytes = new Uint8Array(structuredClone(buffer, { transfer: [buffer as ArrayBuffer] }));
    } catch (error) {
      throw input(`the buffer of positions cannot be transferred: ${(error as Error).message}`);
    }
  } else bytes = copyOf(positions);
  return { call: { kind: 'estimate', positions: bytes, double, options: plain }, transfer: buffersOf(bytes) };
}

function packCloud(cloud: PointCloud, add: { normals?: unknown; curvature?: unknown }, ascii: boolean): Parcel {
  checkPositions(cloud.positions, ['Float32Array']);
  const count = cloud.positions.length / 3;
  const origin = Float64Array.from(cloud.origin ?? [0, 0, 0]);
  if (origin.length !== 3) throw input(`origin has ${origin.length} numbers; wanted 3`);
  if (cloud.colors && kindOf(cloud.colors) !== 'Uint8Array')
    throw input(`colors is ${describe(cloud.colors)}; wanted a Uint8Array`);
  const call: Call = {
    kind: 'writeCloud',
    positions: copyOf(cloud.positions),
    origin,
    normals: floats(add.normals ?? cloud.normals, 'normals', 3 * count),
    colors: cloud.colors && sized(cloud.colors, 'colors', 4 * count),
    intensity: floats(cloud.intensity, 'intensity', count),
    curvature: floats(add.curvature, 'curvature', count),
    comments: [...(cloud.source?.comments ?? [])],
    ascii,
  };
  const { positions, normals, colors, intensity, curvature } = call;
  return { call, transfer: buffersOf(positions, normals, colors, intensity, curvature) };
}
