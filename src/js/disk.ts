// The files of the command line, from and to a disk or a pipe, packed with gzip or not.
import { randomBytes } from 'node:crypto';
import { createReadStream, rmSync } from 'node:fs';
import { type FileHandle, access, constants, open, readlink, realpath, rename, stat } from 'node:fs/promises';
import { dirname, join, resolve, sep } from 'node:path';
import { Readable, type Transform } from 'node:stream';
import { pipeline } from 'node:stream/promises';
import { pathToFileURL } from 'node:url';
import { createGunzip, createGzip } from 'node:zlib';
import type { Source } from './types.js';

/** A regular file is read piece by piece in the worker, twice; what can be read only once, or is packed, is kept. */
export async function openInput(path: string): Promise<Source> {
  if (path !== '-') {
    const found = await stat(path);
    if (found.isDirectory()) throw Object.assign(new Error(), { code: 'EISDIR' });
    if (found.isFile()) return (await isPacked(path)) ? unpacked(createReadStream(path)) : pathToFileURL(path);
  }
  const pieces = await all(path === '-' ? process.stdin : createReadStream(path));
  const blob = new Blob(pieces);
  return startsPacked(new Uint8Array(await blob.slice(0, 2).arrayBuffer())) ? unpacked(Readable.from(pieces)) : blob;
}

/** Before the work, not after it. */
export async function checkOutput(path: string): Promise<void> {
  const existing = await stat(path).catch(() => undefined);
  const isFolder = existing?.isDirectory() || path.endsWith('/') || path.endsWith(sep);
  if (isFolder) throw Object.assign(new Error(), { code: existing ? 'EISDIR' : 'ENOENT' });
  // To replace it needs no permission but that of the folder.
  if (existing && (existing.mode & 0o222) === 0) throw new Error('the file is read-only, and stays as it is');
  if (existing && !existing.isFile()) return;
  const folder = dirname(await targetOf(path));
  if (!(await stat(folder)).isDirectory()) throw Object.assign(new Error(), { code: 'ENOTDIR' });
  await access(folder, constants.W_OK);
}

/** Where a path leads, through links, also where there is nothing yet: a link keeps pointing where it points. */
async function targetOf(path: string, most = 40): Promise<string> {
  const link = await readlink(path).catch(() => undefined);
  if (link === undefined) return path;
  if (most === 0) throw new Error('the link leads in a circle');
  return targetOf(resolve(await realpath(dirname(path)), link), most - 1);
}

/** Under a temporary name beside `path`, then renamed: nobody ever sees half a file. Packed, if it is to be a .gz. */
export async function writeOutput(path: string, contents: Blob): Promise<void> {
  const packed = /\.gz$/i.test(path) ? await through(Readable.from(piecesOf(contents)), createGzip()) : contents;
  const existing = await stat(path).catch(() => undefined);
  // A device or a pipe is written to, never replaced.
  if (existing && !existing.isFile()) return writePieces(await open(path, 'w'), packed);

  const target = await targetOf(path);
  const temporary = join(dirname(target), `.bilinormal-${randomBytes(4).toString('hex')}`);
  const remove = () => rmSync(temporary, { force: true });
  const interrupted = (signal: NodeJS.Signals) => {
    remove();
    // As if nobody had listened.
    process.removeAllListeners(signal);
    process.kill(process.pid, signal);
  };
  const signals = ['SIGINT', 'SIGTERM', 'SIGHUP'] as const;
  for (const signal of signals) process.on(signal, interrupted);
  try {
    const file = await open(temporary, 'wx');
    // It keeps its permissions.
    if (existing) await file.chmod(existing.mode);
    await writePieces(file, packed);
    await rename(temporary, target);
  } catch (error) {
    remove();
    throw error;
  } finally {
    for (const signal of signals) process.off(signal, interrupted);
  }
}

async function writePieces(file: FileHandle, contents: Blob): Promise<void> {
  try {
    for await (const piece of piecesOf(contents)) await file.writeFile(piece);
  } finally {
    await file.close();
  }
}

async function* piecesOf(blob: Blob): AsyncGenerator<Uint8Array> {
  const pieceBytes = 1 << 23;
  for (let at = 0; at < blob.size; at += pieceBytes) {
    yield new Uint8Array(await blob.slice(at, at + pieceBytes).arrayBuffer());
  }
}

/** Whether a file begins as those do that are packed with gzip. */
const startsPacked = ([first, second]: Uint8Array) => first === 0x1f && second === 0x8b;

async function isPacked(path: string): Promise<boolean> {
  const file = await open(path);
  try {
    return startsPacked((await file.read(new Uint8Array(2), 0, 2, 0)).buffer);
  } finally {
    await file.close();
  }
}

async function unpacked(file: Readable): Promise<Blob> {
  try {
    return await through(file, createGunzip());
  } catch (error) {
    const isOfZlib = /^Z_/.test((error as NodeJS.ErrnoException).code ?? '');
    throw isOfZlib ? new Error(`packed with gzip, and damaged: ${plain(error)}`) : error;
  }
}

/** What a transform makes of a stream. */
async function through(stream: Readable, transform: Transform): Promise<Blob> {
  return new Blob(await pipeline(stream, transform, all));
}

async function all(stream: AsyncIterable<BlobPart>): Promise<BlobPart[]> {
  const pieces: BlobPart[] = [];
  for await (const piece of stream) pieces.push(piece);
  return pieces;
}

/** The text of an error, on one line; of Node's errors about files, what a person needs. */
export function plain(error: unknown): string {
  const { code, message } = error as NodeJS.ErrnoException;
  const texts: Record<string, string> = {
    ENOENT: 'no such file or folder',
    EACCES: 'permission denied',
    EISDIR: 'it is a folder',
    ENOTDIR: 'a part of the path is not a folder',
    ENOSPC: 'no space left on the device',
    EROFS: 'the file system is read-only',
  };
  return texts[code ?? ''] ?? (message ?? String(error)).replace(/\s*\n\s*/g, ' ');
}
