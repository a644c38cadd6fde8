// Browser workers as links, wherever the package was loaded from.
import { buffersOf } from './buffers.js';
import type { StartWorker } from './protocol.js';

// For the worker, which loads this file anyway: else that one too would come with a copy.
export { buffersOf };

/** How to start a worker: `direct` does it, in the one form that bundlers know and put their own address into. */
export const starter =
  (direct: () => Worker): StartWorker =>
  (receive, fail) => {
    const worker = fromAnywhere(direct);
    worker.onmessage = (event) => receive(event.data);
    // Without a message: the script did not load, or what it sent cannot be read.
    worker.onmessageerror = worker.onerror = (event: any) => {
      event.preventDefault();
      fail(event.message);
    };
    return {
      post: (message) => worker.postMessage(message, buffersOf(message)),
      end: () => worker.terminate(),
    };
  };

/**
 * The worker that `direct` starts. Browsers refuse scripts from another origin, where the package or a bundle may lie: then a
 * Blob of this origin imports the script. Only the call itself has its address, so that is where it is seen.
 */
function fromAnywhere(direct: () => Worker): Worker {
  const Own = Worker;
  self.Worker = class extends Own {
    constructor(script: any, options?: WorkerOptions) {
      // In double quotes, which addresses have escaped.
      const code = options?.type ? `import "${script}"` : `importScripts("${script}")`;
      if (/^http/.test(script) && new URL(script).origin !== origin)
        script = URL.createObjectURL(new Blob([code], { type: 'text/javascript' }));
      super(script, options);
      // Not before it has loaded: engines differ in when they read it.
      this.addEventListener('message', () => URL.revokeObjectURL(script), { once: true });
    }
  };
  try {
    return direct();
  } finally {
    self.Worker = Own;
  }
}
