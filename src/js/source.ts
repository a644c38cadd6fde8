// What callers pass, as bytes on their way to the worker.
import { BilinormalError } from './error.js';
import type { Bytes } from './protocol.js';

/** The kind of a value, right across windows and workers: `Float32Array`, `Blob`, `Null`. */
export const kindOf = (value: unknown): string => Object.prototype.toString.call(value).slice(8, -1);

/** Throws an `input` error that says what came and what was wanted, unless all is well. */
export function want(well: unknown, name: string, value: any, wanted: string): asserts well {
  if (well) return;
  const text = Object(value) === value ? `${kindOf(value)}(${value.length ?? ''})` : String(value);
  // Not more than a line of it.
  const [line] = /\S.{0,59}|$/.exec(text)!;
  throw new BilinormalError('input', `${name} is ${typeof value === 'string' ? `'${line}'` : line}; wanted ${wanted}`);
}

/** A buffer, or as much of one as a view has. */
export type Part = { buffer?: ArrayBufferLike; byteOffset?: number; byteLength: number };

/** The bytes of a buffer or view in a buffer of their own: copied, or taken where `take` is set and all of it came. */
export function own(from: Part, take?: boolean): Uint8Array<ArrayBuffer> {
  const { buffer = from as ArrayBuffer, byteOffset = 0, byteLength } = from;
  try {
    // Throws if the view reaches beyond what is left of a resizable buffer: its length is 0 then.
    (from as Partial<Uint8Array>).keys?.();
    const bytes = new Uint8Array(buffer, byteOffset, byteLength);
    return take &&
      byteLength === buffer.byteLength &&
      kindOf(buffer) === 'ArrayBuffer' &&
      !(buffer as { resizable?: boolean }).resizable
      ? new Uint8Array(structuredClone(buffer as ArrayBuffer, { transfer: [buffer as ArrayBuffer] }))
      : bytes.slice();
  } catch (error) {
    // A RangeError: no memory for the copy. Any other: the buffer is detached, or its owner keeps it.
    const { message } = error as Error;
    throw error instanceof RangeError
      ? new BilinormalError('limit', `${message}; use transfer: true or fewer points`, { needed: byteLength })
      : new BilinormalError('input', `the buffer cannot be taken: ${message}`);
  }
}

/** Turns a source into bytes, by a download if need be. `files`: something if addresses of local files can be opened. */
export async function resolve(
  source: any,
  files: unknown,
  tell: (phase: string, fraction: number) => void,
  signal: AbortSignal,
): Promise<Bytes> {
  const kind = kindOf(source);
  if (/^(Blob|File)$/.test(kind)) return source;
  if (/^(Uint8Array|(Shared)?ArrayBuffer)$/.test(kind)) return own(source);
  const fail = (what: string): never => {
    throw new BilinormalError('input', `${kind === 'URL' ? source : source.url || 'the Response'} ${what}`);
  };
  const broken = (what: string) => (error: any) => fail(`${what}: ${error?.cause?.message ?? error?.message ?? error}`);
  let response: Response = source;
  if (kind === 'URL') {
    if (files && source.protocol === 'file:') return source.href;
    tell('download', 0);
    response = await fetch(source, { signal }).catch(broken('did not load'));
  } else want(kind === 'Response', 'the source', source, 'a File, Blob, ArrayBuffer, Uint8Array, URL or Response');

  const { ok, status, body, bodyUsed, headers } = response;
  if (!ok) fail(`has HTTP status ${status}`);
  if (bodyUsed) fail('was read before');
  const total = Number(headers.get('content-length'));
  let loaded = 0;
  // Counted on its way into a Blob, which the browser keeps where it likes.
  const count = new TransformStream<Uint8Array, Uint8Array>({
    transform(piece, controller) {
      loaded += piece.byteLength;
      // Half of the progress. A compressed body is longer than its declared length.
      if (total) tell('download', Math.min(1, loaded / total) / 2);
      controller.enqueue(piece);
    },
  });
  return new Response(body?.pipeThrough(count, { signal })).blob().catch(broken('broke off'));
}
