// Browser workers as links, wherever the package was loaded from.
import type { Link } from './protocol.js';

/** Whether `module` was loaded from another origin than the page, where browsers refuse to start a worker. */
export function isForeign(module: string): boolean {
  return /^https?:/.test(module) && new URL(module).origin !== origin;
}

/** Starts a worker of another origin: a Blob of this origin imports it. */
export function startForeign(file: string, module: string): Worker {
  const code = `import ${JSON.stringify(new URL(file, module).href)}`;
  const url = URL.createObjectURL(new Blob([code], { type: 'text/javascript' }));
  const worker = new Worker(url, { type: 'module' });
  worker.addEventListener('message', () => URL.revokeObjectURL(url), { once: true });
  return worker;
}

export function link(worker: Worker, receive: (message: any) => void, fail: (reason: string) => void): Link {
  worker.onmessage = (event) => receive(event.data);
  worker.onerror = (event) => {
    event.preventDefault();
    fail(event.message || 'its script did not load');
  };
  return {
    post: (message, transfer = []) => worker.postMessage(message, transfer),
    hold() {},
    end: () => worker.terminate(),
  };
}
