// What the page finds out about a cloud before it draws it: the modules of the page that need no browser.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { buildSync } from 'esbuild';
import { sphere } from './clouds.mjs';

async function load(name) {
  const entryPoints = [fileURLToPath(new URL(`../../www/src/${name}.ts`, import.meta.url))];
  const [{ text }] = buildSync({ entryPoints, bundle: true, write: false, format: 'esm' }).outputFiles;
  return import(`data:text/javascript,${encodeURIComponent(text)}`);
}
const { boundsOf } = await load('bounds');
const { pickPoint } = await load('pick');
const { colorsOf } = await load('ramp');
const { spacingOf } = await load('spacing');

/** Points of `count` balls of radius 1, in turns, 3 apart along x. */
function inTurns(count, points) {
  return sphere(points).map((value, i) => value + (i % 3 ? 0 : 3 * (Math.floor(i / 3) % count)));
}

test('bounds are those of all points, though some are looked at, in whatever order they come', () => {
  for (const balls of [1, 2, 3, 4, 64]) {
    const { centre, radius, extent } = boundsOf(inTurns(balls, 20_000 * balls));
    const half = 1.5 * (balls - 1);
    assert.ok(
      Math.abs(centre[0] - half) < 0.2 && Math.abs(extent[0] - 2 * half - 2) < 1.5,
      `${balls}: ${centre}, ${extent}`,
    );
    assert.ok(radius > half + 0.7 && radius < half + 1.1, `${balls}: ${radius}`);
  }
  // Row by row: the last columns count, too.
  const wall = Float32Array.from(
    { length: 3 * 50 * 5_000 },
    (_, i) => [Math.floor(i / 3) % 5_000, i / 15_000, 0][i % 3],
  );
  assert.ok(Math.abs(boundsOf(wall).extent[0] - 5_000) < 100);
});

test('a stray neither moves the middle nor shrinks the rest, and is not clipped', () => {
  const positions = sphere(30_000);
  positions.set([1e6, 0, 0], 3 * 12_345);
  const { centre, radius, reach } = boundsOf(positions);
  assert.ok(Math.hypot(...centre) < 0.05 && radius < 1.1 && reach > 9e5, `${centre} ${radius} ${reach}`);
  assert.equal(boundsOf(new Float32Array(9).fill(NaN)), undefined);
});

test('a ray meets any surface, though some points are looked at, in whatever order they come', () => {
  const positions = inTurns(2, 2_200_000);
  for (const x of [0, 3]) {
    const found = pickPoint(positions, [x, 0, 10], [0, 0, -1], 0, 0.01);
    assert.ok(found >= 0, `nothing at ${x}`);
    const [foundX, y, z] = positions.subarray(3 * found, 3 * found + 3);
    assert.ok(Math.hypot(foundX - x, y) < 0.02 && z > 0.99, `${foundX} ${y} ${z}`);
  }
});

test('the ramp ends near the most curved points, in whatever order they come', () => {
  const colors = colorsOf(Float32Array.from({ length: 240_000 }, (_, i) => (i % 4 === 3 ? 0.2 : 0.001)));
  // The last of viridis is yellow, and what hardly bends is dark.
  assert.deepEqual([...colors.subarray(12, 15)], [0xfd, 0xe7, 0x25]);
  assert.ok(colors[0] < 0x50 && colors[1] < 0x40);
});

test('points have room of their own on a surface, and any where none is finite', () => {
  const expected = Math.sqrt((4 * Math.PI) / 200_000);
  const found = spacingOf(sphere(200_000));
  assert.ok(Math.abs(found / expected - 1) < 0.5, `${found}, not ${expected}`);
  assert.equal(spacingOf(new Float32Array(600_000).fill(NaN)), Infinity);
});
