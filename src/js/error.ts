/** `format`: the file; `input`: the arguments; `limit`: memory; `unsupported`: this version or this engine. */
export type ErrorCode = 'format' | 'input' | 'limit' | 'unsupported';

/** What an error knows besides its text. */
export interface ErrorDetails {
  /** Line of a text file, from 1. */
  line?: number;
  /** Offset in a file, from 0. */
  byte?: number;
  /** Bytes of memory that were asked for. */
  needed?: number;
  /** Bytes of memory that were to be had. */
  available?: number;
}

/** Every error of this package, except that an abort rejects with `signal.reason`. */
export class BilinormalError extends Error implements ErrorDetails {
  override readonly name = 'BilinormalError';
  readonly code: ErrorCode;
  declare readonly line?: number;
  declare readonly byte?: number;
  declare readonly needed?: number;
  declare readonly available?: number;

  constructor(code: ErrorCode, message: string, details?: ErrorDetails) {
    super(message);
    this.code = code;
    Object.assign(this, details);
  }
}

/** An error as it crosses from the worker. */
export interface Failure extends ErrorDetails {
  /** Without a code, the wasm module broke. */
  code?: ErrorCode;
  message: string;
  /** The worker is of no more use. */
  fatal?: boolean;
}

/** Packs what was thrown for the way out of the worker, without what is undefined. */
export function failure(error: unknown): Failure {
  const { code, message = String(error), line, byte, needed, available } = error as Partial<Failure>;
  const known = ['format', 'input', 'limit', 'unsupported'].includes(code!);
  return known ? JSON.parse(JSON.stringify({ code, message, line, byte, needed, available })) : { message };
}
