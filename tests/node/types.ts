// Compiled against the packed types, never run.
import {
  BilinormalError,
  createEstimator,
  estimateNormals,
  features,
  readPointCloud,
  writePly,
  type ErrorCode,
  type EstimateOptions,
  type Estimator,
  type Features,
  type PointCloud,
  type Positions,
  type Report,
} from 'bilinormal';

export async function documented(file: File, response: Response): Promise<Blob> {
  const cloud: PointCloud = await readPointCloud(file);
  const { normals, report } = await estimateNormals(cloud.positions);
  const length: number =
    normals.length + report.nodesUsed[4] + report.milliseconds.total + report.milliseconds['sort']!;
  const why: string | undefined = report.fallbackReason;
  const mode: 'threads' | 'single' = report.mode;
  console.log(length, why, mode, report satisfies Report);

  for (const source of [
    file,
    response,
    new Uint8Array(3),
    new ArrayBuffer(3),
    new URL('https://example.org/scan.ply'),
  ]) {
    await readPointCloud(source, { signal: new AbortController().signal, onProgress: console.log, maxPoints: 10 });
  }
  await writePly(cloud, { normals, curvature: new Float32Array(cloud.count) });
  // Results own plain memory, whatever TypeScript calls it.
  const parts: BlobPart[] = [normals, cloud.positions, cloud.colors ?? '', cloud.intensity ?? '', cloud.normals ?? ''];
  console.log(new Blob(parts));
  const shared: Float32Array = new Float32Array(new SharedArrayBuffer(12));
  await writePly({ ...cloud, positions: shared, count: 1 }, { normals: shared });
  return writePly(file, { normals }, { format: 'ascii' });
}

export async function options(positions: Positions): Promise<void> {
  const all: EstimateOptions[] = [
    {},
    { method: 'knn', k: 12, cell: 'auto', orient: 'consistent', curvature: true, components: true, transfer: true },
    { method: 'egg', cell: { scale: 1.5 }, orient: { viewpoint: [0, 0, 1] } },
    {
      cell: { size: 0.02 },
      orient: { up: [0, 0, 1] },
      onProgress: ({ phase, fraction }) => console.log(phase, fraction),
    },
  ];
  const estimator: Estimator = await createEstimator({
    threads: 'auto',
    wasmUrl: new URL('https://x.org'),
    memoryMaxMiB: 512,
  });
  for (const one of all) {
    const { normals, curvature, components, report } = await estimator.estimateNormals(positions, one);
    for (const { points, side, confidence } of report.components?.largest ?? []) {
      console.log(report.components?.count, points, side satisfies string, confidence, components?.indexOf(0));
    }
    await estimator.writePly(new Blob(), { normals, curvature });
    console.log(new Blob([normals, curvature ?? '', components ?? '']));
  }
  const found: Features = await estimator.features();
  console.log(found.threads, found.simd, found.crossOriginIsolated, found.reason, await features());
  estimator.dispose();

  // @ts-expect-error: no such method
  await estimateNormals(positions, { method: 'magic' });
  // @ts-expect-error: one or the other
  await estimateNormals(positions, { cell: { edge: 1 } });
  // @ts-expect-error: plain arrays are not accepted
  await estimateNormals([1, 2, 3]);
  // @ts-expect-error: no such format
  await writePly(new Blob(), {}, { format: 'obj' });
}

export function handle(error: unknown): ErrorCode | undefined {
  if (!(error instanceof BilinormalError)) return undefined;
  console.log(error.line, error.byte, error.needed, error.available, error.message);
  return error.code;
}
