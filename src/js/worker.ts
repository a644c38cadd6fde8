// The worker, in a browser.
import { buffersOf, starter } from './link.js';
import { serve } from './serve.js';

const receive = serve((reply) => postMessage(reply, { transfer: buffersOf(reply) }), {
  processors: navigator.hardwareConcurrency,
  startThread: starter(() => new Worker(new URL('./thread.js', import.meta.url), { type: 'module' })),
  async load(url) {
    const response = await fetch(url);
    if (!response.ok) throw new Error(`HTTP status ${response.status}`);
    return response.arrayBuffer();
  },
});

onmessage = (event) => receive(event.data);
