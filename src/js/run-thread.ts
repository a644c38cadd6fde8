import type { ThreadBoot } from './protocol.js';
import type { ThreadsGlue } from './wasm.js';

/** Joins the pool and stays in it. `answer` gets nothing when the thread is ready, else why it is not. */
export async function runThread(boot: ThreadBoot, answer: (reason?: string) => void) {
  let tell = answer;
  try {
    const glue: ThreadsGlue = await import('./threads/bilinormal.js' as string);
    await glue.default({ module_or_path: boot.module, memory: boot.memory });
    answer();
    // The worker that owns this thread waits inside wasm from now on and hears nothing: tell the calling thread.
    tell = (reason) => new BroadcastChannel(boot.channel).postMessage(reason);
    glue.wbg_rayon_start_worker(boot.receiver);
  } catch (error) {
    tell(String(error));
  }
}
