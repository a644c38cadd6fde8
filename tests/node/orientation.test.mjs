// npm run orientation, in its small form: that the bench counts, judges and tells what it should.
import assert from 'node:assert/strict';
import { mkdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { VARIANTS, cloudOf } from '../../benches/accuracy/clouds.mjs';
import { angles } from '../../benches/accuracy/judge.mjs';
import { readMeshes } from '../../benches/accuracy/meshes.mjs';
import { likeliest } from '../../benches/orientation/attainable.mjs';
import { MOST_SECONDS, rightSigns, verdicts } from '../../benches/orientation/judge.mjs';
import { FULL, MODES, SMALL, measureAll, plannedRows, withOutside } from '../../benches/orientation/measure.mjs';
import { details, report } from '../../benches/orientation/report.mjs';
import { scene } from '../../benches/orientation/scene.mjs';
import { SHAPES } from '../../benches/orientation/shapes.mjs';
import { seenFrom } from '../../benches/orientation/single.mjs';
import { signedVolume, thickness, windingNumber } from '../../benches/orientation/solid.mjs';
import { createEstimator } from '../../dist/node.js';
import { temporaryFolder } from './packed.mjs';

const estimator = {};
before(async () => Object.assign(estimator, { own: await createEstimator({ threads: 1 }) }));
after(() => estimator.own.dispose());

/** The twelve triangles of the box from `low` to `high`, as text of the vertices and of the faces; they look outwards. */
function box(low, high, first = 0) {
  const corners = Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? high : low)[axis]));
  const squares = ['0 2 3 1', '4 5 7 6', '0 1 5 4', '2 6 7 3', '0 4 6 2', '1 3 7 5'];
  const faces = squares.map((square) => square.split(' ').map((corner) => Number(corner) + first));
  return { corners, faces };
}

const ply = (boxes) => {
  const [corners, faces] = [boxes.flatMap(({ corners }) => corners), boxes.flatMap(({ faces }) => faces)];
  const axes = ['x', 'y', 'z'].map((axis) => `property float ${axis}\n`).join('');
  return `ply\nformat ascii 1.0\nelement vertex ${corners.length}\n${axes}element face ${faces.length}
property list uchar int vertex_indices\nend_header\n${[...corners, ...faces.map((face) => [4, ...face])].map((row) => row.join(' ')).join('\n')}\n`;
};

const BOX = box([0, 0, 0], [1, 2, 0.25]);
const inwards = ({ corners, faces }) => ({ corners, faces: faces.map((face) => face.toReversed()) });

/** Meshes of these files, read from a folder. */
function meshesOf(files) {
  const folder = join(temporaryFolder(), 'meshes');
  mkdirSync(folder);
  for (const [name, boxes] of Object.entries(files)) writeFileSync(join(folder, `${name}.ply`), ply(boxes));
  return withOutside(readMeshes(folder).meshes);
}

test('shares of right signs', () => {
  const truth = [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 0];
  const normals = [0, 0, 1, 0, 0.6, 0.8, 0, 0, 0, 0.8, 0.6, -1e-3, 0, 0, -1];
  // One has no normal, one has that of another face, and one no true normal.
  const { points, share, eitherWay, clear } = rightSigns(normals, truth);
  assert.deepEqual({ points, share, eitherWay }, { points: 4, share: 0.5, eitherWay: 0.5 });
  assert.deepEqual(clear, { points: 2, share: 1, eitherWay: 1 });
  assert.equal(rightSigns(normals, truth, (i) => i > 0).share, 1 / 3);
  const turned = normals.map((value) => -value);
  assert.equal(rightSigns(turned, truth).share, 0.25);
  assert.equal(rightSigns(turned, truth).eitherWay, 0.5);
  assert.deepEqual(rightSigns(turned, truth).clear, { points: 2, share: 0, eitherWay: 1 });
});

test('what holds for one sample of a shape holds for others', async () => {
  // Cubes that fall otherwise turned the inner of two noisy spheres inside out, and a cabinet in a corner of a room.
  for (const [name, variant, count, seed] of [
    ['nested', 'noise0.6', 50_000, 5],
    ['scene', 'clean', 100_000, 9],
  ]) {
    const { positions, normals: truth } = cloudOf(SHAPES[name].shape(), count, VARIANTS[variant], seed);
    const { normals } = await estimator.own.estimateNormals(positions, { orient: 'consistent' });
    assert.ok(rightSigns(normals, truth).share > 0.999, name);
  }
});

test('a room that was scanned from several places faces these', async () => {
  for (const stations of [2, 3]) {
    const { positions, normals: truth } = cloudOf(scene(stations, true)(), 60_000, {}, 1);
    const { normals, report } = await estimator.own.estimateNormals(positions, { orient: 'consistent' });
    assert.ok(rightSigns(normals, truth).share > 0.99, `${stations}`);
    assert.equal(report.components.largest[0].side, 'view');
    const { report: outward } = await estimator.own.estimateNormals(positions, { orient: 'outward' });
    assert.equal(outward.components.largest[0].side, 'air', 'nothing else tells it from a box');
  }
});

describe('the small run', () => {
  let rows;
  before(async () => {
    const { meshes } = meshesOf({ box: [BOX] });
    const { positions, normals } = cloudOf(SHAPES.sphere.shape(), 5_000, {}, 9);
    const scans = [
      { name: 'right', positions, normals },
      { name: 'turned', positions, normals: normals.map((value) => -value) },
    ];
    rows = await measureAll(estimator.own, plannedRows(SMALL, meshes, scans), { tell: () => {} });
  });
  const find = (name, variant) => rows.find((row) => row.name === name && row.variant === variant);

  test('has right signs, and none where the truth is turned', () => {
    for (const mode of MODES) {
      const shareOf = (name, variant = 'clean') => find(name, variant).modes[mode].signs.all;
      assert.equal(shareOf('sphere').share, 1);
      assert.equal(shareOf('terrain').eitherWay, 1);
      assert.equal(shareOf('right', 'as it is').share, 1);
      assert.equal(shareOf('turned', 'as it is').share, 0);
      assert.equal(shareOf('turned', 'as it is').eitherWay, 1);
    }
  });

  test('tells thick walls from thin ones', () => {
    const { signs } = find('box', 'noise0.6').modes.outward;
    assert.equal(signs.thick.points + signs.thin.points, signs.all.points);
    // Ten deviations are 0.135; the box is 0.25 thick where it is thinnest.
    assert.equal(signs.thin.points, 0);
    assert.equal(find('box', 'clean').modes.outward.signs.thick, undefined);
  });

  test('tells what is attainable of what is missed', async () => {
    const { meshes } = meshesOf({ box: [BOX] });
    const row = plannedRows(SMALL, meshes).find(({ name, variant }) => name === 'box' && variant === 'noise0.6');
    const inside = (cloud) => ({ ...cloud, normals: cloud.normals.map((value) => -value) });
    const turned = { ...row, cloud: () => inside(row.cloud()), surface: () => inside(row.surface()) };
    const wrong = { ...row, cloud: () => inside(row.cloud()) };
    const [right, ...missed] = await measureAll(estimator.own, [row, turned, wrong], { tell: () => {} });
    assert.equal(right.attainable, undefined);
    // A few points lie closer to a face that they are not of.
    const [known, unknown] = missed.map(({ attainable }) => attainable);
    assert.deepEqual([Object.keys(known), Object.keys(unknown)], [['thick'], ['thick']]);
    assert.ok(known.thick > 0.999 && unknown.thick < 0.001, `${known.thick}, ${unknown.thick}`);
  });

  test('tells how far lines are off, and that without noise signs change them for the better only', () => {
    for (const { variant, lines } of rows) {
      assert.deepEqual(Object.keys(lines), ['none', ...MODES]);
      if (variant === 'clean') assert.ok(lines.consistent <= lines.none, `${lines.consistent} for ${lines.none}`);
    }
    const { none, consistent } = find('box', 'noise0.6').lines;
    assert.ok(consistent !== none && Math.abs(consistent - none) < 0.1 * none, `${consistent} degrees for ${none}`);
  });

  test('tells times, and the surfaces', () => {
    for (const { modes, variant, kind, large } of rows) {
      assert.equal(large > 0, variant === 'clean' && kind !== 'view');
      assert.deepEqual(Object.keys(modes), MODES);
      for (const { components, largest, seconds } of Object.values(modes)) {
        assert.ok(components >= 1 && largest.points > 0 && largest.confidence >= 0 && largest.confidence <= 1);
        assert.ok(seconds.orientation > 0 && seconds.orientation < seconds.total);
      }
    }
  });

  test('the report has every row, and numbers only', () => {
    const facts = { machine: {}, minutes: 1, hasFolder: false, skipped: [], notes: new Map() };
    const peers = [
      { method: 'Open3D, 15', share: 0.99999, seconds: 1.5 },
      { method: 'MeshLib, 48', failure: 'more than 60 s' },
    ];
    const other = {
      ...facts,
      hasFolder: true,
      skipped: [{ name: 'scan.ply', reason: 'no faces' }],
      notes: new Map([['box', 'wound inwards, so turned']]),
    };
    const [without, withMeshes] = [
      report(rows.slice(0, 3), facts),
      report(
        rows.map((row) => (row.name === 'sphere' ? { ...row, peers } : row)),
        other,
      ),
    ];
    for (const text of [without, withMeshes])
      assert.doesNotMatch(text.replace(/^undefined, .*$/m, ''), /undefined|NaN|Infinity/);
    assert.match(without, /^\| sphere, clean \| 100 % \| 100 % \| 100 % \| 100 % \| 100 %: met \| 1 \|/m);
    assert.match(without, /^\| terrain, clean ○ \| 100 % \|/m);
    assert.match(without, /Skipped: no meshes; none were given/);
    assert.doesNotMatch(without, /Beside others/);
    // A surface with one side is told apart, and never called right.
    assert.match(without, /has one side only/);
    assert.doesNotMatch(details(rows), /moebius/);
    assert.match(
      withMeshes,
      /^\| turned, as it is \| 0\.000 % .* 99\.9 %: \*\*missed\*\* by consistent and outward \|/m,
    );
    assert.match(
      withMeshes,
      /^\| sphere, clean \| 100 %, .* s \| 100 %, .* s \| 99\.999 %, 1\.50 s \| more than 60 s \| met \|$/m,
    );
    assert.match(withMeshes, /^\| right signs: the best of them \|  \|  \|  \| 1 of 1 \| met \|$/m);
    assert.match(withMeshes, /^\| Open3D, 15: their time over ours \| 100 \| [\d.e+]+ \| [\d.e+]+ \| [01] of 1 \| /m);
    assert.match(withMeshes, /^\| MeshLib, 48: their time over ours \| 20 \|  \|  \| 0 of 0 \| \*\*missed\*\* \|$/m);
    assert.match(withMeshes, /- box: wound inwards, so turned/);
    assert.match(
      withMeshes,
      /^\| seconds for a million points, clean clouds of so many: consistent \| 0\.15 \| .* \| \d of 4 \|/m,
    );
    const beyond = { ...find('turned', 'as it is'), attainable: { all: 0.9876 } };
    assert.match(
      report([beyond], facts),
      /\| 99\.9 %: \*\*missed\*\* by consistent and outward; attainable 98\.76 % \|/,
    );
    assert.match(withMeshes, /- scan\.ply: no faces/);
  });
});

describe('the direction whose side is most likely right', () => {
  const dot = (a, b) => a.reduce((sum, value, axis) => sum + value * b[axis], 0);
  /** Faces of 8 by 8 with a point every 0.1, each with the axes along which its points lie. */
  const surface = (...faces) => {
    const steps = Array.from({ length: 80 }, (_, i) => (i - 39.5) / 10);
    const positions = faces.flatMap(({ at, u, v }) =>
      steps.flatMap((a) => steps.flatMap((b) => at.map((value, axis) => value + a * u[axis] + b * v[axis]))),
    );
    const normals = faces.flatMap(({ normal }) => Array.from({ length: 80 * 80 }, () => normal).flat());
    return { positions: new Float32Array(positions), normals: new Float32Array(normals), deviation: 0.2 };
  };
  const plate = (z, normal) => ({ at: [0, 0, z], u: [1, 0, 0], v: [0, 1, 0], normal });
  const near = ([above, below], place) => dot(likeliest(surface(above, below))(place), above.normal) > 0;

  test('is that of the nearer face of a wall', () => {
    const wall = [plate(0.2, [0, 0, 1]), plate(-0.2, [0, 0, -1])];
    assert.equal(near(wall, [0, 0, 0.05]), true);
    assert.equal(near(wall, [0, 0, -0.05]), false);
  });

  test('is outside of both faces of an edge, however much nearer one is', () => {
    // As sharp as 27 degrees.
    const [c, s] = [Math.cos(0.47), Math.sin(0.47)];
    const floor = { at: [4, 0, 0], u: [1, 0, 0], v: [0, 1, 0], normal: [0, 0, -1] };
    const roof = { at: [4 * c, 0, 4 * s], u: [c, 0, s], v: [0, 1, 0], normal: [-s, 0, c] };
    for (const place of [
      [0.3, 0, -0.3],
      [0.1, 0, 0.3],
    ]) {
      const direction = likeliest(surface(floor, roof))(place);
      assert.ok(dot(direction, floor.normal) > 0 && dot(direction, roof.normal) > 0, `${direction}`);
    }
  });
});

test('what is asked of a row', () => {
  const signs = (share, eitherWay = share, clear = share) => ({
    points: 9,
    share,
    eitherWay,
    clear: { share: clear, eitherWay: clear },
  });
  const judged = (row, all, parts = {}) => {
    const mode = { signs: { all, ...parts }, seconds: { orientation: MOST_SECONDS } };
    return verdicts({ open: false, sides: true, ...row, modes: { outward: mode } }).map(({ least, met, clear }) => [
      least,
      met,
      clear,
    ]);
  };
  const [shape, mesh] = [
    { kind: 'shape', variant: 'clean' },
    { kind: 'mesh', variant: 'noise0.6' },
  ];
  assert.deepEqual(judged(shape, signs(0.99999)), [[1, false, false]]);
  assert.deepEqual(judged(shape, signs(0.99999, 1, 1)), [[1, false, true]]);
  assert.deepEqual(judged({ ...shape, open: true }, signs(0, 1, 1)), [[1, true, true]]);
  assert.deepEqual(judged({ ...shape, sides: false }, signs(1)), []);
  assert.deepEqual(judged({ ...shape, variant: 'noise0.12' }, signs(0.995)), [[0.995, true, true]]);
  assert.deepEqual(judged(mesh, signs(1), { thick: signs(0.996), thin: signs(0.96) }), [
    [0.995, true, true],
    [0.97, false, false],
  ]);
  assert.deepEqual(judged(mesh, signs(1), { thick: signs(0.996), thin: { points: 0, share: NaN } }), [
    [0.995, true, true],
  ]);
  assert.deepEqual(judged({ ...mesh, variant: 'clean' }, signs(0.999)), [[0.999, true, true]]);
  assert.deepEqual(judged({ ...mesh, variant: 'stripes' }, signs(0.97)), [[0.97, true, true]]);
  assert.deepEqual(judged({ kind: 'ranges', variant: 'as it is' }, signs(0.9989)), [[0.999, false, false]]);
  // 'outward' is not for what was seen from one side.
  const both = { consistent: { signs: { all: signs(0.995) } }, outward: { signs: { all: signs(0) } } };
  for (const kind of ['view', 'scene']) {
    const [verdict, ...others] = verdicts({ kind, variant: 'clean', open: false, sides: true, modes: both });
    assert.deepEqual([verdict.mode, verdict.met, others], ['consistent', true, []]);
  }
});

describe('the shapes', () => {
  for (const [name, { shape, noise, open = false, sides = true }] of Object.entries(SHAPES)) {
    test(`${name}: its true normals are those of its surface, and outward`, async () => {
      // So many that the walls of fins and teeth are thicker than what ten points cover.
      const count = 100_000;
      const { positions, normals } = cloudOf(shape(count), count, {}, 7);
      const found = await estimator.own.estimateNormals(positions, { method: 'knn', k: 10 });
      const all = angles(found.normals, normals).sort();
      assert.ok(all[all.length >> 1] < 1, `half are off by more than ${all[all.length >> 1]} degrees`);
      assert.ok(VARIANTS[noise ?? 'noise0.6'].noise > 0);
      // The flow of the place out of a closed surface is three times its volume; what was scanned
      // from amid it faces the scanner.
      let flow = 0;
      for (let at = 0; at < positions.length; at++) flow += positions[at] * normals[at];
      if (['hall', 'hills'].includes(name)) flow = -flow;
      if (!open && sides) assert.ok(flow / count > 0.005, `${flow}`);
    });
  }

  test('the tube looks away from its axis', () => {
    const { positions, normals } = cloudOf(SHAPES.tube.shape(), 4_000, {}, 7);
    let outward = 0;
    for (let at = 0; at < positions.length; at += 3) {
      const [x, y, z] = positions.subarray(at, at + 3);
      const from = [0, y - 0.5 * Math.sin(1.1 * x), z - 0.3 * Math.cos(1.55 * x)];
      if (from.reduce((sum, value, i) => sum + value * normals[at + i], 0) > 0) outward++;
    }
    assert.equal(outward, 4_000);
  });
});

describe('meshes', () => {
  test('are turned if they are wound inwards, and skipped if they overlap themselves', () => {
    const beside = box([1, 0, 0], [2, 2, 0.25], 8);
    const through = box([0.5, 0.5, -1], [0.7, 0.7, 1], 8);
    const apart = box([3, 0, 0], [4, 2, 0.25], 8);
    const found = meshesOf({
      apart: [BOX, apart],
      beside: [BOX, beside],
      inward: [inwards(BOX)],
      through: [BOX, through],
    });
    const names = found.meshes.map(({ name }) => name);
    assert.deepEqual(names, ['apart', 'inward']);
    assert.deepEqual(
      found.skipped.map(({ name }) => name),
      ['beside', 'through'],
    );
    found.skipped.forEach(({ reason }) => assert.match(reason, /^overlaps itself: \d+ % of its surface/));
    assert.deepEqual([...found.notes], [['inward', 'wound inwards, so turned']]);
    const { positions, normals } = cloudOf(found.meshes[1].sampler, 1_000, {}, 1);
    const middle = [0.5, 1, 0.125];
    for (let at = 0; at < positions.length; at += 3) {
      const along = middle.reduce((sum, value, i) => sum + (positions[at + i] - value) * normals[at + i], 0);
      assert.ok(along > 0.1);
    }
  });

  test('enclose a volume, and places', () => {
    const { corners } = meshesOf({ box: [BOX] }).meshes[0];
    assert.ok(Math.abs(signedVolume(corners) - 0.5) < 1e-12);
    const close = (value, expected) => assert.ok(Math.abs(value - expected) < 1e-9, `${value}`);
    close(windingNumber(corners, [0.5, 1, 0.2]), 1);
    close(windingNumber(corners, [0.5, 1, 0.3]), 0);
  });

  test('are seen from one place', () => {
    // The second box stands in the shadow of the first, but for a rim: the scanner is near.
    const { corners, sampler } = meshesOf({ row: [BOX, box([0, 0, -3], [1, 2, -2], 8)] }).meshes[0];
    const seen = cloudOf(seenFrom([0, 0, 1], corners, sampler), 4_000, {}, 3);
    const at = (i) => [seen.positions, seen.normals].map((values) => [...values.subarray(3 * i, 3 * i + 3)]);
    const all = Array.from({ length: 4_000 }, (_, i) => at(i));
    assert.ok(
      all.every(([, normal]) => normal[2] === 1),
      'only what faces the scanner',
    );
    assert.ok(
      all.every(([place]) => Math.abs(place[2] - 0.25) < 1e-6),
      'nothing in the shadow',
    );
    const fromTheCorner = cloudOf(seenFrom([1, 1, 1], corners, sampler), 4_000, {}, 3);
    const sides = new Set();
    for (let i = 0; i < 4_000; i++) sides.add([...fromTheCorner.normals.subarray(3 * i, 3 * i + 3)].join());
    assert.deepEqual([...sides].sort(), ['0,0,1', '0,1,0', '1,0,0']);
    // As many points in every direction: what is nearer has more.
    const [near, far] = [1, -1].map((side) => {
      const isThere = (x, y) => side * (x - 0.5) > 0.25 && side * (y - 1) > 0.5;
      return [...Array(4_000).keys()].filter((i) => {
        const [x, y, z] = fromTheCorner.positions.subarray(3 * i, 3 * i + 3);
        return z > 0.2 && fromTheCorner.normals[3 * i + 2] === 1 && isThere(x, y);
      }).length;
    });
    assert.ok(near > 1.1 * far && far > 20, `${near} near, ${far} far`);
  });

  test('have walls of a thickness', () => {
    // Many triangles, so that the tree of boxes has several levels: a row of boxes, each 0.5 + 0.01 i wide.
    const boxes = Array.from({ length: 40 }, (_, i) => box([2 * i, 0, 0], [2 * i + 0.5 + 0.01 * i, 1, 0.25], 8 * i));
    const { corners, sampler } = meshesOf({ row: boxes }).meshes[0];
    const cloud = cloudOf(sampler, 2_000, {}, 3);
    const walls = thickness(corners, cloud, 1e-4);
    walls.forEach((wall, i) => {
      const axis = [0, 1, 2].find((axis) => Math.abs(cloud.normals[3 * i + axis]) > 0.5);
      const expected = [0.5 + 0.01 * Math.floor((cloud.positions[3 * i] + 0.1) / 2), 1, 0.25][axis];
      assert.ok(Math.abs(wall - expected) < 1e-4, `${wall}, not ${expected}`);
    });
    // Outside there is nothing behind.
    const apart = { positions: Float32Array.of(-1, 0.5, 0.1), normals: Float32Array.of(1, 0, 0) };
    const [away] = thickness(corners, apart, 1e-4);
    assert.equal(away, Infinity);
  });
});
