import type { Features } from './types.js';

/** The smallest module that uses a vector. */
const vectorModule = [
  0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11,
];

/** What this engine and this page allow. In a worker it answers for the worker. */
export function detect(): Features {
  const simd = !!globalThis.WebAssembly?.validate(new Uint8Array(vectorModule));
  // Node has no such flag, because it needs none.
  const isolated = globalThis.crossOriginIsolated ?? typeof SharedArrayBuffer === 'function';
  let reason: string | undefined;
  if (!simd) reason = 'no WebAssembly SIMD in this engine';
  else if (!isolated)
    reason = 'not cross-origin isolated; see the headers Cross-Origin-Opener-Policy and Cross-Origin-Embedder-Policy';
  else {
    try {
      // WebKitGTK has such memory, but lets no other thread have it.
      new SharedArrayBuffer(0);
      new WebAssembly.Memory({ initial: 1, maximum: 1, shared: true });
    } catch {
      reason = 'no shared WebAssembly memory in this engine';
    }
  }
  return { threads: !reason, simd, crossOriginIsolated: isolated, ...(reason && { reason }) };
}
