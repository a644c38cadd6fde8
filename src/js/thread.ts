// One thread of the pool, in a browser.
import type { ThreadBoot } from './protocol.js';
import { runThread } from './run-thread.js';

onmessage = (event: MessageEvent<ThreadBoot>) => runThread(event.data, (reason) => postMessage(reason));
