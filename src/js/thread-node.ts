// One thread of the pool, in Node.
import { parentPort } from 'node:worker_threads';
import { runThread } from './run-thread.js';

parentPort!.once('message', (boot) => runThread(boot, (reason) => parentPort!.postMessage(reason)));
