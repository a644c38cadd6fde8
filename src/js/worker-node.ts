// The worker, in Node.
import { closeSync, fstatSync, openSync, readSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { availableParallelism } from 'node:os';
import { fileURLToPath } from 'node:url';
import { Worker, parentPort } from 'node:worker_threads';
import { buffersOf } from './buffers.js';
import { link } from './node-link.js';
import { serve } from './serve.js';

const port = parentPort!;

const receive = serve((reply) => port.postMessage(reply, buffersOf(reply)), {
  processors: availableParallelism(),
  startThread: (receive, fail) =>
    link(new Worker(new URL('./thread-node.js', import.meta.url), { execArgv: [] }), receive, fail),
  async load(url) {
    if (url.protocol === 'file:') return new Uint8Array(await readFile(url)).buffer;
    const response = await fetch(url);
    if (!response.ok) throw new Error(`HTTP status ${response.status}`);
    return response.arrayBuffer();
  },
  open,
});
port.on('message', receive);

/** A file as far as a Blob is needed; `openAsBlob` would be one, but Node warns that it is experimental. */
function open(url: string) {
  const path = fileURLToPath(url);
  const using = <T>(work: (file: number) => T): T => {
    const file = openSync(path, 'r');
    try {
      return work(file);
    } finally {
      closeSync(file);
    }
  };
  const { size } = using((file) => fstatSync(file));
  return {
    size,
    slice: (from: number, to: number) => ({
      async arrayBuffer() {
        const bytes = new Uint8Array(Math.min(to, size) - from);
        const read = using((file) => readSync(file, bytes, 0, bytes.length, from));
        if (read < bytes.length) throw new Error(`it is shorter than a moment ago: no more than ${from + read} bytes`);
        return bytes.buffer;
      },
    }),
  };
}
