// The threads of the threads build. The generated glue calls `startWorkers` in place of the helper that wasm-bindgen-rayon
// brings: that one starts only in browsers, only from the page's own origin, and waits for ever for a worker that does not
// load.
import type { Link, StartWorker, ThreadBoot } from './protocol.js';

/** Longest wait for all threads to answer, in seconds. Each loads a small script and a module that is compiled. */
const patience = 8;

export interface PoolBuilder {
  numThreads(): number;
  receiver(): number;
  build(): void;
}

/**
 * Starts the threads, waits until all of them are ready to take work, and lets rayon hand it to them. Answers what must be kept:
 * Firefox collects workers that nobody refers to (bug 1702191), and a collected builder frees what threads wait on.
 */
export async function startWorkers(
  start: StartWorker,
  channel: string,
  module_or_path: WebAssembly.Module,
  memory: WebAssembly.Memory,
  builder: PoolBuilder,
): Promise<unknown> {
  const boot: ThreadBoot = { module_or_path, memory, receiver: builder.receiver(), channel };
  const links: Link[] = [];
  let waiting = builder.numThreads();
  let timer;
  try {
    await new Promise<void>((resolve, reject) => {
      const fail = (reason?: string) => reject(new Error(reason));
      timer = setTimeout(fail, patience * 1000, `no answer in ${patience} s`);
      for (let i = waiting; i--;) {
        const link = start((reason?: string) => (reason ? fail(reason) : --waiting || resolve()), fail);
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
  return [links, builder];
}
