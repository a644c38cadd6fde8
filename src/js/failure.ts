// Errors on their way out of the worker.
import type { ErrorCode, ErrorDetails } from './error.js';

export interface Failure extends ErrorDetails {
  /** Without a code, the wasm module broke. */
  code?: ErrorCode;
  message: string;
  /** The worker is of no more use. */
  fatal?: boolean;
}

/** An error of the worker's own; the calling thread makes a BilinormalError of it. */
export const coded = (code: ErrorCode, message: string, more?: Partial<Failure>) =>
  Object.assign(new Error(message), { code }, more);

/** Packs what was thrown, without what is undefined. */
export function failure(error: unknown): Failure {
  const { code, message = String(error) } = error as Partial<Failure>;
  return /^(format|input|limit|unsupported)$/.test(code!)
    ? JSON.parse(JSON.stringify(error, ['code', 'message', 'line', 'byte', 'needed', 'available', 'fatal']))
    : { message };
}
