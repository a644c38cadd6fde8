// The worker's side: takes one call after the other into wasm and hands results out.
import { coded, failure } from './failure.js';
import { load, type Loaded, type Platform } from './loader.js';
import type { Bytes, Call, Reply, Start } from './protocol.js';
import type { Buffer, Tell } from './wasm.js';

/** Blobs are read in pieces of this size, so that a file is never whole in JavaScript memory. */
const pieceBytes = 1 << 23;

type Result = [result: unknown, transfer: Transferable[]];

/** Returns the receiver of messages. */
export function serve(post: (reply: Reply, transfer: Transferable[]) => void, platform: Platform) {
  let loaded: Promise<Loaded>;
  const tell: Tell = (phase, fraction) => post({ phase, fraction }, []);
  return async (message: Start | Call) => {
    if (message.kind === 'start') {
      loaded = load(message, platform);
      // Told with the call that waits for it.
      loaded.catch(() => {});
      return;
    }
    let started = false;
    try {
      const wasm = await loaded;
      started = true;
      const [result, transfer] = await answer(message, wasm, platform, tell);
      post({ result }, transfer);
    } catch (error) {
      const packed = failure(error);
      // After a limit a new worker begins with empty memory; wasm memory never shrinks.
      post({ failure: { ...packed, fatal: !started || packed.code === 'limit' } }, []);
    }
  };
}

async function answer(call: Call, { glue, memory, mode }: Loaded, platform: Platform, tell: Tell): Promise<Result> {
  // Made anew for each use: a view of memory that has grown since is empty.
  const view = ({ pointer, byteLength }: Buffer) => new Uint8Array(memory.buffer, pointer, byteLength);

  function put(bytes: Uint8Array): Buffer {
    const buffer = new glue.Buffer(bytes.byteLength);
    view(buffer).set(bytes);
    return buffer;
  }
  const putOptional = (bytes?: Uint8Array) => bytes && put(bytes);

  function take(buffer: Buffer): ArrayBuffer {
    const { buffer: bytes } = view(buffer).slice();
    buffer.free();
    return bytes;
  }

  /** Half of the progress. */
  async function putFile(file: Bytes): Promise<Buffer> {
    if (file instanceof Uint8Array) return put(file);
    let buffer: Buffer | undefined;
    try {
      const blob = typeof file === 'string' ? platform.open!(file) : file;
      buffer = new glue.Buffer(blob.size);
      for (let at = 0; at < blob.size; at += pieceBytes) {
        tell('load', at / blob.size / 2);
        view(buffer).set(new Uint8Array(await blob.slice(at, at + pieceBytes).arrayBuffer()), at);
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
      return [mode, []];
    case 'estimate': {
      const estimation = glue.estimate(put(call.positions), call.double, call.options, tell);
      const normals = new Float32Array(take(estimation.takeNormals()));
      const report = { ...estimation.report, ...mode };
      estimation.free();
      return [{ normals, report }, [normals.buffer]];
    }
    case 'read': {
      const cloud = glue.readPly(await putFile(call.file), call.maxPoints, tellRest);
      const { count, origin, format, properties, comments } = cloud;
      const result = { count, origin: [...origin], source: { format, properties, comments } };
      const transfer: Transferable[] = [];
      const add = <T>(name: string, Kind: new (bytes: ArrayBuffer) => T, part?: Buffer) => {
        if (!part) return;
        const bytes = take(part);
        transfer.push(bytes);
        Object.assign(result, { [name]: new Kind(bytes) });
      };
      add('positions', Float32Array, cloud.takePositions());
      add('normals', Float32Array, cloud.takeNormals());
      add('colors', Uint8Array, cloud.takeColors());
      add('intensity', Float32Array, cloud.takeIntensity());
      cloud.free();
      return [result, transfer];
    }
    case 'write': {
      const file = await putFile(call.file);
      const [normals, curvature] = [putOptional(call.normals), putOptional(call.curvature)];
      return [takeFile(glue.writePly(file, normals, curvature, call.ascii, tellRest)), []];
    }
    case 'writeCloud': {
      const { origin, comments, ascii } = call;
      const [normals, colors, intensity, curvature] = [call.normals, call.colors, call.intensity, call.curvature].map(
        putOptional,
      );
      const positions = put(call.positions);
      const file = glue.writeCloud(positions, origin, normals, colors, intensity, curvature, comments, ascii, tell);
      return [takeFile(file), []];
    }
  }
}
