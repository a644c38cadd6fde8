// Which of the two builds runs, and its start.
import { coded } from './failure.js';
import { startWorkers } from './pool.js';
import type { Mode, Start, StartWorker } from './protocol.js';
import type { Glue, ThreadsGlue } from './wasm.js';

/** What a worker needs from where it runs. */
export interface Platform {
  processors: number;
  startThread: StartWorker;
  load(url: URL): Promise<ArrayBuffer>;
}

export interface Loaded {
  glue: Glue;
  memory: WebAssembly.Memory;
  /** Bytes that the memory may grow to. */
  most: number;
  mode: Mode;
}

/** More threads than this gain little: the work waits for memory. */
const mostThreads = 16;
/** What the modules begin with, in pages of 64 KiB: --initial-memory in scripts/*.toml, and some that wasm-bindgen adds. */
const initialPages = 9;
/** An engine that refuses this much shared memory gets no threads. */
const leastMiB = 512;

export async function load(start: Start, platform: Platform): Promise<Loaded> {
  const { threads = 'auto' } = start;
  const count = threads === 'auto' ? Math.min(platform.processors, mostThreads) : threads;
  let { reason } = start;
  if (count < 2) reason = threads === 1 ? undefined : 'there is one processor';
  else if (!reason) {
    try {
      return await loadThreads(count, start, platform);
    } catch (error) {
      reason = `threads did not start: ${(error as Error).message || 'they did not load'}`;
    }
  }
  return loadSingle(start, platform, { mode: 'single', threads: 1, ...(reason && { fallbackReason: reason }) });
}

async function loadThreads(threads: number, start: Start, platform: Platform): Promise<Loaded> {
  const url = () =>
    start.full ? new URL('./threads/full.wasm', import.meta.url) : new URL('./threads/core.wasm', import.meta.url);
  const module = compile(start, 'threads', url, platform);
  const loaded = await begin<ThreadsGlue>(import('./threads/bilinormal.js' as string), module, start, true);
  const { pool, initThreadPool } = loaded.glue;
  pool.start = async (...all) => {
    pool.kept = await startWorkers(platform.startThread, start.channel, ...all);
  };
  await initThreadPool(threads);
  return { ...loaded, mode: { mode: 'threads', threads } };
}

async function loadSingle(start: Start, platform: Platform, mode: Mode): Promise<Loaded> {
  const url = () =>
    start.full ? new URL('./single/full.wasm', import.meta.url) : new URL('./single/core.wasm', import.meta.url);
  const module = compile(start, 'single', url, platform);
  return { ...(await begin<Glue>(import('./single/bilinormal.js' as string), module, start, false)), mode };
}

async function begin<G extends Glue>(
  script: Promise<G>,
  compiled: Promise<WebAssembly.Module>,
  start: Start,
  shared: boolean,
) {
  const [glue, module_or_path] = await Promise.all([script, compiled]);
  const [memory, pages] = createMemory(start, shared);
  await glue.default({ module_or_path, memory });
  glue.setMaximum(pages);
  return { glue, memory, most: pages * 65536 };
}

// Not streamed: that would refuse servers which send .wasm under another media type, for a file this small.
async function compile({ wasmUrl, full }: Start, build: string, own: () => URL, { load }: Platform) {
  // A query stays: it may be a version, or a permit.
  const url = wasmUrl ? new URL(wasmUrl.replace(/\/*([?#]|$)/, `/${build}${full ? '-full' : ''}.wasm$1`)) : own();
  try {
    return await WebAssembly.compile(await load(url));
  } catch (error) {
    throw coded('unsupported', `${url.href} did not load: ${(error as Error).message}`);
  }
}

/**
 * Shared memory is reserved at its maximum, and some engines refuse a large one: steps down until one is granted. Not the last
 * page of all, because lol_alloc loses blocks that end where addresses do.
 */
function createMemory({ memoryMaxMiB = 4096 }: Start, shared: boolean) {
  for (let maximum = Math.min(memoryMaxMiB * 16, 65535); ; maximum = Math.ceil(maximum / 2)) {
    try {
      return [new WebAssembly.Memory({ initial: initialPages, maximum, shared }), maximum] as const;
    } catch (error) {
      if (maximum / 2 < leastMiB * 16) throw error;
    }
  }
}
