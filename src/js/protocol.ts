// What the calling thread, the worker and the threads of its pool say to each other.
import type { Failure } from './failure.js';
import type { EstimatorOptions, Report } from './types.js';

/** A worker as its owner sees it, in browsers and in Node alike. */
export interface Link {
  /** Hands over the buffers of its arrays. */
  post(message: object): void;
  /** Whether the process must stay alive for it (Node only). */
  hold?(pending: boolean): void;
  end(): void;
}

/** Starts a worker. `fail` hears what goes wrong in it as a whole, and why, but for a script that did not load. */
export type StartWorker = (receive: (message: any) => void, fail: (reason?: string) => void) => Link;

/** What is needed of a Blob. */
export interface OpenFile {
  readonly size: number;
  slice(from: number, to: number): { arrayBuffer(): Promise<ArrayBuffer> };
}

/** Bytes on their way into wasm memory: a Blob to be streamed, bytes to be copied, or the address of a file that Node opens. */
export type Bytes = Blob | Uint8Array | string;

export interface Start extends EstimatorOptions {
  kind: 'start';
  wasmUrl?: string;
  /** Name of the BroadcastChannel on which a thread tells its death: the worker that owns it cannot, it waits for it. */
  channel: string;
  /** Whether to load the module with what few callers need: all but reading what is not large, and estimating by default. */
  full?: boolean;
  /** Why there can be no threads, found out by the calling thread. */
  reason?: string;
}

/** A function of the wasm module and what it is called with, arrays as their bytes; `hello` is none. */
export type Call =
  | { kind: 'hello'; data: [] }
  | { kind: 'estimate'; data: [positions: Uint8Array<ArrayBuffer>, double: boolean, options: { orient?: any }] }
  /** With `size`, that of a file, it is read in pieces. */
  | { kind: 'readPly'; data: [file: Bytes, maxPoints: number, size: number] }
  | { kind: 'writePly'; data: [file: Bytes, ascii: boolean, normals: Part, curvature: Part] }
  | {
      kind: 'writeCloud';
      data: [
        positions: Uint8Array,
        origin: Float64Array,
        normals: Part,
        colors: Part,
        intensity: Part,
        curvature: Part,
        comments: string[],
        ascii: boolean,
      ];
    };

type Part = Uint8Array | undefined;

export type Reply = { phase: string; fraction: number } | { failure: Failure } | { data: any };

/** Which build runs, as it enters the report. */
export type Mode = Pick<Report, 'mode' | 'threads' | 'fallbackReason'>;

/** What one thread of the pool needs; the glue takes the first two. */
export interface ThreadBoot {
  module_or_path: WebAssembly.Module;
  memory: WebAssembly.Memory;
  receiver: number;
  channel: string;
}
