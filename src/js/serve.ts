// The worker's side: takes one call after the other into wasm and hands results out.
import { coded, failure } from './failure.js';
import { load, type Loaded, type Platform } from './loader.js';
import type { Call, OpenFile, Reply, Start } from './protocol.js';
import type { Buffer, Pieces, Tell } from './wasm.js';

/** Blobs are read in pieces of this size, so that a file is never whole in JavaScript memory. */
const pieceBytes = 1 << 23;
/** Asked for at once: each takes a way through another process, and Chromium reads two to three times as fast. */
const piecesAhead = 4;

/** What a finite point takes for its place in the grid. */
const finiteBytes = 16;

/** What is not of floats in a result. */
const kinds: Record<string, new (buffer: ArrayBufferLike) => object> = { colors: Uint8Array, components: Uint32Array };

/** Returns the receiver of messages. */
export function serve(post: (reply: Reply) => void, platform: Platform) {
  let loaded: Promise<Loaded>;
  let started = false;
  const tell: Tell = (phase, fraction) => post({ phase, fraction });
  return async (message: Start | Call) => {
    if (message.kind === 'start') {
      loaded = load(message, platform);
      // Told with the call that waits for it.
      loaded.catch(() => {});
      return;
    }
    try {
      const wasm = await loaded;
      started = true;
      post({ data: await answer(message, wasm, tell) });
    } catch (error) {
      const packed = failure(error);
      // What fails before anything runs is a script or a module that did not load.
      if (!started) packed.code ??= 'unsupported';
      // After a limit a new worker begins with empty memory; wasm memory never shrinks.
      packed.fatal ||= !started || packed.code === 'limit';
      post({ failure: packed });
    }
  };
}

/** Throws a `limit` error if the points of a call cannot fit, however they lie: at once, before wasm gets them. */
function refuse([{ buffer }, double, options]: Extract<Call, { kind: 'estimate' }>['data'], most: number) {
  const { orient = 'none' } = options;
  // Any point's normal takes the place of its position, unless the sign needs that.
  const anyBytes = orient === 'none' || orient?.up ? 12 : 24;
  const coordinates = double ? new Float64Array(buffer) : new Float32Array(buffer);
  const points = coordinates.length / 3;
  if (points * (anyBytes + finiteBytes) <= most) return;
  let needed = points * anyBytes;
  for (let i = 0; i < coordinates.length; i += 3) {
    if (Number.isFinite(coordinates[i]! + coordinates[i + 1]! + coordinates[i + 2]!)) needed += finiteBytes;
  }
  if (needed <= most) return;
  throw coded(
    'limit',
    `${points} points do not fit into memory; use fewer (at least ${needed} bytes needed, ${most} available)`,
    { needed, available: most },
  );
}

/** Hands the bytes of a file over in pieces, one after the other, while the next ones load; of an empty file an empty piece. */
async function pour(
  file: OpenFile,
  take: (piece: Uint8Array, at: number) => void,
  { from, to, step }: Pieces = { from: 0, to: file.size || 1, step: pieceBytes },
) {
  const ahead: Promise<any>[] = [];
  for (let next = from; from < to; from += step) {
    for (; next < to && ahead.length < piecesAhead; next += step) {
      // An error is told when its turn comes.
      ahead.push(
        file
          .slice(next, Math.min(to, next + step))
          .arrayBuffer()
          .catch((error) => error),
      );
    }
    const piece = await ahead.shift();
    // The worker goes, too, and with it what there is of the file.
    if (piece.message) throw coded('input', `the file could not be read: ${piece.message}`, { fatal: true });
    take(new Uint8Array(piece), from);
  }
}

async function answer({ kind, data }: Call, { glue, memory, most, mode }: Loaded, tell: Tell): Promise<object> {
  if (kind === 'hello') return mode;

  // Made anew for each use: a view of memory that has grown since is empty.
  const view = ({ pointer, byteLength }: Buffer) => new Uint8Array(memory.buffer, pointer, byteLength);
  let hear = tell;

  /** Bytes as a buffer of wasm, also those of a file, which take half of the progress; all else as it is. */
  async function put(part: any): Promise<unknown> {
    if (part instanceof Uint8Array) return fill(part);
    const size = part?.size;
    if (!(size >= 0)) return part;
    hear = (phase, fraction) => tell(phase, (1 + fraction) / 2);
    const buffer = new glue.Buffer(size);
    await pour(part, (bytes, at) => {
      tell('load', at / size / 2 || 0);
      view(buffer).set(bytes, at);
    });
    return buffer;
  }

  function fill(bytes: Uint8Array) {
    const buffer = new glue.Buffer(bytes.byteLength);
    view(buffer).set(bytes);
    return buffer;
  }

  const written: BlobPart[] = [];
  /** Takes what is written out of wasm in pieces, so that it is never twice in memory. */
  function drain(file: Buffer) {
    for (let at = 0; at < file.byteLength; at += pieceBytes) {
      written.push(new Blob([view(file).slice(at, at + pieceBytes)]));
    }
    file.free();
  }

  let used: Uint8Array | undefined;
  if (kind === 'estimate') {
    refuse(data, most);
    // The normals need just as much, and memory that is new to the system takes several times as long to write to.
    if (!data[1]) used = data[0];
  }
  let found: any;
  if (kind === 'readPly' && data[2]) {
    const [file, ...options] = data;
    // A large file, in the pieces that wasm asks for.
    for (found = { from: 0, to: pieceBytes, step: pieceBytes }; found.step;) {
      await pour(file as OpenFile, (bytes) => (found = glue.readPly(fill(bytes), ...options, tell) ?? found), found);
    }
  } else if (kind === 'writePly') {
    // None of it is kept here: wasm keeps what is added.
    let file: any = data.shift();
    if (file instanceof Uint8Array) file = new Blob([file as BlobPart]);
    const { size } = file;
    const [ascii, ...added]: any[] = await Promise.all(data.splice(0).map(put));
    await pour(file, (piece) => drain(glue.writePly(fill(piece), ascii, size, tell, ...added.splice(0))));
  } else {
    const parts: unknown[] = [];
    // Not kept meanwhile: doubles are 24 bytes a point.
    while (data.length) parts.push(await put(data.shift()));
    found = (glue[kind] as any)(...parts, hear);
  }

  if (found instanceof glue.Buffer) drain(found);
  if (written.length) return new Blob(written, { type: 'application/octet-stream' });
  if (found.report) Object.assign(found.report, mode);
  // Arrays in place of buffers: in new memory, the normals in bytes of the same length that nobody needs any more.
  for (const name in found) {
    const buffer = found[name];
    if (!(buffer instanceof glue.Buffer)) continue;
    const bytes = name === 'normals' && used;
    if (bytes) bytes.set(view(buffer));
    found[name] = new (kinds[name] ?? Float32Array)((bytes || view(buffer).slice()).buffer);
    buffer.free();
  }
  return found;
}
