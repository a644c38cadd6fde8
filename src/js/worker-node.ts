// The worker, in Node.
import { closeSync, openSync, readSync, statSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { availableParallelism } from 'node:os';
import { fileURLToPath } from 'node:url';
import { Worker, parentPort } from 'node:worker_threads';
import { buffersOf } from './buffers.js';
import { coded } from './failure.js';
import { link } from './node-link.js';
import type { OpenFile } from './protocol.js';
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
});
port.on('message', (message) => {
  // The address of a local file.
  if (typeof message.data?.[0] === 'string') message.data[0] = open(message.data[0]);
  receive(message);
});

/** A file as far as a Blob is needed; `openAsBlob` would be one, but Node warns that it is experimental. */
function open(url: string): OpenFile {
  const using = <T>(work: (file: number) => T): T => {
    const file = openSync(fileURLToPath(url), 'r');
    try {
      return work(file);
    } finally {
      closeSync(file);
    }
  };
  // That of the beginning: what comes later is of the same file, or an error.
  let size: number | undefined;
  return {
    get size() {
      try {
        if (size !== undefined) return size;
        const found = statSync(fileURLToPath(url));
        // To open a pipe may take for ever.
        if (!found.isFile()) throw new Error(found.isDirectory() ? 'it is a folder' : 'it is a pipe or a device');
        return (size = found.size);
      } catch (error) {
        throw coded('input', `the file could not be read: ${(error as Error).message}`);
      }
    },
    slice: (from: number, to: number) => ({
      async arrayBuffer() {
        const bytes = new Uint8Array(to - from);
        const read = using((file) => readSync(file, bytes, 0, bytes.length, from));
        // Of an empty file a byte is asked for, too.
        if (size === 0) return new ArrayBuffer(0);
        if (read < bytes.length) throw new Error(`it is shorter than a moment ago: no more than ${from + read} bytes`);
        return bytes.buffer;
      },
    }),
  };
}
