import type { ThreadBoot } from './protocol.js';
import type { ThreadsGlue } from './wasm.js';

/** Joins the pool and stays in it. `answer` gets nothing when the thread is ready, else why it is not. */
export async function runThread(boot: ThreadBoot, answer: (reason?: string) => void) {
  let glue: ThreadsGlue;
  try {
    glue = await import('./threads/bilinormal.js' as string);
    await glue.default({ module_or_path: boot.module, memory: boot.memory });
  } catch (error) {
    return answer(String(error));
  }
  answer();
  try {
    glue.wbg_rayon_start_worker(boot.receiver);
  } catch (error) {
    // The worker that owns this thread waits inside wasm and hears nothing: tell the calling thread.
    new BroadcastChannel(boot.channel).postMessage(String(error));
  }
}
