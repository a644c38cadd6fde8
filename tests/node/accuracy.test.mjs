// npm run accuracy, in its small form: bounds for every row, and that the bench itself is right.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { VARIANTS, cloudOf, diagonal } from '../../benches/accuracy/clouds.mjs';
import { jetNormal, principalAxes } from '../../benches/accuracy/jet.mjs';
import { angles, summary, unresolved } from '../../benches/accuracy/judge.mjs';
import {
  ALL,
  FULL,
  KNN,
  METHODS,
  SMALL,
  chosenRows,
  measureAll,
  plannedRows,
} from '../../benches/accuracy/measure.mjs';
import { meshSampler, readMeshes } from '../../benches/accuracy/meshes.mjs';
import { nearestNeighbours } from '../../benches/accuracy/neighbours.mjs';
import { details, report } from '../../benches/accuracy/report.mjs';
import { SHAPES } from '../../benches/accuracy/shapes.mjs';
import { createEstimator } from '../../dist/node.js';
import { randomNumbers, sameBits } from './clouds.mjs';
import { temporaryFolder } from './packed.mjs';

/**
 * What 'auto' may be off on the rows of the small run: root mean square in degrees; times the best fixed k; the share of
 * the points that it leaves without a normal though their nearest neighbours give one. When a cloud is turned, nothing may
 * change by 5 % or more.
 */
const BOUNDS = {
  'sphere-clean': { rms: 0.1, ratio: 0.28, missed: 0 },
  'cube-clean': { rms: 2.2, ratio: 0.22, missed: 0 },
  'outliers-clean': { rms: 0.24, ratio: 0.18, missed: 0 },
  'terrain-noise0.6': { rms: 8.1, ratio: 1.2, missed: 0 },
  'cylinder-noise0.6': { rms: 11.3, ratio: 0.92, missed: 0 },
  'torus-stripes': { rms: 0.27, ratio: 0.17, missed: 0 },
  'helicoid-gradient': { rms: 0.25, ratio: 0.26, missed: 0 },
};

const estimator = {};
before(async () => Object.assign(estimator, { own: await createEstimator() }));
after(() => estimator.own.dispose());

describe('the small run', () => {
  let rows;
  before(async () => {
    rows = await measureAll(estimator.own, plannedRows(SMALL, []), { sampled: SMALL.sampled, tell: () => {} });
  });

  test('auto stays within its bounds', () => {
    const found = Object.fromEntries(rows.map((row) => [`${row.name}-${row.variant}`, row]));
    assert.deepEqual(Object.keys(found).sort(), Object.keys(BOUNDS).sort());
    for (const [name, { rms, ratio, missed }] of Object.entries(BOUNDS)) {
      const { methods, ratio: times, turning } = found[name];
      assert.ok(methods.auto.rms <= rms, `${name}: ${methods.auto.rms} degrees`);
      assert.ok(times <= ratio, `${name}: ${times} times the best k`);
      assert.ok(methods.auto.missed <= missed, `${name}: ${methods.auto.missed} without a normal`);
      assert.ok(turning < 1.05, `${name}: ${turning} times when it is turned`);
    }
  });

  test('every method is measured on every row', () => {
    for (const { name, methods, best, bestOfAll } of rows) {
      assert.deepEqual(Object.keys(methods), ALL, name);
      for (const method of Object.keys(METHODS)) {
        const { rms, mean, over, milliseconds, sampled } = methods[method];
        assert.ok(mean > 0 && mean <= rms && rms < 90 && milliseconds > 0 && sampled > 0, `${name}, ${method}`);
        assert.ok(over[0] >= over[1] && over[1] >= over[2] && over[2] >= 0, `${name}, ${method}: ${over}`);
      }
      assert.ok(KNN.every((method) => methods[method].rms >= methods[best].rms));
      assert.ok(
        ALL.filter((method) => /^(knn|jet)/.test(method)).every(
          (method) => methods[method].sampled >= methods[bestOfAll].sampled,
        ),
      );
    }
  });

  test('the report has every row, and numbers only', () => {
    const facts = { machine: {}, threads: 2, minutes: 1, sampled: SMALL.sampled, hasFolder: false, skipped: [] };
    const meshes = rows.map((row) => ({ ...row, name: `mesh ${row.name}`, about: 'a mesh; its maker', isMesh: true }));
    const six = Object.keys(VARIANTS).map((variant) => ({ ...rows[0], name: 'six', variant }));
    const other = { ...facts, hasFolder: true, skipped: [{ name: 'scan.ply', reason: 'no faces' }] };
    const [without, withMeshes] = [report(rows, facts), report([...rows, ...meshes, ...six], other)];
    for (const text of [without, withMeshes]) {
      assert.doesNotMatch(text.replace(/^undefined, .*$/m, ''), /undefined|NaN|Infinity/);
      for (const { name, methods } of rows) {
        assert.ok(text.includes(`| ${name} | ${methods.auto.rms.toFixed(methods.auto.rms < 9.95 ? 2 : 1)} |`), name);
      }
    }
    assert.match(without, /Skipped: no meshes; none were given/);
    assert.match(without, /No cloud is there in all six variants/);
    assert.match(withMeshes, /- scan\.ply: no faces/);
    assert.match(withMeshes, /- mesh sphere: a mesh; its maker/);
    assert.match(withMeshes, /the mean of those of 1 clouds: six\./);
    assert.equal(details(rows).length, 4);
  });
});

describe('the shapes', () => {
  for (const [name, shape] of Object.entries(SHAPES)) {
    test(`${name}: its true normals are those of its surface`, async () => {
      const { positions, normals } = cloudOf(shape(40_000), 40_000, VARIANTS.clean, 7);
      const found = await estimator.own.estimateNormals(positions, { method: 'knn', k: 10 });
      const all = angles(found.normals, normals).filter((angle) => !Number.isNaN(angle));
      assert.ok(all.sort()[all.length >> 1] < 1, `half are off by more than ${all[all.length >> 1]} degrees`);
      const lengths = Array.from({ length: 40_000 }, (_, i) => Math.hypot(...normals.subarray(3 * i, 3 * i + 3)));
      assert.ok(lengths.every((length) => length === 0 || Math.abs(length - 1) < 1e-6));
      const known = lengths.filter((length) => length > 0).length / 40_000;
      assert.ok(name === 'outliers' ? Math.abs(known - 0.98) < 0.003 : known === 1, `${known} have a true normal`);
    });
  }

  test('a seed gives the same bits; noise moves the points of the clean cloud', () => {
    const [a, b, noisy] = ['clean', 'clean', 'noise0.6'].map((name) =>
      cloudOf(SHAPES.cube(), 5_000, VARIANTS[name], 2),
    );
    assert.ok(sameBits(a.positions, b.positions) && sameBits(a.normals, noisy.normals));
    // The cube is turned: its box is wider than its edge.
    const sides = [0, 1, 2].map((axis) => {
      const along = a.positions.filter((_, i) => i % 3 === axis);
      return Math.max(...along) - Math.min(...along);
    });
    const moves = a.positions.map((value, i) => noisy.positions[i] - value);
    const deviation = Math.sqrt(moves.reduce((sum, move) => sum + move * move, 0) / moves.length);
    assert.ok(Math.abs(deviation / (0.006 * Math.hypot(...sides)) - 1) < 0.03, `${deviation}`);
  });

  test('patterns of density', () => {
    const share = (variant, isIn) => {
      const { positions } = cloudOf(SHAPES.tube(), 20_000, VARIANTS[variant], 3);
      const places = positions.filter((_, i) => i % 3 === 0);
      const [low, high] = [Math.min(...places), Math.max(...places)];
      return places.filter((x) => isIn((x - low) / (high - low))).length / 20_000;
    };
    // The longest side of the tube's box is that of x.
    const isSparse = (place) => Math.floor(10 * Math.min(place, 0.999)) % 2 === 1;
    assert.ok(Math.abs(share('clean', isSparse) - 0.5) < 0.03 && share('stripes', isSparse) < 0.12);
    assert.ok(share('gradient', (place) => place > 0.5) < 0.6 * share('clean', (place) => place > 0.5));
  });
});

test('steps of coordinates', () => {
  const [clean, steps] = ['clean', 'steps'].map((variant) => cloudOf(SHAPES.tube(), 20_000, VARIANTS[variant], 3));
  const width = diagonal(clean) / 400;
  const moves = steps.positions.map((value, i) => value - clean.positions[i]);
  assert.ok(
    moves.every((move) => Math.abs(move) <= 0.5001 * width) && moves.some((move) => Math.abs(move) > 0.49 * width),
  );
  const numbers = [...new Set(steps.positions)].sort((a, b) => a - b);
  assert.ok(numbers.slice(1).every((value, i) => value - numbers[i] > 0.999 * width));
  assert.ok(sameBits(clean.normals, steps.normals));
});

describe('the rows', () => {
  test('all shapes in all variants, and every mesh in every variant', () => {
    const rows = plannedRows(FULL, [{ name: 'bunny', about: 'a bunny', sampler: SHAPES.sphere() }]);
    const names = new Set(rows.map(({ name, variant }) => `${name}-${variant}`));
    assert.equal(names.size, rows.length);
    for (const name of [...Object.keys(SHAPES), 'bunny'])
      for (const variant of Object.keys(VARIANTS)) assert.ok(names.has(`${name}-${variant}`));
  });

  test('are chosen by shape, variant or both', () => {
    const rows = plannedRows(FULL, []);
    assert.equal(chosenRows(rows, ['torus']).length, 7);
    assert.equal(chosenRows(rows, ['torus', 'torus-clean']).length, 7);
    assert.equal(chosenRows(rows, ['stripes', 'cube-clean']).length, Object.keys(SHAPES).length + 1);
    assert.throws(() => chosenRows(rows, ['torus', 'teapot']), /no row is called teapot; wanted some of sphere, clean/);
  });
});

test('angles are unsigned; a point without a normal is off by 90 degrees, one without a true normal does not count', () => {
  const [sine, cosine] = [Math.sin(0.1), Math.cos(0.1)];
  const truth = [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0];
  const normals = [0, sine, cosine, 0, -sine, -cosine, 0, 0, 0, 1, 0, 0];
  const all = angles(normals, truth);
  const small = 18 / Math.PI;
  assert.ok([small, small, 90].every((angle, i) => Math.abs(all[i] - angle) < 1e-12) && Number.isNaN(all[3]));
  const { rms, mean, over } = summary(all);
  assert.ok(Math.abs(mean - (2 * small + 90) / 3) < 1e-12);
  assert.ok(Math.abs(rms - Math.sqrt((2 * small * small + 8100) / 3)) < 1e-12);
  assert.deepEqual(over, [1, 1 / 3, 1 / 3]);
  assert.equal(unresolved(normals, truth), 1 / 3);
  assert.equal(unresolved(normals, truth, truth), 1 / 3);
  assert.equal(unresolved(normals, truth, normals), 0);
});

describe('the jet', () => {
  test('its neighbours are the nearest', () => {
    const random = randomNumbers(5);
    // Every fourth point is there twice.
    const positions = Float32Array.from({ length: 3 * 2_000 }, () => random());
    for (let i = 0; i < 2_000; i += 4) positions.copyWithin(3 * i + 3, 3 * i, 3 * i + 3);
    const nearest = nearestNeighbours(positions);
    const distance = (a, b) =>
      Math.hypot(...[0, 1, 2].map((axis) => positions[3 * a + axis] - positions[3 * b + axis]));
    for (const point of [0, 1, 777, 1_999]) {
      const all = Array.from({ length: 2_000 }, (_, i) => distance(point, i)).sort((a, b) => a - b);
      for (const k of [1, 10, 100, 3_000]) {
        const found = [...nearest(positions.subarray(3 * point, 3 * point + 3), k)];
        assert.equal(new Set(found).size, Math.min(k, 2_000));
        found.forEach((other, i) => assert.equal(distance(point, other), all[i]));
      }
    }
  });

  test('is exact on a quadratic surface, and its plane is that of knn', async () => {
    // Even about both axes, so that the frame of the principal components is that of the axes.
    const grid = Array.from({ length: 81 }, (_, i) => [(i % 9) - 4, Math.floor(i / 9) - 4]);
    const points = grid.map(([x, y]) => [x, y, 0.03 * x * x + 0.02 * y * y + 0.04 * x * y]);
    for (const [px, py, pz] of [points[40], points[3], points[80]]) {
      const relative = Float64Array.from(points.flatMap(([x, y, z]) => [x - px, y - py, z - pz]));
      const expected = [-0.06 * px - 0.04 * py, -0.04 * py - 0.04 * px, 1];
      const [angle] = angles(jetNormal(relative, 81), expected);
      assert.ok(angle < 1e-6, `${angle} degrees`);
      const { normals } = await estimator.own.estimateNormals(Float64Array.from(points.flat()), {
        method: 'knn',
        k: 81,
      });
      const [difference] = angles(principalAxes(relative, 81)[0], normals.subarray(0, 3));
      assert.ok(difference < 1e-3, `${difference} degrees`);
    }
  });

  test('gives a finite normal of length one also on a line, and none in one place', () => {
    const line = Float64Array.from({ length: 30 }, (_, i) => (i % 3 === 1 ? i : 0));
    assert.ok(Math.abs(Math.hypot(...jetNormal(line, 10)) - 1) < 1e-12);
    assert.deepEqual(jetNormal(new Float64Array(30), 10), [0, 0, 0]);
  });
});

describe('meshes', () => {
  /** Two squares that share an edge: one in the plane z = 0, one upright in x = 1; from below and from outside. */
  const CORNERS = [0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1];
  const head = (format, elements) =>
    `ply\nformat ${format} 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n${elements}end_header\n`;
  const FACES = 'element face 2\nproperty list uchar int vertex_indices\nproperty uchar red\n';
  const text = `${head('ascii', FACES)}${CORNERS.join('\n')}\n4 0 2 3 1 7\n4 1 3 5 4 7\n`;

  function strips(isLittle) {
    const elements = 'element tristrips 1\nproperty list int32 int32 vertex_indices\n';
    const begin = Buffer.from(head(`binary_${isLittle ? 'little' : 'big'}_endian`, elements));
    const strip = [2, 3, 0, 1, -1, 3, 5, 1, 4];
    const body = new DataView(new ArrayBuffer(4 * (CORNERS.length + 1 + strip.length)));
    CORNERS.forEach((value, i) => body.setFloat32(4 * i, value, isLittle));
    [strip.length, ...strip].forEach((value, i) => body.setInt32(4 * (CORNERS.length + i), value, isLittle));
    return Buffer.concat([begin, Buffer.from(body.buffer)]);
  }

  const all = { text: Buffer.from(text), 'strips, little endian': strips(true), 'strips, big endian': strips(false) };
  for (const [name, bytes] of Object.entries(all)) {
    test(`points of a mesh: ${name}`, () => {
      const { positions, normals } = cloudOf(meshSampler(bytes), 4_000, VARIANTS.clean, 1);
      let flat = 0;
      for (let at = 0; at < positions.length; at += 3) {
        const [[x, y, z], normal] = [positions, normals].map((values) => [...values.subarray(at, at + 3)]);
        assert.ok([x, y, z].every((value) => value >= 0 && value <= 1));
        if (z === 0) flat++;
        else assert.equal(x, 1);
        assert.deepEqual(
          normal.map((value) => Math.round(value) + 0),
          z === 0 ? [0, 0, -1] : [1, 0, 0],
        );
      }
      assert.ok(Math.abs(flat - 2_000) < 150, `${flat} in one half`);
    });
  }

  test('of a folder those with faces are read, and the others named with the reason', () => {
    const folder = join(temporaryFolder(), 'meshes');
    mkdirSync(folder);
    writeFileSync(join(folder, 'a.ply'), text);
    writeFileSync(join(folder, 'b.ply.gz'), gzipSync(text));
    writeFileSync(join(folder, 'empty.ply'), head('ascii', 'element face 0\nproperty list uchar int vertex_indices\n'));
    writeFileSync(join(folder, 'lost.ply'), text.replace('4 0 2 3 1', '4 0 2 3 9'));
    writeFileSync(join(folder, 'photo.ply'), 'GIF89a');
    writeFileSync(join(folder, 'range.ply'), text.replace('element face', 'element camera 0\nelement face'));
    writeFileSync(join(folder, 'scan.ply'), head('ascii', '') + CORNERS.join(' '));
    writeFileSync(join(folder, 'short.ply'), strips(true).subarray(0, -5));
    writeFileSync(join(folder, 'notes.txt'), text);
    const { meshes, skipped } = readMeshes(folder);
    assert.deepEqual(
      meshes.map(({ name }) => name),
      ['a', 'b'],
    );
    const reasons = Object.fromEntries(skipped.map(({ name, reason }) => [name, reason]));
    assert.match(reasons['empty.ply'], /^no faces$/);
    assert.match(reasons['lost.ply'], /a vertex that is not there/);
    assert.match(reasons['photo.ply'], /no PLY header/);
    assert.match(reasons['range.ply'], /a raw range map/);
    assert.match(reasons['scan.ply'], /^no faces$/);
    assert.ok(reasons['short.ply'] && skipped.length === 6);
  });
});
