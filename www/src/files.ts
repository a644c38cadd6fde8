// Files that come to the page and leave it: scans from a disk, the sample, what is saved.
import { BilinormalError, readPointCloud, type PointCloud } from 'bilinormal';
import { foreign, notUnpacked } from './foreign';
import { measure } from './format';
import type { Step } from './jobs';
import { isPacked, unpack } from './packed';

const SAMPLE_POINTS = 500_000;

/** Those that begin as PLY files do. */
export async function onlyScans(files: File[]): Promise<File[]> {
  const reasons = await Promise.all(files.map(foreign));
  return files.filter((_, i) => !reasons[i]);
}

/** The file that is in one packed with gzip, or the file itself. */
export async function unpacked(file: File, { signal, begin }: Step): Promise<File> {
  if (!(await isPacked(file))) return file;
  const reason = await foreign(file);
  if (reason) throw reason;
  return unpack(file, signal, begin(`Unpacking ${file.name}`)).catch(() => {
    throw notUnpacked();
  });
}

export async function read(file: File, { signal, begin }: Step): Promise<PointCloud> {
  const onProgress = begin(`Reading ${file.name}`);
  try {
    return await readPointCloud(file, { signal, onProgress });
  } catch (error) {
    // Not for its points, but for the file itself.
    const isTooLarge = error instanceof BilinormalError && error.code === 'limit' && error.needed === file.size;
    // Which says what it is, and what to do with it.
    throw (await foreign(file)) ?? (isTooLarge ? new Error(tooLarge(file)) : error);
  }
}

export function makeSample(signal: AbortSignal): Promise<File> {
  const worker = new Worker(new URL('./sample.worker.ts', import.meta.url), { type: 'module' });
  return new Promise<File>((resolve, reject) => {
    signal.addEventListener('abort', () => reject(signal.reason));
    worker.onmessage = ({ data }: MessageEvent<Uint8Array<ArrayBuffer>>) => resolve(new File([data], 'sample.ply'));
    worker.onerror = () => reject(new Error('the script that makes it did not load'));
    worker.postMessage({ points: SAMPLE_POINTS });
  }).finally(() => worker.terminate());
}

/** Refuses what the browser has no room for. */
export async function checkRoom(blob: Blob): Promise<void> {
  // It tells when that is read. Private windows keep all in memory.
  await blob
    .slice(-1)
    .arrayBuffer()
    .catch(() => {
      throw new Error(
        `the browser has no room for the file, ${measure(blob.size / 1e9)} GB; a private window may have less than another`,
      );
    });
}

export function download(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  // The browser has to get hold of the data first.
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function tooLarge({ size }: File): string {
  return `the file has ${measure(size / 2 ** 30)} GiB, and text or a mesh can be opened up to 2; save it as binary, without faces`;
}
