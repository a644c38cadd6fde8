// The border to the wasm modules, as the generated glue in single/ and threads/ exports it.

import type { PoolBuilder } from './pool.js';

/** Hears where a call stands; `fraction` is of the whole call into wasm. */
export type Tell = (phase: string, fraction: number) => void;

/** Bytes owned by wasm. */
export interface Buffer {
  readonly pointer: number;
  readonly byteLength: number;
  free(): void;
}

export interface Estimation {
  normals: Buffer;
  curvature?: Buffer;
  components?: Buffer;
  report: object;
}

/** A point cloud as it leaves the worker, but with buffers in place of its arrays. */
export interface Cloud {
  count: number;
  origin: number[];
  source: object;
  positions: Buffer;
  normals?: Buffer;
  colors?: Buffer;
  intensity?: Buffer;
}

/** The bytes of a file from one to another, in pieces of some length. */
export interface Pieces {
  from: number;
  to: number;
  step: number;
}

/** A build's exports. Calls consume the buffers they are given. */
export interface Glue {
  default(options: {
    module_or_path: WebAssembly.Module;
    memory?: WebAssembly.Memory;
  }): Promise<{ memory: WebAssembly.Memory }>;
  /** Tells how many pages of 64 KiB the memory may grow to. */
  setMaximum(pages: number): void;
  Buffer: new (byteLength: number) => Buffer;
  estimate(positions: Buffer, double: boolean, options: object, tell: Tell): Estimation;
  /** `file` is a piece of a file of `size` bytes, of which the answer asks for more, or all there is if `size` is 0. */
  readPly(file: Buffer, maxPoints: number, size: number, tell: Tell): Pieces | Cloud | undefined;
  /**
   * `file` is the next piece of a file of `size` bytes, the first with the normals and the curvature that are `added`; the
   * answer is what follows in the output.
   */
  writePly(file: Buffer, ascii: boolean, size: number, tell: Tell, ...added: (Buffer | undefined)[]): Buffer;
  writeCloud(
    positions: Buffer,
    origin: Float64Array,
    normals: Buffer | undefined,
    colors: Buffer | undefined,
    intensity: Buffer | undefined,
    curvature: Buffer | undefined,
    comments: string[],
    ascii: boolean,
    tell: Tell,
  ): Buffer;
}

/** What only the threads build exports. */
export interface ThreadsGlue extends Glue {
  /** How `initThreadPool` starts the threads, to be set before, and what must be kept as long as they run. */
  pool: {
    start?(module: WebAssembly.Module, memory: WebAssembly.Memory, builder: PoolBuilder): Promise<void>;
    kept?: unknown;
  };
  initThreadPool(threads: number): Promise<void>;
  wbg_rayon_start_worker(receiver: number): void;
}
