import type { ThreadBoot } from './protocol.js';
// Made by the build, without types. Not imported on demand: Parcel tells only the worker where a script lies that both load.
// @ts-expect-error
import init, { wbg_rayon_start_worker } from './threads/bilinormal.js';

/** Joins the pool and stays in it. `answer` gets nothing when the thread is ready, else why it is not. */
export async function runThread(boot: ThreadBoot, answer: (reason?: string) => void) {
  let tell = answer;
  try {
    // V8 (Node 20) tells a thread of growth only once it has registered the memory that it was handed. Of what grew just before,
    // as for the stacks of other threads, this tells it: else bulk copies there would be out of bounds.
    boot.memory.grow(0);
    await init(boot);
    answer();
    // The worker that owns this thread waits inside wasm from now on and hears nothing: tell the calling thread.
    tell = (reason) => new BroadcastChannel(boot.channel).postMessage(reason);
    wbg_rayon_start_worker(boot.receiver);
  } catch (error) {
    tell(String(error));
  }
}
