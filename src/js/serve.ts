// The worker's side: takes one call after the other into wasm and hands results out.
import { coded, failure } from './failure.js';
import { load, type Loaded, type Platform } from './loader.js';
import type { Bytes, Call, Reply, Start } from './protocol.js';
import type { Buffer, Tell } from './wasm.js';

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
      post({ result: await answer(message, wasm, platform, tell) });
    } catch (error) {
      const packed = failure(error);
      // What fails before anything runs is a script or a module that did not load.
      if (!started) packed.code ??= 'unsupported';
      // After a limit a new worker begins with empty memory; wasm memory never shrinks.
      post({ failure: { ...packed, fatal: !started || packed.code === 'limit' } });
    }
  };
}

/** Throws a `limit` error if the points of a call cannot fit, however they lie: at once, before wasm gets them. */
function refuse({ positions: { buffer }, double, options }: Extract<Call, { kind: 'estimate' }>, most: number) {
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
  const numbers = `at least ${needed} bytes needed, ${most} available`;
  const message = `${points} points do not fit into memory; use fewer (${numbers})`;
  throw Object.assign(coded('limit', message), { needed, available: most });
}

async function answer(
  call: Call,
  { glue, memory, most, mode }: Loaded,
  platform: Platform,
  tell: Tell,
): Promise<object> {
  // Made anew for each use: a view of memory that has grown since is empty.
  const view = ({ pointer, byteLength }: Buffer) => new Uint8Array(memory.buffer, pointer, byteLength);

  function put<T extends Uint8Array | undefined>(bytes: T): Buffer | (T & undefined) {
    if (!bytes) return bytes as T & undefined;
    const buffer = new glue.Buffer(bytes.byteLength);
    view(buffer).set(bytes);
    return buffer;
  }

  /** Puts arrays in place of buffers: in new memory, the normals in bytes of the same length that nobody needs any more. */
  function takeAll(found: any, used?: Uint8Array): object {
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

  /** Half of the progress. */
  async function putFile(file: Bytes): Promise<Buffer> {
    if (file instanceof Uint8Array) return put(file);
    let buffer: Buffer | undefined;
    try {
      const blob = typeof file === 'string' ? platform.open!(file) : file;
      buffer = new glue.Buffer(blob.size);
      const ahead: Promise<ArrayBuffer>[] = [];
      for (let at = 0, next = 0; at < blob.size; at += pieceBytes) {
        for (; next < blob.size && ahead.length < piecesAhead; next += pieceBytes) {
          const piece = blob.slice(next, next + pieceBytes).arrayBuffer();
          // Told when its turn comes.
          piece.catch(() => {});
          ahead.push(piece);
        }
        tell('load', at / blob.size / 2);
        view(buffer).set(new Uint8Array((await ahead.shift())!), at);
      }
      return buffer;
    } catch (error) {
      // Without a buffer the file did not open, or memory does not suffice for it.
      if (!buffer && failure(error).code) throw error;
      buffer?.free();
      throw coded('input', `the file could not be read: ${(error as Error).message}`);
    }
  }

  /** Out of wasm in pieces, so that the file is never twice in memory. */
  function takeFile(buffer: Buffer): Blob {
    const parts: BlobPart[] = [];
    for (let at = 0; at < buffer.byteLength; at += pieceBytes) {
      parts.push(new Blob([view(buffer).slice(at, at + pieceBytes)]));
    }
    buffer.free();
    return new Blob(parts, { type: 'application/octet-stream' });
  }

  const tellRest: Tell = (phase, fraction) => tell(phase, (1 + fraction) / 2);

  switch (call.kind) {
    case 'hello':
      return mode;
    case 'estimate': {
      refuse(call, most);
      const positions = put(call.positions);
      // The normals need just as much, and memory that is new to the system takes several times as long to write to.
      const used = call.double ? undefined : call.positions;
      // Not kept meanwhile: 24 bytes a point.
      if (call.double) delete (call as Partial<typeof call>).positions;
      const found = glue.estimate(positions, call.double, call.options, tell);
      Object.assign(found.report, mode);
      return takeAll(found, used);
    }
    case 'read':
      return takeAll(glue.readPly(await putFile(call.file), call.maxPoints, tellRest));
    case 'write': {
      const file = await putFile(call.file);
      return takeFile(glue.writePly(file, put(call.normals), put(call.curvature), call.ascii, tellRest));
    }
    case 'writeCloud': {
      const { positions, normals, colors, intensity, curvature, origin, comments, ascii } = call;
      return takeFile(
        glue.writeCloud(
          put(positions),
          origin,
          put(normals),
          put(colors),
          put(intensity),
          put(curvature),
          comments,
          ascii,
          tell,
        ),
      );
    }
  }
}
