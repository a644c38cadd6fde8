// Node's worker threads as links.
import type { Worker } from 'node:worker_threads';
import type { Link } from './protocol.js';

export function link(worker: Worker, receive: (message: any) => void, fail: (reason: string) => void): Link {
  worker.on('message', receive);
  worker.on('messageerror', (error) => fail(error.message));
  worker.on('error', (error) => fail(error.message));
  worker.on('exit', (code) => fail(`exit code ${code}`));
  worker.unref();
  return {
    post: (message, transfer = []) => worker.postMessage(message, transfer as ArrayBuffer[]),
    hold: (pending) => (pending ? worker.ref() : worker.unref()),
    end: () => void worker.terminate(),
  };
}
