// The threads of the threads build. The generated glue imports `startWorkers` from here, in place of the helper that
// wasm-bindgen-rayon brings: that one starts only in browsers, only from the page's own origin, and waits for ever
// for a worker that does not load.
import type { Link, StartWorker, ThreadBoot } from './protocol.js';

/** Longest wait for all threads to answer, in seconds. Each loads a small script and a module that is compiled. */
const patience = 8;

interface PoolBuilder {
  numThreads(): number;
  receiver(): number;
  build(): void;
}

/** How to start a thread; the worker that owns the pool sets it before it asks for threads. */
export const pool: { start?: StartWorker; channel: string; kept?: unknown } = { channel: '' };

/** Starts the threads, waits until all of them are ready to take work, and lets rayon hand it to them. */
export async function startWorkers(
  module_or_path: WebAssembly.Module,
  memory: WebAssembly.Memory,
  builder: PoolBuilder,
) {
  const boot: ThreadBoot = { module_or_path, memory, receiver: builder.receiver(), channel: pool.channel };
  const links: Link[] = [];
  let waiting = builder.numThreads();
  let timer;
  try {
    await new Promise<void>((resolve, reject) => {
      const fail = (reason?: string) => reject(new Error(reason));
      timer = setTimeout(fail, patience * 1000, `no answer in ${patience} s`);
      for (let i = waiting; i--;) {
        const link = pool.start!((reason?: string) => (reason ? fail(reason) : --waiting || resolve()), fail);
        links.push(link);
        link.post(boot);
      }
    });
  } catch (error) {
    for (const link of links) link.end();
    throw error;
  } finally {
    clearTimeout(timer);
  }
  builder.build();
  // Firefox collects workers that nobody refers to (bug 1702191), and a collected builder frees what threads wait on.
  pool.kept = [links, builder];
}
