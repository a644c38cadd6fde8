// Node's worker threads as links.
import type { Worker } from 'node:worker_threads';
import { buffersOf } from './buffers.js';
import { BilinormalError } from './error.js';
import type { Link } from './protocol.js';

export function link(worker: Worker, receive: (message: any) => void, fail: (reason: string) => void): Link {
  worker.on('message', receive);
  worker.on('messageerror', (error) => fail(error.message));
  worker.on('error', (error) => fail(error.message));
  worker.on('exit', (code) => fail(`exit code ${code}`));
  worker.unref();
  return {
    post: (message) => {
      try {
        worker.postMessage(message, buffersOf(message));
      } catch (error) {
        // The Blobs that `fs.openAsBlob` makes cannot go to a worker.
        throw new BilinormalError('input', `${(error as Error).message}; wanted its bytes, or the URL of the file`);
      }
    },
    hold: (pending) => (pending ? worker.ref() : worker.unref()),
    end: () => void worker.terminate(),
  };
}
