// Where comments say that the scanner stood. The module is in no export of the package: compiled here.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { transformSync } from 'esbuild';
import { root } from './packed.mjs';

const { code } = transformSync(readFileSync(join(root, 'src', 'js', 'scanner.ts'), 'utf8'), { loader: 'ts' });
const { scannerOf } = await import(`data:text/javascript,${encodeURIComponent(code)}`);

const cloud = (comments, rest = {}) => ({ origin: [0, 0, 0], source: { comments, ...rest } });

test('a comment that names a place by three numbers is understood, and no other', () => {
  const forms = {
    'scanner position: 1.5 0 2': [1.5, 0, 2],
    'scanner position: 1.5, 0, 2': [1.5, 0, 2],
    'scanner_position=(1,2,3)': [1, 2, 3],
    'Scanner Location [ -1; +2; .5 ]': [-1, 2, 0.5],
    'SENSOR ORIGIN 1e3 -2.5E-1 3.': [1000, -0.25, 3],
    'camera-position x=1 y=-2 z=3': [1, -2, 3],
    'the camera: position 1 2 3 m': [1, 2, 3],
    'viewpoint 1 2 3': [1, 2, 3],
    'view point\t1\t2\t3': [1, 2, 3],
    'View_Point: 4500000.125 5 6': [4500000.125, 5, 6],
    // With a direction, a unit, a number of its own, too few, too large.
    'viewpoint 0 0 0 1 0 0 0': undefined,
    'scanner position: 1 2': undefined,
    'scanner position: unknown': undefined,
    'scanner position (T2): 1 2 3': undefined,
    'scanner 2 position: 1 2 3': undefined,
    'scanner position: 1 2 1e999': undefined,
    // Of something else.
    'scanner serial 1 2 3': undefined,
    'position 1 2 3': undefined,
    'position of the scanner: 1 2 3': undefined,
    'review pointing 1 2 3': undefined,
    '': undefined,
  };
  for (const [comment, place] of Object.entries(forms)) assert.deepEqual(scannerOf(cloud([comment])), place, comment);
});

test('the first comment that fits counts, before all of them the element camera; relative to the origin', () => {
  const comments = ['scanner position: 1 2', 'scanner position: 4 5 6', 'viewpoint 7 8 9'];
  assert.deepEqual(scannerOf(cloud(comments)), [4, 5, 6]);
  assert.deepEqual(scannerOf({ ...cloud(comments), origin: [1, 2, 3] }), [3, 3, 3]);
  assert.deepEqual(scannerOf({ ...cloud(comments, { viewpoint: [10, 10, 10] }), origin: [1, 2, 3] }), [9, 8, 7]);
  assert.equal(scannerOf(cloud([])), undefined);
});
