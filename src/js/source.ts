// What callers pass, as bytes on their way to the worker.
import { BilinormalError } from './error.js';
import type { Bytes } from './protocol.js';

/** The kind of a value, right across windows and workers: `Float32Array`, `Blob`, `Null`. */
export const kindOf = (value: unknown): string => Object.prototype.toString.call(value).slice(8, -1);

/** What came, for an error: `Array(12)`, `Null`, `String(3)`. */
export function describe(value: any): string {
  const length = value?.length;
  return kindOf(value) + (typeof length === 'number' ? `(${length})` : '');
}

/** The bytes of a view, in a buffer of their own. */
export function copyOf(view: ArrayBufferView): Uint8Array<ArrayBuffer> {
  try {
    return new Uint8Array(view.buffer, view.byteOffset, view.byteLength).slice();
  } catch (error) {
    if (error instanceof RangeError) {
      const needed = view.byteLength;
      throw new BilinormalError('limit', `no memory for a copy of ${needed} bytes; use transfer: true`, { needed });
    }
    throw new BilinormalError('input', 'the buffer is detached: it was transferred before');
  }
}

/** Turns a source into bytes; downloads it if need be. `files`: whether addresses of local files can be opened. */
export async function resolve(
  source: unknown,
  files: boolean,
  tell: (fraction: number) => void,
  signal?: AbortSignal,
): Promise<{ bytes: Bytes; downloaded?: boolean }> {
  switch (kindOf(source)) {
    case 'Blob':
    case 'File':
      return { bytes: source as Blob };
    case 'ArrayBuffer':
    case 'SharedArrayBuffer':
      return { bytes: copyOf(new DataView(source as ArrayBuffer)) };
    case 'Uint8Array':
      return { bytes: copyOf(source as Uint8Array) };
    case 'URL': {
      const url = source as URL;
      if (files && url.protocol === 'file:') return { bytes: url.href };
      tell(0);
      const response = await fetch(url, { signal: signal ?? null }).catch((error) => {
        throw new BilinormalError(
          'input',
          `${url.href} could not be fetched: ${error.cause?.message ?? error.message}`,
        );
      });
      return { bytes: await download(response, tell, signal), downloaded: true };
    }
    case 'Response':
      return { bytes: await download(source as Response, tell, signal), downloaded: true };
  }
  throw new BilinormalError(
    'input',
    `the source is ${describe(source)}; wanted a File, Blob, ArrayBuffer, Uint8Array, URL or Response`,
  );
}

/** Into a Blob, which the browser keeps where it likes. */
async function download(response: Response, tell: (fraction: number) => void, signal?: AbortSignal): Promise<Blob> {
  const { ok, status, url, body, bodyUsed, headers } = response;
  if (!ok) throw new BilinormalError('input', `${url || 'the Response'} answered with HTTP status ${status}`);
  if (bodyUsed) throw new BilinormalError('input', 'the Response was read before; pass a fresh one');
  if (!body) return new Blob();
  const total = Number(headers.get('content-length'));
  let loaded = 0;
  const count = new TransformStream<Uint8Array, Uint8Array>({
    transform(piece, controller) {
      loaded += piece.byteLength;
      // A compressed body is longer than its declared length.
      if (total) tell(Math.min(1, loaded / total));
      controller.enqueue(piece);
    },
  });
  return new Response(body.pipeThrough(count, { signal })).blob();
}
