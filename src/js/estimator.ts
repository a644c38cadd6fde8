// An estimator: its two workers, and the calls that wait for each.
import { BilinormalError } from './error.js';
import { detect } from './features.js';
import type { Call, Link, Reply, Start, StartWorker } from './protocol.js';
import { kindOf, own, resolve, want, type Part } from './source.js';
import type { EstimateOptions, Estimator, EstimatorOptions, Positions, ReadOptions } from './types.js';

/** What an estimator needs from where it runs. */
export interface Host {
  startWorker: StartWorker;
  /** The length of a local file; there where addresses of local files can be opened. */
  size?(source: unknown): number | undefined;
  /** What relative addresses count from. */
  base(): string;
}

/** Files that are larger are streamed: memory is for their points alone. */
const largeBytes = 3e8;

interface Job {
  call: Call;
  /** The call that is meant, where `call` only tries its options. */
  then: (() => Call) | undefined;
  signal?: AbortSignal;
  tell(phase: string, fraction: number): void;
  resolve(result: any): void;
  reject(error: unknown): void;
  begun: number;
}

type Prepared = readonly [call: Call, then?: () => Call];

/** Starts an estimator; resolves when its worker is ready. */
export async function createEstimator(host: Host, options: EstimatorOptions = {}): Promise<Estimator> {
  checkNames(options, 'threads, wasmUrl, memoryMaxMiB');
  const { threads = 'auto', memoryMaxMiB = 4096, wasmUrl } = options;
  const isWhole = (value: number, from: number, to: number) => Number.isInteger(value) && from <= value && value <= to;
  want(threads === 'auto' || isWhole(threads, 1, 256), 'threads', threads, `'auto' or 1 to 256`);
  want(isWhole(memoryMaxMiB, 16, 4096), 'memoryMaxMiB', memoryMaxMiB, '16 to 4096');
  let folder: string | undefined;
  try {
    if (/^(String|URL)$/.test(kindOf(wasmUrl))) folder = new URL(wasmUrl!, host.base()).href;
  } catch {
    // Told with the others.
  }
  want(folder || !wasmUrl, 'wasmUrl', wasmUrl, 'a valid URL or string');
  const [estimator, ready] = openEstimator(host, { threads, memoryMaxMiB, wasmUrl: folder });
  await ready();
  return estimator;
}

/** Refuses what is no object, and names that are misspelt, which may be inherited. */
function checkNames(options: object, names: string, what = 'options') {
  want(Object(options) === options, what, options, 'an object');
  for (const name in options) want(names.split(', ').includes(name), 'an option', name, `any of ${names}`);
}

/** Calls that wait for one worker, which starts with the first of them. */
function openQueue(host: Host, options: Omit<Start, 'kind' | 'channel'>) {
  let queue: Job[] = [];
  let running: Job | undefined;
  let link: Link | undefined;
  let channel: BroadcastChannel;
  /** One for each call that has not ended. */
  const open = new Set<AbortController>();
  let disposed: BilinormalError | undefined;

  function endWorker() {
    link?.end();
    link = undefined;
    channel?.close();
  }

  /** Settles the running call, if there is one, and goes on with the next. */
  function finish(how: 'resolve' | 'reject', value: unknown) {
    const job = running;
    running = undefined;
    job?.[how](value);
    next();
  }

  /** As `finish`, where the worker is of no more use; the next call starts another. */
  function crash(error: unknown) {
    endWorker();
    finish('reject', error);
  }

  function next() {
    if (running || disposed) return;
    // One signal may stop many calls, of which each hears in its turn.
    do running = queue.shift();
    while (running?.signal?.aborted);
    if (!running) return link?.hold?.(false);
    attempt((job) => {
      job.begun = performance.now();
      link ??= start();
      link.hold?.(true);
      link.post(job.call);
      job.tell('start', 0);
    });
  }

  /** Does what runs the caller's own function, which may throw, and may stop the running call: then another runs. */
  function attempt(action: (job: Job) => void, job = running!) {
    try {
      action(job);
    } catch (error) {
      if (running === job) crash(error);
    }
  }

  function start(): Link {
    const { simd, reason } = detect();
    if (!simd) throw new BilinormalError('unsupported', reason!);
    let answered = false;
    // Browsers do not say why a script did not load, and Chromium not even in its console that it lacks the header.
    const unloaded = 'it did not load; if isolated, see the header Cross-Origin-Embedder-Policy';
    const failure = (reason?: string) =>
      answered
        ? new BilinormalError('limit', `wasm broke, likely out of memory (${reason})`)
        : new BilinormalError('unsupported', `the worker did not start: ${reason || unloaded}`);
    const fail = (reason?: string) => {
      if (mine === link) crash(failure(reason));
    };
    const name = `${Math.random()}`;
    channel = new BroadcastChannel(name);
    channel.onmessage = (event) => fail(event.data);
    // Node: a channel alone does not keep the process alive.
    (channel as { unref?(): void }).unref?.();
    const receive = (reply: Reply) => {
      answered = true;
      if (mine !== link || !running) return;
      const { then } = running;
      if ('data' in reply) {
        running.then = undefined;
        if (then) attempt(() => link!.post(then()));
        else finish('resolve', reply.data);
      } else if ('phase' in reply) attempt((job) => then || job.tell(reply.phase, reply.fraction));
      else {
        const { code, message, fatal, ...details } = reply.failure;
        if (!code) return fail(message);
        if (fatal) endWorker();
        finish('reject', new BilinormalError(code, message, details));
      }
    };
    let mine: Link;
    try {
      mine = host.startWorker(receive, fail);
    } catch (error) {
      // The page's policy may forbid it.
      throw failure((error as Error).message);
    }
    mine.post({ ...options, kind: 'start', channel: name, reason });
    return mine;
  }

  /** Queues what `prepare` makes, which copies or takes the arguments before its first wait. */
  async function run(
    options: ReadOptions,
    names: string,
    prepare: (tell: Job['tell'], stop: AbortSignal) => Prepared | Promise<Prepared>,
  ): Promise<any> {
    checkNames(options, `${names}, onProgress, signal`);
    const { signal, onProgress } = options;
    want((onProgress ?? want).call, 'onProgress', onProgress, 'a function');
    want((signal ?? AbortSignal.prototype).throwIfAborted, 'signal', signal, 'an AbortSignal');
    signal?.throwIfAborted();
    let told = 0;
    const control = new AbortController();
    const stop = control.signal;
    const tell = (phase: string, fraction: number) => {
      told = Math.max(told, fraction);
      try {
        onProgress?.({ phase, fraction: told });
      } catch (error) {
        // As it is: a stream that it passes through makes another of it.
        control.abort(error);
        throw error;
      }
    };
    open.add(control);
    signal?.addEventListener('abort', () => control.abort(signal.reason), { signal: stop });
    try {
      if (disposed) throw disposed;
      const [call, then] = await prepare(tell, stop);
      stop.throwIfAborted();
      let job!: Job;
      const result: any = await new Promise((resolve, reject) => {
        job = { call, then, signal, tell, resolve, reject, begun: 0 };
        stop.addEventListener('abort', () => {
          if (running === job) return crash(stop.reason);
          queue = queue.filter((other) => other !== job);
          reject(stop.reason);
        });
        queue.push(job);
        next();
      });
      if (result.report) result.report.milliseconds.total = performance.now() - job.begun;
      tell('done', 1);
      return result;
    } catch (error) {
      if (stop.aborted) throw stop.reason;
      // What JavaScript itself finds wrong with arguments.
      throw error instanceof TypeError ? new BilinormalError('input', error.message) : error;
    } finally {
      open.delete(control);
      // Nobody listens any more.
      control.abort();
    }
  }

  function dispose() {
    disposed = new BilinormalError('input', 'the estimator was disposed');
    for (const control of open) control.abort(disposed);
    endWorker();
  }

  return { run, dispose };
}

/** The options that the worker gets. */
const values = 'method, cell, k, orient, curvature, components';

/** Whether the core suffices, which has no choices. The full module refuses other values. */
function isPlain({ method = 'bilinear', cell = 'auto', orient = 'none', k, curvature, components }: EstimateOptions) {
  return method === 'bilinear' && cell === 'auto' && orient === 'none' && k === undefined && !curvature && !components;
}

/** An estimator that starts a worker when a call needs one, and a call that does no more than that. */
export function openEstimator(
  host: Host,
  options: EstimatorOptions & { wasmUrl?: string },
): [Estimator, () => Promise<unknown>] {
  const core = openQueue(host, options);
  // What few callers need has a worker of its own, so that the other one keeps its module, which engines make faster
  // while it runs.
  const full = openQueue(host, { ...options, full: true });
  const estimator: Estimator = {
    estimateNormals: (positions, options = {}) =>
      (isPlain(options ?? {}) ? core : full).run(options, `${values}, transfer`, () => {
        const kind = kindOf(positions);
        want(/^Float(32|64)Array$/.test(kind), 'positions', positions, 'a Float32Array or Float64Array');
        countOf(positions);
        const { transfer = false } = options;
        want(typeof transfer === 'boolean', 'transfer', transfer, 'true or false');
        const copied = values.split(', ').map((name) => [name, copy(name, options[name as keyof EstimateOptions])]);
        const call = (part: Part, take?: boolean): Call => ({
          kind: 'estimate',
          data: [own(part, take), kind > 'Float5', Object.fromEntries(copied)],
        });
        // A buffer is not taken before the worker has tried the options, without points.
        return transfer
          ? [call({ buffer: positions.buffer, byteLength: 0 }), () => call(positions, true)]
          : [call(positions)];
      }),

    readPointCloud: (source: any, options = {}) => {
      const size = source?.size ?? host.size?.(source);
      const streamed = size > largeBytes && size;
      return (streamed ? full : core).run(options, 'maxPoints', async (tell, stop) => {
        const maxPoints = Number(options.maxPoints ?? Infinity);
        return [{ kind: 'readPly', data: [await resolve(source, host.size, tell, stop), maxPoints, streamed] }];
      });
    },

    writePly: (cloud, add, options = {}) =>
      full.run(options, 'format', async (tell, stop) => {
        // The last two are of a whole result, which may come too.
        checkNames(add, 'normals, curvature, components, report', 'add');
        const { format = 'binary_little_endian' } = options;
        const ascii = format === 'ascii';
        want(ascii || format === 'binary_little_endian', 'format', format, `'binary_little_endian' or 'ascii'`);
        const curvature = pack('curvature', add.curvature);
        const normals = pack('normals', add.normals);
        if (!(Object(cloud) === cloud && 'positions' in cloud))
          return [{ kind: 'writePly', data: [await resolve(cloud, host.size, tell, stop), ascii, normals, curvature] }];
        const positions = pack('positions', cloud.positions ?? null)!;
        const count = countOf(cloud.positions);
        want((cloud.count ?? count) === count, 'count', cloud.count, `${count}, that of positions`);
        const origin = Float64Array.from(cloud.origin ?? [0, 0, 0]);
        want(origin.length === 3 && origin.every(Number.isFinite), 'origin', cloud.origin, 'three finite numbers');
        const comments = [...(cloud.source?.comments ?? [])];
        for (const comment of comments) want(typeof comment === 'string', 'a comment', comment, 'a string');
        return [
          {
            kind: 'writeCloud',
            data: [
              positions,
              origin,
              normals ?? pack('normals', cloud.normals),
              pack('colors', cloud.colors, 'Uint8Array'),
              pack('intensity', cloud.intensity),
              curvature,
              comments,
              ascii,
            ],
          },
        ];
      }),

    features: async () => detect(),

    dispose() {
      core.dispose();
      full.dispose();
    },
  };

  return [estimator, () => core.run({}, '', () => [{ kind: 'hello', data: [] }])];
}

/** The number of points; refuses a part of one. */
function countOf({ length }: Positions) {
  want(length % 3 === 0, 'positions.length', length, 'a multiple of 3');
  return length / 3;
}

/** A copy of an option: what waits in the queue must not change, and a proxy of a framework cannot be posted. */
function copy(name: string, value: unknown) {
  try {
    return JSON.parse(JSON.stringify(value, keepNumbers));
  } catch {
    want(value === undefined, name, value, 'plain data');
  }
}

/** JSON has no NaN, no infinity and no bigint, but an error must say that they came. */
const keepNumbers = (_: string, value: unknown) =>
  /number|bigint/.test(typeof value) && !Number.isFinite(value) ? String(value) : value;

/** A copy of an optional array; the worker counts what is in it. */
function pack(name: string, array?: Float32Array | Uint8Array | null, kind = 'Float32Array'): Uint8Array | undefined {
  if (array === undefined) return;
  want(kindOf(array) === kind, name, array, `a ${kind}`);
  return own(array!);
}
