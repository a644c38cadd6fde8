// Browser workers as links, wherever the package was loaded from.
import type { StartWorker } from './protocol.js';

/**
 * How to start a worker: `direct` does it, in the one form that bundlers know. But where `module`, the script that asks
 * for it, was loaded from another origin, browsers refuse that; then a Blob of this origin imports `file`.
 */
export const starter =
  (file: string, module: string, direct: () => Worker): StartWorker =>
  (receive, fail) => {
    const worker =
      /^http/.test(module) && new URL(module).origin !== origin ? viaBlob(new URL(file, module)) : direct();
    worker.onmessage = (event) => receive(event.data);
    // Without a message: the script did not load, or what it sent cannot be read.
    worker.onmessageerror = worker.onerror = (event: any) => {
      event.preventDefault();
      fail(event.message || 'it did not load');
    };
    return {
      post: (message, transfer = []) => worker.postMessage(message, transfer),
      hold() {},
      end: () => worker.terminate(),
    };
  };

function viaBlob(script: URL): Worker {
  const url = URL.createObjectURL(new Blob([`import ${JSON.stringify(script)}`], { type: 'text/javascript' }));
  const worker = new Worker(url, { type: 'module' });
  worker.addEventListener('message', () => URL.revokeObjectURL(url), { once: true });
  return worker;
}
