// What the README and the types promise, on the packed package in Node.
import assert from 'node:assert/strict';
import {
  closeSync,
  ftruncateSync,
  openAsBlob,
  openSync,
  readFileSync,
  rmSync,
  writeFileSync,
  writeSync,
} from 'node:fs';
import { createServer } from 'node:http';
import { availableParallelism } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { deviation, sameBits, sphere } from './clouds.mjs';
import { installPacked } from './packed.mjs';
import { parsePly, propertyOf } from './ply.mjs';

const { project, home, load } = installPacked();
const { BilinormalError, createEstimator, estimateNormals, features, readPointCloud, writePly } =
  await load('bilinormal');

const bytesOf = async (blob) => Buffer.from(await blob.arrayBuffer());
const failing = (code, message) => (error) => {
  assert.ok(error instanceof BilinormalError, `${error}`);
  assert.equal(error.code, code);
  assert.match(error.message, message);
  return true;
};
/** Ends with the test that asked for it. */
async function estimatorFor(context, options) {
  const estimator = await createEstimator(options);
  context.after(() => estimator.dispose());
  return estimator;
}

test('a sphere: accurate, unit length, and a whole report', async () => {
  const positions = sphere(187500);
  const before = positions.slice();
  const { normals, report, curvature } = await estimateNormals(positions, { cell: { scale: 1 } });
  assert.ok(sameBits(positions, before), 'the input stays as it was');
  assert.ok(normals instanceof Float32Array && normals.buffer.constructor === ArrayBuffer);
  assert.equal(normals.byteLength, normals.buffer.byteLength);
  assert.equal(normals.length, positions.length);
  assert.equal(curvature, undefined);
  for (let at = 0; at < normals.length; at += 3) {
    assert.ok(Math.abs(Math.hypot(normals[at], normals[at + 1], normals[at + 2]) - 1) < 1e-6);
  }
  const { mean, worst } = deviation(positions, normals);
  assert.ok(mean <= 0.0033 && worst < 2, `mean ${mean}, worst ${worst} degrees`);

  assert.equal(report.points, 187500);
  assert.equal(report.unresolved, 0);
  assert.ok(report.cells > 0 && report.nodes > 0 && report.nodes <= report.cells);
  assert.equal(report.grid.length, 3);
  assert.ok(Math.abs(report.scale - 1) < 1e-6 && report.cellSize > 0 && report.peakBytes > 12 * 187500);
  assert.equal(
    report.nodesUsed.reduce((sum, points) => sum + points),
    187500,
  );
  const { total, ...phases } = report.milliseconds;
  const sum = Object.values(phases).reduce((sum, time) => sum + time, 0);
  assert.ok(Object.keys(phases).length > 2 && sum > 0 && sum <= total, `${sum} of ${total} ms`);
});

test('the baselines: as accurate as they should be, and a report without cubes', async (context) => {
  const positions = sphere(30000);
  const estimators = [1, 2].map((threads) => estimatorFor(context, { threads }));
  for (const [options, bound] of [
    [{ method: 'knn' }, 0.009],
    [{ method: 'knn', k: 100, cell: { scale: 3 } }, 0.009],
    [{ method: 'egg' }, 0.009],
    [{ method: 'egg', k: 20 }, 0.004],
  ]) {
    const told = [];
    const onProgress = ({ fraction }) => told.push(fraction);
    const calls = estimators.map(async (estimator) =>
      (await estimator).estimateNormals(positions, { ...options, onProgress }),
    );
    const [single, threads] = await Promise.all(calls);
    const name = JSON.stringify(options);
    assert.ok(sameBits(single.normals, threads.normals), name);
    assert.equal(single.normals.length, positions.length);
    const { mean } = deviation(positions, single.normals);
    assert.ok(mean < bound, `${name}: ${mean}`);
    const { cells, nodes, grid, cellSize, scale, nodesUsed, unresolved, points, milliseconds } = threads.report;
    assert.deepEqual([cells, nodes, cellSize, scale, ...grid, unresolved], Array(8).fill(0));
    assert.deepEqual(nodesUsed, [points, 0, 0, 0, 0]);
    assert.deepEqual(Object.keys(milliseconds), ['bounds', 'tree', 'normals', 'total']);
    assert.equal(told.at(-1), 1);
  }
});

test('curvature where it is asked for: beside the same normals, within its bounds, the same bits with threads', async (context) => {
  const positions = sphere(30000);
  positions[3000] = NaN;
  const [single, threads] = await Promise.all([1, 2].map((threads) => estimatorFor(context, { threads })));
  for (const method of ['bilinear', 'knn', 'egg']) {
    const without = await single.estimateNormals(positions, { method, curvature: false });
    assert.ok(!('curvature' in without), method);
    const { normals, curvature } = await single.estimateNormals(positions, { method, curvature: true });
    assert.ok(sameBits(normals, without.normals), method);
    assert.ok(curvature instanceof Float32Array && curvature.buffer.constructor === ArrayBuffer);
    assert.equal(curvature.length, 30000);
    assert.equal(curvature[1000], 0, 'an unresolved point');
    // On a sphere about k / (6 N), and a neighbourhood of 27 cubes holds some 500 points.
    assert.ok(
      curvature.every((value, i) => i === 1000 || (value > 1e-6 && value < 0.008)),
      method,
    );
    assert.ok(sameBits(curvature, (await threads.estimateNormals(positions, { method, curvature: true })).curvature));
  }
});

test('each method has its own worker: calls of both end, an abort of one leaves the other, dispose ends both', async () => {
  const estimator = await createEstimator({ threads: 1 });
  const positions = sphere(100000);
  const abort = new AbortController();
  const reason = new Error('enough');
  const stopped = estimator.estimateNormals(positions, {
    method: 'knn',
    k: 200,
    signal: abort.signal,
    onProgress: ({ phase }) => phase === 'normals' && abort.abort(reason),
  });
  const kept = estimator.estimateNormals(positions);
  await assert.rejects(stopped, (error) => error === reason);
  assert.equal((await kept).report.unresolved, 0);
  assert.equal((await estimator.estimateNormals(sphere(1000), { method: 'egg' })).report.unresolved, 0);
  const pending = [{}, { method: 'knn' }].map((options) => estimator.estimateNormals(positions, options));
  estimator.dispose();
  for (const call of pending) await assert.rejects(call, failing('input', /disposed/));
});

test('Node has threads, and says so', async () => {
  assert.deepEqual(await features(), { threads: true, simd: true, crossOriginIsolated: true });
  const { report } = await estimateNormals(sphere(1000));
  const threads = Math.min(availableParallelism(), 16);
  if (threads === 1) {
    assert.equal(report.mode, 'single');
    assert.match(report.fallbackReason, /one processor/);
  } else {
    assert.equal(report.mode, 'threads');
    assert.equal(report.threads, threads);
    assert.ok(!('fallbackReason' in report));
  }
});

test('one thread, two, three and four give the same bits', async (context) => {
  const positions = sphere(50000);
  let first;
  for (const threads of [1, 2, 3, 4]) {
    const estimator = await estimatorFor(context, { threads });
    const { normals, report } = await estimator.estimateNormals(positions);
    assert.equal(report.threads, threads);
    assert.equal(report.mode, threads === 1 ? 'single' : 'threads');
    assert.ok(!('fallbackReason' in report));
    first ??= normals;
    assert.ok(sameBits(normals, first), `${threads} threads`);
    // As their types promise, also where the module's memory is shared.
    const all = { orient: 'consistent', curvature: true, components: true };
    const results = await estimator.estimateNormals(Float64Array.from(positions), all);
    for (const { buffer } of [normals, results.normals, results.curvature, results.components]) {
      assert.ok(buffer instanceof ArrayBuffer);
    }
  }
});

test('progress rises from 0 to exactly 1, for each kind of call', async () => {
  const positions = sphere(300000);
  const told = [];
  const onProgress = (progress) => told.push(progress);
  const check = (what) => {
    assert.ok(told.length > 2, what);
    assert.equal(told[0].fraction, 0, what);
    assert.equal(told.at(-1).fraction, 1, what);
    told.forEach(({ phase, fraction }, i) => {
      assert.ok(typeof phase === 'string' && phase !== '', what);
      assert.ok(i === 0 || fraction >= told[i - 1].fraction, `${what}: ${fraction} after ${told[i - 1]?.fraction}`);
    });
    told.length = 0;
  };
  const { normals } = await estimateNormals(positions, { onProgress });
  check('estimateNormals');
  for (const points of [positions, positions.subarray(0, 3), new Float32Array()]) {
    await estimateNormals(points, { orient: 'consistent', onProgress });
    check(`${points.length / 3} points, consistent`);
  }
  const ply = await writePly({ count: 300000, positions, origin: [0, 0, 0] }, { normals }, { onProgress });
  check('writePly of a cloud');
  await readPointCloud(ply, { onProgress });
  check('readPointCloud');
  await writePly(ply, { normals }, { onProgress });
  check('writePly of a file');
});

test('what onProgress throws rejects the call, and the next one works', async () => {
  const oops = new Error('oops');
  const onProgress = ({ fraction }) => {
    if (fraction > 0) throw oops;
  };
  await assert.rejects(estimateNormals(sphere(20000), { onProgress }), oops);
  await estimateNormals(sphere(100));
});

test('a call that stops itself at its first progress, and throws or not, leaves the next ones alone', async (context) => {
  const estimator = await estimatorFor(context, { threads: 1 });
  for (const oops of [undefined, new Error('oops')]) {
    const control = new AbortController();
    const enough = new Error('enough');
    const onProgress = () => {
      control.abort(enough);
      if (oops) throw oops;
    };
    const before = estimator.estimateNormals(sphere(2000));
    const stopped = estimator.estimateNormals(sphere(3000), { signal: control.signal, onProgress });
    const after = [4000, 5000].map((count) => estimator.estimateNormals(sphere(count)));
    await assert.rejects(stopped, enough);
    assert.equal((await before).normals.length, 6000);
    assert.deepEqual(
      (await Promise.all(after)).map(({ normals }) => normals.length),
      [12000, 15000],
    );
  }
});

test('abort: before the call, in the queue, and while wasm runs; the estimator stays usable', async (context) => {
  const estimator = await estimatorFor(context, { threads: 2 });
  const positions = sphere(200000);
  const reason = new Error('changed my mind');
  const kept = new Float32Array(3);
  await assert.rejects(estimator.estimateNormals(kept, { signal: AbortSignal.abort(reason), transfer: true }), reason);
  assert.equal(kept.length, 3, 'nothing was taken');

  const running = new AbortController();
  const waiting = new AbortController();
  let seen = 0;
  const calls = [
    estimator.estimateNormals(positions, {
      signal: running.signal,
      onProgress({ fraction }) {
        seen = fraction;
        if (fraction > 0.2) running.abort(reason);
      },
    }),
    estimator.estimateNormals(positions, { signal: waiting.signal }),
    estimator.estimateNormals(positions),
  ];
  waiting.abort('not needed');
  const [first, second, third] = await Promise.allSettled(calls);
  assert.equal(first.reason, reason);
  assert.ok(seen > 0 && seen < 1);
  assert.equal(second.reason, 'not needed');
  assert.equal(third.status, 'fulfilled');
  assert.equal(third.value.report.points, 200000);
  // Too late to matter.
  running.abort();
  assert.equal((await estimator.estimateNormals(sphere(10))).normals.length, 30);
});

test('an abort that comes too late for its call disturbs no other', async (context) => {
  const estimator = await estimatorFor(context, { threads: 1 });
  const late = new AbortController();
  const onProgress = ({ phase }) => phase === 'done' && late.abort();
  const calls = [
    estimator.estimateNormals(sphere(2000), { signal: late.signal, onProgress }),
    estimator.estimateNormals(sphere(3000)),
    estimator.estimateNormals(sphere(4000)),
  ];
  const results = await Promise.all(calls);
  assert.deepEqual(
    results.map(({ normals }) => normals.length),
    [6000, 9000, 12000],
  );
});

test('one signal stops all calls that were given it, and only these', async (context) => {
  const estimator = await estimatorFor(context, { threads: 1 });
  const control = new AbortController();
  const told = [];
  const stopped = [1, 2, 3].map((call) =>
    estimator.estimateNormals(sphere(300_000), {
      signal: control.signal,
      onProgress: () => {
        told.push(call);
        control.abort(new Error('enough'));
      },
    }),
  );
  const other = estimator.estimateNormals(sphere(2000));
  for (const call of stopped) await assert.rejects(call, /enough/);
  assert.equal((await other).normals.length, 6000);
  assert.deepEqual([...new Set(told)], [1]);
});

test('concurrent calls of one kind queue, and each gets its own result and progress', async () => {
  const counts = [50000, 10, 3000, 0, 20000];
  const last = counts.map(() => 0);
  const results = await Promise.all(
    counts.map((count, i) => estimateNormals(sphere(count), { onProgress: ({ fraction }) => (last[i] = fraction) })),
  );
  assert.deepEqual(
    results.map(({ normals }) => normals.length / 3),
    counts,
  );
  assert.deepEqual(
    last,
    counts.map(() => 1),
  );
});

test('a call that is refused, and one that is given up while it waits, takes no buffer', async (context) => {
  const estimator = await estimatorFor(context, { threads: 1 });
  const given = sphere(100);
  const refused = [
    [{ methd: 1 }, /methd/],
    [{ method: 'knn', k: 2 }, /k is 2; wanted/],
    [{ cell: { scale: 0 } }, /scale is 0; wanted/],
    [{ components: true }, /components are those of/],
    [{ orient: 'up' }, /orient is 'up'; wanted/],
  ];
  for (const [options, message] of refused) {
    await assert.rejects(estimator.estimateNormals(given, { ...options, transfer: true }), failing('input', message));
    assert.equal(given.length, 300, message);
  }
  for (const method of ['bilinear', 'knn']) {
    const control = new AbortController();
    const before = estimator.estimateNormals(sphere(20000), { method });
    const waiting = estimator.estimateNormals(given, { method, transfer: true, signal: control.signal });
    control.abort(new Error('enough'));
    await assert.rejects(waiting, /enough/);
    assert.equal((await before).normals.length, 60000);
    assert.equal(given.length, 300, method);
  }
  const told = [];
  const onProgress = ({ phase, fraction }) => told.push([phase, fraction]);
  await estimator.estimateNormals(given, { cell: { scale: 1 }, transfer: true, onProgress });
  assert.equal(given.length, 0);
  assert.deepEqual(told[1], ['bounds', 0], 'trying the options is no progress');
});

test('a buffer that goes while its call waits is an input error, and the next call works', async (context) => {
  const estimator = await estimatorFor(context, { threads: 1 });
  const given = sphere(100);
  const calls = [sphere(20000), given, given, sphere(10)].map((positions) =>
    estimator.estimateNormals(positions, { transfer: true }),
  );
  const [, second, third, fourth] = await Promise.allSettled(calls);
  assert.equal(second.value.normals.length, 300);
  failing('input', /buffer cannot be taken/)(third.reason);
  assert.equal(fourth.value.normals.length, 30);
});

test('transfer takes the buffer; views of parts and shared memory are copied', async () => {
  const expected = (await estimateNormals(sphere(5000))).normals;

  const given = sphere(5000);
  assert.ok(sameBits((await estimateNormals(given, { transfer: true })).normals, expected));
  assert.equal(given.length, 0, 'detached');
  await assert.rejects(estimateNormals(given, { transfer: true }), failing('input', /buffer cannot be taken/));
  await assert.rejects(estimateNormals(given), failing('input', /buffer cannot be taken/));

  const large = new Float32Array(15000 + 7);
  large.set(sphere(5000), 3);
  const view = large.subarray(3, 15003);
  assert.ok(sameBits((await estimateNormals(view, { transfer: true })).normals, expected));
  assert.equal(large.length, 15007);

  const shared = new Float32Array(new SharedArrayBuffer(4 * 15000));
  shared.set(sphere(5000));
  for (const transfer of [false, true]) {
    const { normals } = await estimateNormals(shared, { transfer });
    assert.ok(sameBits(normals, expected));
    assert.equal(normals.buffer.constructor, ArrayBuffer);
  }
});

test('a view that reaches beyond its resized buffer is refused, not taken for no points', async () => {
  const buffer = new ArrayBuffer(120, { maxByteLength: 120 });
  const view = new Float32Array(buffer, 0, 30);
  buffer.resize(60);
  for (const transfer of [false, true]) {
    await assert.rejects(estimateNormals(view, { transfer }), failing('input', /buffer cannot be taken/));
  }
});

test('positions are read when the call is made', async () => {
  const positions = sphere(5000);
  const expected = (await estimateNormals(positions)).normals;
  const first = estimateNormals(sphere(100000));
  const second = estimateNormals(positions);
  positions.fill(0);
  await first;
  assert.ok(sameBits((await second).normals, expected));
});

test('doubles far from zero give what floats near zero give', async () => {
  const near = sphere(20000, Float64Array);
  const far = near.map((value, i) => value + [3.5e6, -5.1e6, 250][i % 3]);
  const { normals } = await estimateNormals(far, { cell: { scale: 1 } });
  assert.ok(deviation(near, normals).worst < 6);
});

test('points that are not finite get the zero vector', async () => {
  const positions = sphere(5000);
  positions[4] = NaN;
  positions[9] = Infinity;
  const { normals, report } = await estimateNormals(positions);
  assert.equal(report.unresolved, 2);
  assert.deepEqual([...normals.subarray(3, 6), ...normals.subarray(9, 12)], [0, 0, 0, 0, 0, 0]);
});

test('no points, no normals', async () => {
  for (const transfer of [false, true]) {
    const { normals, report } = await estimateNormals(new Float32Array(0), { transfer });
    assert.equal(normals.length, 0);
    assert.equal(report.points, 0);
  }
});

/** Half of the points are a ring under the tripod, on the floor z = 0: the library's selection takes minutes for such. */
test('a flat scan, dense round its scanner, is oriented in no time', async () => {
  const flat = Float32Array.from({ length: 420_000 }, (_, i) => {
    const [point, axis] = [Math.floor(i / 3), i % 3];
    const [u, v] = [(point * 0.618034) % 1, (point * 0.754878) % 1];
    if (axis === 2) return 0;
    if (point % 2 === 0) return 20 * [u, v][axis];
    return 10 + (0.01 + 0.02 * u) * [Math.cos, Math.sin][axis](2 * Math.PI * v);
  });
  const signal = AbortSignal.timeout(60_000);
  const { report } = await estimateNormals(flat, { orient: 'consistent', signal });
  assert.equal(report.unresolved, 0);
});

test('options may be inherited', async () => {
  const onProgress = () => {};
  const { report } = await estimateNormals(sphere(1000), Object.create({ cell: { size: 0.25 }, onProgress }));
  assert.equal(report.cellSize, 0.25);
});

test('wrong arguments are input errors that say what came and what was wanted', async (context) => {
  const positions = sphere(10);
  const locked = new Response('ply');
  locked.body.getReader();
  const circular = {};
  circular.scale = circular;
  // As those of jsdom, or of fetch-blob.
  const foreignBlob = { [Symbol.toStringTag]: 'Blob', size: 3 };
  const blobOfFile = await openAsBlob(fileURLToPath(import.meta.url));
  const cases = [
    [() => estimateNormals([1, 2, 3]), /positions is Array\(3\); wanted a Float32Array or Float64Array/],
    [() => estimateNormals(undefined), /positions is undefined; wanted/],
    [() => estimateNormals(new Uint8Array(6)), /positions is Uint8Array\(6\); wanted/],
    [() => estimateNormals(new Float32Array(4)), /4; wanted a multiple of 3/],
    [() => estimateNormals(positions, { cell: { scale: 1000 } }), /1000; wanted .*0\.1 to 100/],
    [() => estimateNormals(positions, { cell: { size: NaN } }), /NaN/],
    [() => estimateNormals(positions, { method: 'magic' }), /magic.*wanted/],
    [() => readPointCloud('scan.ply'), /source is 'scan\.ply'; wanted a File, Blob/],
    [() => readPointCloud({}), /source is Object\(\); wanted/],
    [() => readPointCloud(new Blob(), { maxPoints: -1 }), /-1; wanted/],
    [() => readPointCloud(pathToFileURL(join(project, 'missing.ply'))), /could not be read.*ENOENT/],
    [() => readPointCloud(pathToFileURL(project)), /could not be read: it is a folder/],
    // Which has no end, and a pipe that nobody writes to not even a beginning.
    ...(process.platform === 'win32'
      ? []
      : [[() => readPointCloud(new URL('file:///dev/zero')), /could not be read: it is a pipe or a device/]]),
    [() => readPointCloud(new URL('file://elsewhere/scan.ply')), /could not be read.*host/],
    [() => readPointCloud(new URL('http://127.0.0.1:1/scan.ply')), /127\.0\.0\.1:1\/scan\.ply did not load/],
    [() => writePly(undefined, {}), /source is undefined; wanted/],
    [() => writePly({ count: 10, positions }, { normals: [0, 0, 1] }), /normals is Array\(3\); wanted a Float32Array/],
    [() => writePly({ count: 10, positions }, { normals: new Float32Array(3) }), /normals.*wanted/],
    [() => writePly({ count: 10, positions, colors: new Uint8Array(3) }, {}), /colors.*wanted/],
    [() => writePly({ count: 10, positions, source: { comments: ['a', 5] } }, {}), /a comment is 5; wanted a string/],
    [() => writePly({ count: 10, positions }, {}, { format: 'obj' }), /format is 'obj'; wanted/],
    [() => estimateNormals(positions, null), /options is null; wanted an object/],
    [
      () => estimateNormals(positions, { cel: { scale: 2 } }),
      /an option is 'cel'; wanted any of method, cell, .*, onProgress, signal$/,
    ],
    [() => estimateNormals(positions, { onprogress() {} }), /an option is 'onprogress'; wanted any of/],
    [() => estimateNormals(positions, { cel: undefined }), /an option is 'cel'/],
    [() => estimateNormals(positions, Object.create({ methd: 'knn' })), /an option is 'methd'/],
    [() => estimateNormals(positions, 5), /options is 5; wanted an object/],
    [() => createEstimator({ thread: 1 }), /'thread'; wanted any of threads, wasmUrl, memoryMaxMiB$/],
    [() => readPointCloud(new Blob(), { maxPoint: 2 }), /'maxPoint'; wanted any of maxPoints, onProgress, signal$/],
    [() => writePly(new Blob(), { normal: positions }), /'normal'; wanted any of normals, curvature/],
    [
      () => writePly({ count: 10, positions }, {}, { ascii: true }),
      /'ascii'; wanted any of format, onProgress, signal$/,
    ],
    [() => writePly({ count: 9, positions }, {}), /count is 9; wanted 10, that of positions/],
    [() => writePly({ positions: new Float32Array(4) }, {}), /positions\.length is 4; wanted a multiple of 3/],
    [() => writePly({ positions, origin: [0, 0] }, {}), /origin is Array\(2\); wanted three finite numbers/],
    [() => writePly({ positions, origin: [0, NaN, 0] }, {}), /origin is Array\(3\); wanted three finite/],
    [() => writePly({ positions, origin: 7 }, {}), /origin is 7; wanted three finite/],
    [() => writePly({ count: 10, positions }), /add is undefined; wanted an object/],
    [() => writePly('scan.ply', {}), /source is 'scan\.ply'; wanted/],
    [() => writePly({ positions: undefined }, {}), /positions is null; wanted a Float32Array/],
    [() => createEstimator({ threads: 0 }), /threads is 0; wanted 'auto' or 1 to 256/],
    [() => createEstimator({ threads: '2' }), /threads is '2'; wanted/],
    [() => estimateNormals(positions, { onProgress: 'x' }), /onProgress is 'x'; wanted a function/],
    [
      () => estimateNormals(positions, { signal: new AbortController() }),
      /signal is AbortController.*; wanted an AbortSignal/,
    ],
    [() => estimateNormals(positions, { method: 'knn', k: 1e10 }), /k is 10000000000; wanted .* to 4294967295/],
    [() => estimateNormals(positions, { curvature: 1 }), /curvature is 1; wanted true or false/],
    [() => estimateNormals(positions, { transfer: 'yes' }), /transfer is 'yes'; wanted true or false/],
    [() => createEstimator({ memoryMaxMiB: 5000 }), /memoryMaxMiB is 5000; wanted 16 to 4096/],
    [() => createEstimator(null), /options is null; wanted an object/],
    // What JavaScript itself finds wrong.
    [() => createEstimator({ wasmUrl: 'http://[' }), /wasmUrl is 'http:\/\/\['; wanted a valid URL/],
    [() => createEstimator({ wasmUrl: 5 }), /wasmUrl is 5; wanted a valid URL or string/],
    [() => createEstimator({ wasmUrl: {} }), /wasmUrl is Object\(\); wanted a valid URL/],
    [() => estimateNormals(positions, { k: 16n }), /k is '16'; wanted a whole number/],
    [() => estimateNormals(positions, { cell: { size: 1n } }), /cell is \{"size":"1"\}; wanted 'auto'/],
    [() => estimateNormals(positions, { cell: circular }), /cell is Object\(\); wanted plain data/],
    [() => estimateNormals(positions, { k() {} }), /k is Function\(0\); wanted plain data/],
    [() => estimateNormals(positions, { orient: Symbol('up') }), /orient is Symbol\(up\); wanted plain data/],
    [() => readPointCloud(locked), /locked/],
    [() => readPointCloud(blobOfFile), /wanted its bytes, or the URL of the file/],
    [() => readPointCloud(foreignBlob), /not one of Node's; wanted its bytes, or the URL of the file/],
    [() => writePly(foreignBlob, {}), /not one of Node's; wanted its bytes/],
  ];
  for (const [call, message] of cases) await assert.rejects(call, failing('input', message), `${call}`);
  await assert.rejects(
    createEstimator({ wasmUrl: join(project, 'nowhere') }),
    failing('unsupported', /nowhere\/single\.wasm did not load.*ENOENT/),
  );
  const estimator = await estimatorFor(context);
  await assert.rejects(estimator.estimateNormals([]), failing('input', /Array\(0\)/));
});

test('an error tells a line of what came, not all of it', async () => {
  const long = 'a line\n'.repeat(1e6);
  const calls = [
    readPointCloud(long),
    estimateNormals(long),
    estimateNormals(sphere(10), { [long]: 1 }),
    estimateNormals(sphere(10), { orient: long.replaceAll('\n', ' ') }),
    writePly(new Blob(), {}, { format: long }),
    createEstimator({ threads: long }),
    createEstimator({ threads: Symbol(long) }),
    createEstimator({ memoryMaxMiB: 10n ** 100n }),
  ];
  for (const { reason } of await Promise.allSettled(calls)) {
    assert.ok(reason.message.length < 250, reason.message.slice(0, 250));
    failing('input', /^[^\n]* is ('a line|Symbol\(a line|10{59})[^\n]*; wanted [^\n]*$/)(reason);
  }
});

test('a file with an error says where', async () => {
  const header =
    'ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n';
  await assert.rejects(readPointCloud(new Blob([header, '1 2 3\n4 5 six\n'])), (error) => {
    failing('format', /line 9/)(error);
    return error.line === 9 && !('byte' in error);
  });
  const binary = Buffer.from(header.replace('ascii', 'binary_little_endian'));
  await assert.rejects(readPointCloud(Buffer.concat([binary, Buffer.alloc(13)])), (error) => {
    failing('format', /./)(error);
    return Number.isInteger(error.byte);
  });
  await assert.rejects(readPointCloud(new Blob(['solid teapot'])), failing('format', /./));
  await assert.rejects(readPointCloud(new Blob([])), failing('format', /./));
});

test('too little memory is a limit error with numbers, and the estimator stays usable', async (context) => {
  for (const threads of [1, 2]) {
    const estimator = await estimatorFor(context, { threads, memoryMaxMiB: 16 });
    // Refused beforehand, with the least that the whole takes; and what may fit but does not, with what was lacking.
    const bytes = [
      ['none', 28],
      [{ up: [0, 0, 1] }, 28],
      [{ viewpoint: [0, 0, 9] }, 40],
      ['consistent', 40],
    ];
    for (const [orient, each] of bytes) {
      await assert.rejects(estimator.estimateNormals(new Float32Array(3e6 * 3), { orient }), (error) => {
        failing('limit', /memory/)(error);
        assert.deepEqual([error.needed, error.available], [each * 3e6, 2 ** 24]);
        return true;
      });
    }
    await assert.rejects(estimator.estimateNormals(sphere(500_000)), (error) => {
      failing('limit', /memory/)(error);
      // One of its arrays: at least a number and at most all that there is for a point.
      return error.needed >= 500_000 * 4 && error.needed < 500_000 * 28 && error.available < error.needed;
    });
    const { report } = await estimator.estimateNormals(sphere(1000));
    assert.equal(report.points, 1000);
    assert.equal(report.threads, threads);
  }
});

test('neighbours that no memory holds are refused beforehand, however many threads ask for them', async (context) => {
  for (const threads of [16, 64]) {
    const estimator = await estimatorFor(context, { threads, memoryMaxMiB: 512 });
    await assert.rejects(estimator.estimateNormals(sphere(2_100_000), { method: 'knn', k: 2 ** 32 - 1 }), (error) => {
      failing('limit', /neighbours/)(error);
      return error.needed > 2 ** 29 && error.available <= 2 ** 29;
    });
  }
});

test('dispose ends pending calls and later ones, and nothing else', async () => {
  const estimator = await createEstimator();
  // Many: they must not be done before.
  const pending = [estimator.estimateNormals(sphere(2_000_000)), estimator.readPointCloud(new Blob(['ply\n']))];
  const shared = estimateNormals(sphere(100));
  await new Promise((resolve) => setTimeout(resolve, 20));
  estimator.dispose();
  for (const call of pending) await assert.rejects(call, failing('input', /disposed/));
  const given = sphere(10);
  await assert.rejects(estimator.estimateNormals(given, { transfer: true }), failing('input', /disposed/));
  assert.equal(given.length, 30, 'not taken');
  estimator.dispose();
  assert.equal((await shared).normals.length, 300);
});

test('dispose ends downloads that stall: of a URL, before and after its answer begins, and of a Response', async () => {
  const server = createServer((request, response) => {
    if (request.url === '/begins') response.write('ply\n');
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  after(() => server.close());
  after(() => server.closeAllConnections());
  const address = new URL(`http://127.0.0.1:${server.address().port}/`);
  const estimator = await createEstimator({ threads: 1 });
  const begins = new URL('begins', address);
  const pending = [address, begins, await fetch(begins), new Response(new ReadableStream())].flatMap((source, i) => [
    estimator.readPointCloud(source),
    ...(i < 2 ? [estimator.writePly(source, {})] : []),
  ]);
  await new Promise((resolve) => setTimeout(resolve, 50));
  estimator.dispose();
  for (const call of pending) await assert.rejects(call, failing('input', /disposed/));
});

const typed = `ply
format ascii 1.0
comment made by hand
element camera 1
property float focal
element vertex 4
property double z
property uchar red
property float nx
property list uchar int neighbours
property float x
property float ny
property float nz
property float y
property uchar green
property uchar blue
property float intensity
element face 1
property list uchar int vertex_indices
end_header
35.5
0.25 255 0 2 1 2 1 0 1 10 0 128 0.5
0.5 254 0 0 2 0 1 20 1 127 1.5
0.75 253 0 1 3 3 0 1 30 2 126 2.5
1.25 252 0 3 0 1 2 4 0 1 40 3 125 3.5
4 0 1 2 3
`;

test('every kind of source gives the same cloud', async () => {
  const bytes = Buffer.from(typed);
  const path = join(project, 'typed.ply');
  writeFileSync(path, bytes);
  const server = createServer((request, response) => {
    if (request.url === '/missing.ply') response.statusCode = 404;
    else response.setHeader('content-length', bytes.length);
    response.end(bytes);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  after(() => server.close());
  const url = new URL(`http://127.0.0.1:${server.address().port}/typed.ply`);
  const shared = new Uint8Array(new SharedArrayBuffer(bytes.length));
  shared.set(bytes);
  const sources = {
    Blob: new Blob([bytes]),
    File: new (globalThis.File ?? Blob)([bytes], 'typed.ply'),
    ArrayBuffer: bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length),
    'a part of a buffer': bytes,
    'shared memory': shared,
    'file URL': pathToFileURL(path),
    'http URL': url,
    Response: await fetch(url),
  };
  const read = await fetch(url);
  await read.text();
  for (const [name, source] of Object.entries(sources)) {
    const cloud = await readPointCloud(source);
    assert.equal(cloud.count, 4, name);
    assert.deepEqual([...cloud.positions], [1, 10, 0.25, 2, 20, 0.5, 3, 30, 0.75, 4, 40, 1.25], name);
    assert.deepEqual(cloud.origin, [0, 0, 0], name);
    assert.deepEqual([...cloud.normals], [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1], name);
    assert.deepEqual([...cloud.colors.subarray(0, 8)], [255, 0, 128, 255, 254, 1, 127, 255], name);
    assert.deepEqual([...cloud.intensity], [0.5, 1.5, 2.5, 3.5], name);
    assert.equal(cloud.source.format, 'ascii', name);
    assert.ok(cloud.source.properties.includes('neighbours') && cloud.source.comments.includes('made by hand'), name);
  }
  assert.equal(bytes.length, typed.length, 'no source is taken');
  const missing = new URL('missing.ply', url);
  await assert.rejects(readPointCloud(missing), failing('input', /missing\.ply has HTTP status 404/));
  await assert.rejects(readPointCloud(read), failing('input', /was read before/));
});

test('a download tells its progress, and can be aborted', async () => {
  const stop = new AbortController();
  const server = createServer((_, response) => {
    response.setHeader('content-length', 1000000);
    response.write(Buffer.alloc(500000));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  after(() => server.closeAllConnections?.() ?? server.close());
  after(() => server.close());
  const told = [];
  const call = readPointCloud(new URL(`http://127.0.0.1:${server.address().port}/`), {
    signal: stop.signal,
    onProgress(progress) {
      told.push(progress);
      if (progress.fraction === 0.25) stop.abort('enough');
    },
  });
  await assert.rejects(call, (reason) => reason === 'enough');
  assert.deepEqual(told[0], { phase: 'download', fraction: 0 });
  for (const first of [0, 0.25]) {
    const oops = new TypeError('oops');
    const onProgress = ({ fraction }) => {
      if (fraction === first) throw oops;
    };
    const thrown = readPointCloud(new URL(`http://127.0.0.1:${server.address().port}/`), { onProgress });
    await assert.rejects(thrown, (error) => error === oops);
  }
});

test('a body that breaks off is an input error that names it', async () => {
  const broken = (error) => new Response(new ReadableStream({ start: (body) => body.error(error) }));
  for (const error of [new Error('the disk is gone'), new TypeError('the disk is gone'), 'the disk is gone']) {
    await assert.rejects(readPointCloud(broken(error)), failing('input', /^the Response broke off: the disk is gone$/));
  }
  const server = createServer((_, response) => {
    response.setHeader('content-length', 9);
    response.write('ply', () => response.destroy());
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  after(() => server.close());
  const address = new URL(`http://127.0.0.1:${server.address().port}/scan.ply`);
  for (const source of [address, await fetch(address)]) {
    await assert.rejects(readPointCloud(source), failing('input', /scan\.ply broke off: ./));
  }
});

test('a file tells where the scanner stood', async () => {
  const place = ['view_px', 'view_py', 'view_pz'].map((name) => `property double ${name}\n`).join('');
  const axes = ['x', 'y', 'z'].map((name) => `property double ${name}\n`).join('');
  const header = `ply\nformat ascii 1.0\nelement camera 1\n${place}element vertex 2\n${axes}end_header\n`;
  const { source, origin } = await readPointCloud(
    new TextEncoder().encode(`${header}4500000.5 -2.25 7\n4500001 0 0\n4500003 1 1\n`),
  );
  assert.deepEqual(source.viewpoint, [4500000.5, -2.25, 7]);
  assert.notEqual(origin[0], 0);
});

test('maxPoints refuses a larger file', async () => {
  assert.equal((await readPointCloud(new Blob([typed]), { maxPoints: 4 })).count, 4);
  await assert.rejects(
    readPointCloud(new Blob([typed]), { maxPoints: 3 }),
    failing('input', /declares 4 points; at most 3 were asked for/),
  );
});

/** The header of a file of long rows, at whose ends the coordinates are, and the bytes of each. */
function padded(count, type) {
  const other = 'property double other\n'.repeat(1024);
  const places = ['x', 'y', 'z'].map((name) => `property ${type} ${name}\n`).join('');
  const header = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${other}${places}end_header\n`;
  return { header: Buffer.from(header), stride: 8192 + 3 * (type === 'double' ? 8 : 4) };
}

test('a large file gives what it gives in memory, and its errors', async (context) => {
  const count = 40_000;
  const { header, stride } = padded(count, 'double');
  const bytes = Buffer.alloc(header.length + count * stride);
  header.copy(bytes);
  for (let i = 0; i < count; i++) {
    const at = header.length + i * stride + 8192;
    [431_000 + (i % 7), 5_412_000 + i / 64, i].forEach((value, c) => bytes.writeDoubleLE(value, at + 8 * c));
  }
  assert.ok(bytes.length > 3e8);
  const whole = await readPointCloud(bytes);
  for (const threads of [1, 2]) {
    const estimator = await estimatorFor(context, { threads });
    const told = [];
    const cloud = await estimator.readPointCloud(new Blob([bytes]), { onProgress: (p) => told.push(p.fraction) });
    assert.deepEqual(cloud, whole);
    assert.deepEqual(
      cloud.origin.map((place) => place > 0),
      [true, true, true],
    );
    assert.ok(new Set(told).size > 20 && told.every((fraction, i) => i === 0 || fraction >= told[i - 1]));
    await assert.rejects(
      estimator.readPointCloud(new Blob([bytes]), { maxPoints: 5 }),
      failing('input', /declares 40000 points; at most 5/),
    );
    // What of it is in memory when it is given up is in nobody's way.
    const control = new AbortController();
    const onProgress = ({ fraction }) => fraction > 0.3 && control.abort(new Error('enough'));
    await assert.rejects(estimator.readPointCloud(new Blob([bytes]), { onProgress, signal: control.signal }), /enough/);
    const cut = new Blob([bytes.subarray(0, -1)]);
    await assert.rejects(estimator.readPointCloud(cut), failing('format', /ends after 39999 of 40000 rows/));
    assert.equal((await estimator.readPointCloud(new Blob([bytes]))).count, count);
  }
});

test('a file larger than what memory holds is read from the disk', async () => {
  const count = 560_000;
  const { header, stride } = padded(count, 'float');
  const path = join(home, 'large.ply');
  const file = openSync(path, 'w');
  try {
    writeSync(file, header);
    // All else is zero, and takes no room on the disk.
    const end = header.length + count * stride;
    ftruncateSync(file, end);
    assert.ok(end > 2 ** 32);
    writeSync(file, Buffer.from(Float32Array.of(1, 2, 3).buffer), 0, 12, end - 12);
    const { positions } = await readPointCloud(pathToFileURL(path));
    assert.equal(positions.length, 3 * count);
    assert.deepEqual(positions.slice(-3), Float32Array.of(1, 2, 3));
    assert.ok(positions.subarray(0, -3).every((value) => value === 0));

    // It ends while it is read.
    const onProgress = ({ fraction }) => fraction > 0.1 && ftruncateSync(file, end / 2);
    await assert.rejects(
      readPointCloud(pathToFileURL(path), { onProgress }),
      failing('input', /could not be read: it is shorter than a moment ago/),
    );
    assert.equal((await readPointCloud(new Blob([typed]))).count, 4);
  } finally {
    closeSync(file);
    rmSync(path);
  }
});

test('writePly keeps every property of a file, in both formats', async () => {
  const normals = Float32Array.from({ length: 12 }, (_, i) => Math.fround(i / 7));
  const before = parsePly(Buffer.from(typed));
  for (const format of ['binary_little_endian', 'ascii']) {
    for (const source of [new Blob([typed]), Buffer.from(typed)]) {
      const blob = await writePly(source, { normals }, { format });
      const parsed = parsePly(await bytesOf(blob));
      assert.equal(parsed.format, format);
      for (const { name, properties } of before.elements) {
        for (const property of properties) {
          const written = propertyOf(parsed, name, property.name);
          const axis = ['nx', 'ny', 'nz'].indexOf(property.name);
          const values = axis < 0 ? property.values : [...normals].filter((_, i) => i % 3 === axis);
          assert.deepEqual(written.values, values, `${format} ${name} ${property.name}`);
          assert.equal(written.type, property.type);
        }
      }
      assert.deepEqual(
        parsed.elements.map(({ name }) => name),
        ['camera', 'vertex', 'face'],
      );
      assert.ok(parsed.remarks.includes('comment made by hand'));
    }
  }
  const wrong = writePly(new Blob([typed]), { normals: new Float32Array(9) });
  await assert.rejects(wrong, failing('input', /normals.*wanted/));
});

test('a file of many pieces is written with what is added, as bytes and as a Blob', async () => {
  const count = 1_500_000;
  const positions = Float32Array.from({ length: 3 * count }, (_, i) => i / 8);
  const file = await writePly({ count, positions, origin: [0, 0, 0] }, {});
  assert.ok(file.size > 2 * 8 * 2 ** 20);
  const normals = Float32Array.from({ length: 3 * count }, (_, i) => i % 1000);
  const curvature = Float32Array.from({ length: count }, (_, i) => i % 77);
  for (const source of [file, await bytesOf(file)]) {
    const told = [];
    const blob = await writePly(source, { normals, curvature }, { onProgress: ({ phase }) => told.push(phase) });
    assert.ok(told.includes('write'));
    const again = await readPointCloud(blob);
    assert.deepEqual(again.source.properties, ['x', 'y', 'z', 'nx', 'ny', 'nz', 'curvature']);
    assert.ok(Buffer.from(again.positions.buffer).equals(Buffer.from(positions.buffer)));
    assert.ok(Buffer.from(again.normals.buffer).equals(Buffer.from(normals.buffer)));
    const written = await bytesOf(blob.slice(-4));
    assert.equal(written.readFloatLE(0), curvature.at(-1));
  }
  const empty = join(project, 'empty.ply');
  writeFileSync(empty, '');
  try {
    for (const source of [new Blob(), new Uint8Array(), pathToFileURL(empty)]) {
      await assert.rejects(writePly(source, { normals }), failing('format', /the file is empty/));
      await assert.rejects(readPointCloud(source), failing('format', /the file is empty/));
    }
  } finally {
    rmSync(empty);
  }
  await assert.rejects(writePly(file, { normals: normals.subarray(3) }), failing('input', /normals/));
});

test('a file that goes away while it is written is an error, and nothing of it is in the next one', async () => {
  const count = 8_000_000;
  const path = join(project, 'goes.ply');
  const positions = new Float32Array(3 * count);
  writeFileSync(path, await bytesOf(await writePly({ count, positions, origin: [0, 0, 0] }, {})));
  const onProgress = ({ phase }) => phase === 'write' && rmSync(path, { force: true });
  const gone = writePly(pathToFileURL(path), { normals: positions }, { onProgress });
  await assert.rejects(gone, failing('input', /could not be read/));
  const few = { count: 10, positions: Float32Array.from({ length: 30 }, (_, i) => i), origin: [0, 0, 0] };
  assert.deepEqual((await readPointCloud(await writePly(await writePly(few, {}), {}))).positions, few.positions);
});

test('a cloud written and read again is the same cloud', async () => {
  const cloud = await readPointCloud(new Blob([typed]));
  cloud.origin = [1000, 2000, 3000.5];
  const blob = await writePly(cloud, { report: 'may come, as a part of the whole result' });
  assert.ok(blob instanceof Blob);
  const again = await readPointCloud(blob);
  const absolute = ({ positions, origin }) => [...positions].map((value, i) => value + origin[i % 3]);
  assert.deepEqual(absolute(again), absolute(cloud));
  for (const part of ['normals', 'colors', 'intensity']) assert.deepEqual(again[part], cloud[part], part);
});

test('a query of wasmUrl is that of each of its files', async (context) => {
  const asked = [];
  const server = createServer((request, response) => {
    asked.push(request.url);
    const build = /(single|threads)\.wasm/.exec(request.url)[1];
    response.end(readFileSync(join(home, 'dist', build, 'core.wasm')));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  after(() => server.close());
  const address = `http://127.0.0.1:${server.address().port}`;
  for (const [threads, path] of [
    [1, '/x?v=1/'],
    [2, '/x/?v=1#part'],
  ]) {
    await estimatorFor(context, { threads, wasmUrl: address + path });
  }
  assert.deepEqual(asked, ['/x/single.wasm?v=1/', '/x/threads.wasm?v=1']);
});

test('an estimator finds wasm files that are hosted elsewhere', async (context) => {
  const folder = join(project, 'hosted');
  const { copyFileSync, mkdirSync } = await import('node:fs');
  mkdirSync(folder);
  for (const build of ['single', 'threads']) {
    copyFileSync(join(home, 'dist', build, 'core.wasm'), join(folder, `${build}.wasm`));
    copyFileSync(join(home, 'dist', build, 'full.wasm'), join(folder, `${build}-full.wasm`));
  }
  for (const threads of [1, 2]) {
    for (const wasmUrl of [pathToFileURL(folder), `${pathToFileURL(folder)}/`]) {
      const estimator = await estimatorFor(context, { threads, wasmUrl });
      for (const method of ['bilinear', 'knn']) {
        const { report } = await estimator.estimateNormals(sphere(100), { method });
        assert.equal(report.threads, threads);
      }
    }
  }
});
