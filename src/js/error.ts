/**
 * `format`: what a file holds; `input`: the arguments, and files that do not open; `limit`: memory; `unsupported`: what the
 * engine lacks, or the package's own files that do not load.
 */
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

/** What the package's promises reject with, but for an abort, `signal.reason`, and what the caller's own functions throw. */
export class BilinormalError extends Error implements ErrorDetails {
  // Minified code gives classes other names.
  static override readonly name = 'BilinormalError';
  override readonly name = 'BilinormalError';
  declare readonly code: ErrorCode;
  declare readonly line?: number;
  declare readonly byte?: number;
  declare readonly needed?: number;
  declare readonly available?: number;

  constructor(code: ErrorCode, message: string, details?: ErrorDetails) {
    super(message);
    // In Safari that of the script.
    delete (this as ErrorDetails).line;
    this.code = code;
    Object.assign(this, details);
  }
}
