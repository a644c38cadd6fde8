// The pictures of npm run paper, taken small.
import assert from 'node:assert/strict';
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { takePictures } from '../../benches/paper/pictures.mjs';
import { createEstimator } from '../../dist/node.js';
import { ARTEFACTS } from './browser.mjs';

test('the pictures of the paper show something, and are small', { timeout: 240_000 }, async () => {
  const folder = join(ARTEFACTS, 'paper');
  mkdirSync(folder, { recursive: true });
  const estimator = await createEstimator({ threads: 1 });
  try {
    const plan = { spheres: [20_000], freeForm: 60_000 };
    const groups = await takePictures(estimator, { plan, scans: [], folder, tell: () => {} });
    assert.deepEqual(
      Object.values(groups).map((group) => group.length),
      [1, 3, 3, 0],
    );
    const bytes = Object.values(groups)
      .flat()
      .map(({ file }) => readFileSync(join(folder, file)));
    // A JPEG of one colour has some 3 KB.
    for (const picture of bytes)
      assert.ok(picture.length > 4_000 && picture.length < 60_000, `${picture.length} bytes`);
    assert.equal(new Set(bytes.map((picture) => picture.toString('base64'))).size, bytes.length, 'two are the same');
  } finally {
    estimator.dispose();
  }
});
