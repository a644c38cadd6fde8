// The verdicts of npm run bench, on rows whose answer is known.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { report } from '../../benches/speed/report.mjs';

/** A row of spheres that takes so many milliseconds a million points with one thread. */
const row = (size, threads, each, more = {}) => ({
  shape: 'sphere',
  size,
  order: 'random',
  cell: '1.5',
  engine: 'wasm, Chromium',
  threads,
  copy: [1, 9, 2],
  reports: [each, each * 1.1, each * 0.9].map((time) => ({
    peakBytes: 38 * size,
    milliseconds: { total: (time * size) / 1e6, sort: time / 2 },
  })),
  ...more,
});
const line = (text, start) => text.split('\n').find((line) => line.startsWith(`| ${start}`));

test('growth, gain of threads, memory and copies are judged', () => {
  const rows = [row(187_500, 1, 10), row(187_500, 2, 9), row(3_000_000, 1, 14), row(3_000_000, 2, 7)];
  const text = report(rows, { points: 3e6, whole: 700, estimate: 200 }, 3);
  assert.match(line(text, '1.5: time per point'), /0\.8 to 1\.4 \| at most 1\.5 \| met/);
  assert.match(line(text, '1.5: one thread over'), /2\.0 \| at least 1\.8 \| met/);
  assert.match(line(text, '1.5: bytes a point'), /38\.0 \| at most 40 \| met/);
  // 21 ms over copies of 2.
  assert.match(line(text, '1.5, 3 M: time'), /10\.5 \| at most 8 \| \*\*missed\*\* by 1 of 1/);
  assert.match(line(text, 'from a file'), /3\.5 \| at most 3 \| \*\*missed\*\*/);
  assert.match(line(text, 'sphere 3 M, random | 1.5 | wasm, Chromium | 2'), /21\.0 \| ±10 % \| 10\.5 \| 142\.9 \| 38 /);
});

test('native rows, rows without threads and other clouds are not judged', () => {
  const rows = [
    row(187_500, 1, 1, { engine: 'native', copy: undefined }),
    row(3_000_000, 1, 90, { engine: 'native', copy: undefined }),
    row(3_000_000, 1, 90, { shape: 'scan' }),
  ];
  const text = report(rows, undefined, 3);
  assert.equal(line(text, '1.5: '), undefined);
  assert.ok(line(text, 'sphere 3 M, random | 1.5 | native | 1'));
  assert.ok(line(text, 'scan 3 M'));
});
