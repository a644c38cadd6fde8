// Which of the two builds runs, and its start.
import { coded } from './failure.js';
import { pool } from './pool.js';
import type { Mode, Start, StartWorker } from './protocol.js';
import type { Glue, ThreadsGlue } from './wasm.js';

/** What a worker needs from where it runs. */
export interface Platform {
  processors: number;
  startThread: StartWorker;
  load(url: URL): Promise<ArrayBuffer>;
  /** Opens a local file by its address, where there are such. */
  open?(url: string): { size: number; slice(from: number, to: number): { arrayBuffer(): Promise<ArrayBuffer> } };
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
      reason = `threads did not start: ${(error as Error).message}`;
    }
  }
  return loadSingle(start, platform, { mode: 'single', threads: 1, ...(reason && { fallbackReason: reason }) });
}

async function loadThreads(threads: number, start: Start, platform: Platform): Promise<Loaded> {
  const core = () => new URL('./threads/core.wasm', import.meta.url);
  const full = () => new URL('./threads/full.wasm', import.meta.url);
  const [glue, module]: [ThreadsGlue, WebAssembly.Module] = await Promise.all([
    import('./threads/bilinormal.js' as string),
    compile(start, 'threads', core, full, platform),
  ]);
  const [memory, most] = await begin(glue, module, createMemory(start, true));
  pool.start = platform.startThread;
  pool.channel = start.channel;
  await glue.initThreadPool(threads);
  return { glue, memory, most, mode: { mode: 'threads', threads } };
}

async function loadSingle(start: Start, platform: Platform, mode: Mode): Promise<Loaded> {
  const core = () => new URL('./single/core.wasm', import.meta.url);
  const full = () => new URL('./single/full.wasm', import.meta.url);
  const [glue, module]: [Glue, WebAssembly.Module] = await Promise.all([
    import('./single/bilinormal.js' as string),
    compile(start, 'single', core, full, platform),
  ]);
  const [memory, most] = await begin(glue, module, createMemory(start, false));
  return { glue, memory, most, mode };
}

async function begin(glue: Glue, module: WebAssembly.Module, [memory, pages]: ReturnType<typeof createMemory>) {
  await glue.default({ module_or_path: module, memory });
  glue.setMaximum(pages);
  return [memory, pages * 65536] as const;
}

// Not streamed: that would refuse servers which send .wasm under another media type, for a file this small.
async function compile(start: Start, build: string, core: () => URL, full: () => URL, { load }: Platform) {
  const { wasmUrl } = start;
  const url = wasmUrl ? new URL(`${build}${start.full ? '-full' : ''}.wasm`, wasmUrl) : start.full ? full() : core();
  try {
    return await WebAssembly.compile(await load(url));
  } catch (error) {
    throw coded('unsupported', `${url.href} did not load: ${(error as Error).message}`);
  }
}

/** Shared memory is reserved at its maximum, and some engines refuse a large one: steps down until one is granted. */
function createMemory({ memoryMaxMiB = 4096 }: Start, shared: boolean) {
  for (let maximum = memoryMaxMiB * 16; ; maximum = Math.floor(maximum / 2)) {
    try {
      return [new WebAssembly.Memory({ initial: initialPages, maximum, shared }), maximum] as const;
    } catch (error) {
      if (maximum / 2 < leastMiB * 16) throw error;
    }
  }
}
