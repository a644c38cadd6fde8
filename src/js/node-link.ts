// Node's worker threads as links.
import { Blob } from 'node:buffer';
import type { Worker } from 'node:worker_threads';
import { buffersOf } from './buffers.js';
import { BilinormalError } from './error.js';
import type { Link } from './protocol.js';
import { kindOf } from './source.js';

/** Of Blobs that are not Node's, as of jsdom or fetch-blob, nothing would arrive. */
const isForeign = (value: unknown) => /^(Blob|File)$/.test(kindOf(value)) && !(value instanceof Blob);

export function link(worker: Worker, receive: (message: any) => void, fail: (reason: string) => void): Link {
  worker.on('message', receive);
  worker.on('messageerror', (error) => fail(error.message));
  worker.on('error', (error) => fail(error.message));
  worker.on('exit', (code) => fail(`exit code ${code}`));
  worker.unref();
  return {
    post: (message: { data?: unknown[] }) => {
      try {
        if (message.data?.some(isForeign)) throw new Error("this Blob is not one of Node's");
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
