// Files packed with gzip, as scans are often kept.

/** How they begin, each byte a character. */
export const GZIP = /^\x1f\x8b/;

/** Up to where tar archives say what they are. */
const BEGINNING = 512;

/** Whether a file is packed; one that cannot be read is not. */
export async function isPacked(file: Blob): Promise<boolean> {
  return GZIP.test(await ownBeginning(file).catch(() => ''));
}

/** The first bytes of a file, each as a character: of what is in it, if it is packed and can be unpacked. */
export async function beginningOf(file: Blob): Promise<string> {
  const begin = await ownBeginning(file);
  if (!GZIP.test(begin)) return begin;
  try {
    const reader = file.stream().pipeThrough(new DecompressionStream('gzip')).getReader();
    const { value } = await reader.read();
    // What may be wrong further on is told when all of it is unpacked.
    reader.cancel().catch(() => {});
    return asText(value?.subarray(0, BEGINNING));
  } catch {
    return begin;
  }
}

/** The file that is in a packed one. Rejects if it is damaged, or there is no room for it. */
export async function unpack(
  file: File,
  signal: AbortSignal,
  onProgress: (progress: { phase: string; fraction: number }) => void,
): Promise<File> {
  let done = 0;
  const counting = new TransformStream<Uint8Array<ArrayBuffer>, Uint8Array<ArrayBuffer>>({
    transform(piece, stream) {
      done += piece.length;
      onProgress({ phase: '', fraction: done / file.size });
      stream.enqueue(piece);
    },
  });
  const unpacked = file.stream().pipeThrough(counting, { signal }).pipeThrough(new DecompressionStream('gzip'));
  // A browser keeps what is large on the disk.
  return new File([await new Response(unpacked).blob()], file.name.replace(/\.gz$/i, ''));
}

async function ownBeginning(file: Blob): Promise<string> {
  return asText(new Uint8Array(await file.slice(0, BEGINNING).arrayBuffer()));
}

function asText(bytes = new Uint8Array()): string {
  return String.fromCharCode(...bytes);
}
