// npm run paper, in its small form: what must hold on any machine, and that the report says what was measured.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { before, describe, test } from 'node:test';
import { gzipSync } from 'node:zlib';
import * as article from '../../benches/paper/article.mjs';
import { bar, claims } from '../../benches/paper/claims.mjs';
import { deviations, summary } from '../../benches/paper/deviation.mjs';
import { CLASSED, OURS, SMALL, VARIANTS, exponent } from '../../benches/paper/experiments.mjs';
import { report } from '../../benches/paper/report.mjs';
import { reproduce } from '../../benches/paper/reproduce.mjs';
import { createEstimator } from '../../dist/node.js';
import { sphere } from './clouds.mjs';
import { temporaryFolder } from './packed.mjs';

const folder = temporaryFolder();
const tell = () => {};

/** A sphere as a PLY in text. */
function ply(count) {
  const points = sphere(count);
  const rows = Array.from({ length: count }, (_, i) => points.subarray(3 * i, 3 * i + 3).join(' '));
  const properties = 'property float x\nproperty float y\nproperty float z\n';
  return `ply\nformat ascii 1.0\nelement vertex ${count}\n${properties}end_header\n${rows.join('\n')}\n`;
}

/** Every file that the report links to. */
const links = (text) => [...text.matchAll(/\]\(([^)]*)\)/g)].map(([, file]) => file);

describe('the small run', () => {
  const out = join(folder, 'out');
  const scans = join(folder, 'scans');
  let rows;
  let text;
  before(async () => {
    mkdirSync(scans);
    writeFileSync(join(scans, 'plain.ply'), ply(3_000));
    writeFileSync(join(scans, 'packed.ply.gz'), gzipSync(ply(5_000)));
    writeFileSync(join(scans, 'few.ply'), ply(100));
    writeFileSync(join(scans, 'photo.ply'), 'GIF89a, not a scan');
    writeFileSync(join(scans, 'broken.ply.gz'), 'not gzipped');
    writeFileSync(join(scans, 'notes.txt'), 'no scan');
    ({ rows } = await reproduce({ createEstimator, plan: SMALL, scans, out, withPictures: false, tell }));
    text = readFileSync(join(out, 'paper.md'), 'utf8');
  });

  test('every method is measured on every cloud', () => {
    const clouds = [...rows.spheres, rows.freeForm, ...rows.scans];
    assert.deepEqual(
      clouds.map(({ name }) => name),
      [...SMALL.spheres.map((points) => `${points / 1e6} M`), 'free-form surface', 'plain', 'packed'],
    );
    for (const { name, points, methods } of clouds) {
      assert.deepEqual(Object.keys(methods), Object.keys(VARIANTS), name);
      for (const [variant, method] of Object.entries(methods)) {
        assert.equal(method.points, points);
        assert.ok(method.module > 0 && method.total > 0, `${name}, ${variant}`);
        assert.equal(method.mode, 'single');
      }
    }
    for (const { steps } of rows.sweep) assert.equal(steps.length, SMALL.factors.length);
  });

  test('errors on spheres are below the bound of the paper', () => {
    for (const { name, methods } of rows.spheres) {
      for (const variant of ['0.4 L', '1.0 L', '1.5 L', 'auto', 'knn']) {
        const { mean, rms, worst } = methods[variant].error;
        assert.ok(mean > 0 && mean < article.DEVIATION, `${name}, ${variant}: mean ${mean}`);
        assert.ok(rms >= mean && worst < 3, `${name}, ${variant}: rms ${rms}, worst ${worst}`);
      }
    }
  });

  test('a second implementation finds the same number of nodes for all but a few points', () => {
    for (const { points, methods } of rows.spheres) {
      for (const variant of CLASSED) {
        const { classes, miscounted } = methods[variant];
        assert.ok(miscounted <= points / 1000, `${miscounted} of ${points}`);
        assert.ok(Math.abs(classes.reduce((sum, { share }) => sum + share, 0) - 1) < 1e-9);
      }
    }
  });

  test('claims that need no clock come out as they must', () => {
    const all = claims(rows);
    assert.equal(all.length, 12);
    for (const { claim, paper, here, holds } of all) {
      assert.equal(typeof holds, 'boolean', claim);
      assert.ok(text.includes(`| ${claim} | ${paper} | ${here} |`), claim);
    }
    const verdict = (part) => all.find(({ claim }) => claim.includes(part)).holds;
    assert.equal(verdict('mean deviation stays below'), true);
    assert.equal(verdict('error grows greatly'), true);
    assert.equal(verdict('as many cubes as there are points'), false);
  });

  test('a claim that fails reads as failing', () => {
    const worse = structuredClone(rows);
    worse.spheres[0].methods['1.0 L'].error.mean = 0.01;
    for (const { methods } of worse.spheres) methods.egg.rounds = methods['1.0 L'].rounds;
    const facts = { machine: {}, minutes: 1, skipped: [], hasFolder: true };
    const [before, after] = [rows, worse].map((rows) => report(rows, facts).match(/does not hold/g).length);
    assert.ok(after > before, `${after} after ${before}`);
    const [deviation, , , egg] = claims(worse);
    assert.deepEqual([deviation.holds, egg.holds], [false, false]);
    assert.match(report(worse, facts), /20 times faster than EGG on every row: .*\*\*missed\*\* at .*1\.0 L/);
  });

  test('the bar is held against every row', () => {
    const all = bar(rows);
    assert.deepEqual(
      all.map(({ variant }) => variant),
      OURS,
    );
    for (const { clouds, knn, egg } of all) {
      assert.equal(clouds, SMALL.spheres.length + 3);
      for (const { values, met } of [knn, egg]) assert.ok(values.length === clouds && met <= clouds);
    }
  });

  test('the report names what was skipped and why, and shows only files that are there', () => {
    for (const expected of [/- few\.ply: 100 points/, /- photo\.ply: ./, /- broken\.ply\.gz: ./])
      assert.match(text, expected);
    assert.ok(!text.includes('notes.txt') && !text.includes(folder), 'no other files, no paths');
    assert.doesNotMatch(text, /undefined|NaN|Infinity/);
    assert.match(text, /No pictures/);
    assert.deepEqual(
      links(text).filter((file) => !existsSync(join(out, file))),
      [],
    );
    for (const file of ['time-spheres', 'time-scans', 'time-edge', 'error-edge']) {
      assert.ok(links(text).includes(`paper/${file}.svg`));
      const svg = readFileSync(join(out, 'paper', `${file}.svg`), 'utf8');
      assert.match(svg, /^<svg [^]*<\/svg>\n$/);
      assert.doesNotMatch(svg, /NaN|undefined|Infinity/);
    }
  });

  test('without scans the report says so', () => {
    const facts = { machine: {}, minutes: 1, skipped: [], hasFolder: false };
    const none = report({ ...rows, scans: [] }, facts);
    assert.match(none, /Skipped: no scans; none were given/);
    assert.ok(!none.includes('time-scans.svg'));
  });
});

test('deviations are lengths of differences, sign aside', () => {
  const [sine, cosine] = [Math.sin(0.1), Math.cos(0.1)];
  const truth = [0, 0, 2, 0, 0, 2, 0, 0, 2];
  const found = deviations([0, sine, cosine, 0, -sine, -cosine, 0, 0, 0], truth);
  const expected = 2 * Math.sin(0.05);
  assert.ok([0, 1].every((i) => Math.abs(found[i] - expected) < 1e-12) && Math.abs(found[2] - Math.SQRT2) < 1e-12);
  const { mean, worst, wrong } = summary(found);
  assert.ok(Math.abs(mean - (2 * expected + Math.SQRT2) / 3) < 1e-12 && Math.abs(worst - 90) < 1e-6);
  assert.equal(wrong, 1 / 3);
});

test('the exponent of a power law', () => {
  const power = exponent([1, 2, 3, 10].map((x) => [x, 7 * x ** 1.3]));
  assert.ok(Math.abs(power - 1.3) < 1e-12, `${power}`);
});
