// What the page cannot do without, and what to tell a person whose browser lacks it.
import { features } from 'bilinormal';

/** The sentence to show, or undefined where everything is there. */
export async function missing(): Promise<string | undefined> {
  if (!document.createElement('canvas').getContext('webgl2')) {
    return 'This page draws with WebGL 2, which this browser does not have, or which is switched off.';
  }
  if (typeof WebAssembly === 'undefined') {
    return 'This page computes with WebAssembly, which this browser does not have, or which is switched off.';
  }
  if (!(await features()).simd || !('throwIfAborted' in AbortSignal.prototype)) {
    return 'This page needs a newer browser: Chrome or Edge from 100, Firefox from 114, Safari from 16.4.';
  }
  return undefined;
}
