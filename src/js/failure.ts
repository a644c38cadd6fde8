// Errors on their way out of the worker.
import type { ErrorCode, ErrorDetails } from './error.js';

export interface Failure extends ErrorDetails {
  /** Without a code, the wasm module broke. */
  code?: ErrorCode;
  message: string;
  /** The worker is of no more use. */
  fatal?: boolean;
}

/**
 * An error of the worker's own, as those of wasm: the calling thread makes a BilinormalError of it. Not an Error, because those
 * of WebKit have a line of their own.
 */
export const coded = (code: ErrorCode, message: string, more?: Partial<Failure>): Failure => ({
  code,
  message,
  ...more,
});

/** Packs what was thrown. */
export function failure(error: any): Failure {
  const { code, message = String(error) } = error;
  return /^(format|input|limit|unsupported)$/.test(code) ? error : { message };
}
