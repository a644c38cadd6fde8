// The shaded pictures, taken from the page's viewer in a browser without a window.

import { copyFileSync, mkdirSync, rmSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { root } from '../../scripts/run.mjs';
import { serve } from '../../scripts/serve.mjs';
import { findBrowser } from '../../scripts/setup.mjs';
import { freeForm, sphere } from '../clouds.mjs';
import { VARIANTS } from './experiments.mjs';

/** No picture has more bytes. */
const MOST_BYTES = 60_000;
/** Where the browser finds the clouds. */
const FOLDER = join(root, 'target', 'paper');

/**
 * Takes all pictures into a folder. Answers them in groups, each a list of `{ file, title }`; `undefined` if there is no
 * browser.
 */
export async function takePictures(estimator, { plan, scans, folder, tell }) {
  const executablePath = findBrowser();
  if (!executablePath) return undefined;
  tell('pictures');
  mkdirSync(FOLDER, { recursive: true });
  // Not before the set-up: these are npm packages.
  const [{ chromium }, esbuild] = await Promise.all([import('playwright-core'), import('esbuild')]);
  await esbuild.build({
    entryPoints: [join(root, 'benches', 'paper', 'view.mjs')],
    outfile: join(FOLDER, 'view.js'),
    bundle: true,
    format: 'esm',
    alias: { 'bilinormal/three': join(root, 'dist', 'three.js') },
    logLevel: 'warning',
  });
  copyFileSync(join(root, 'benches', 'paper', 'view.html'), join(FOLDER, 'index.html'));
  const server = await serve(FOLDER);
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', '--disable-background-networking'] });
  try {
    const page = await browser.newPage({ reducedMotion: 'reduce' });
    await page.goto(server.url);
    await page.addScriptTag({ url: 'view.js', type: 'module' });
    await page.waitForFunction(() => 'showCloud' in window);
    return await takeAll({ estimator, page, folder }, plan, scans);
  } finally {
    await browser.close();
    await server.close();
    rmSync(FOLDER, { recursive: true, force: true });
  }
}

async function takeAll(camera, plan, scans) {
  const groups = { spheres: [], surface: [], detail: [], scans: [] };
  for (const points of plan.spheres) {
    await show(camera, sphere(points), '1.0 L', { size: [240, 240], pointSize: 1.4 });
    groups.spheres.push(await take(camera, `sphere-${points}`, `${points / 1e6} M`));
  }

  const { positions } = freeForm(plan.freeForm);
  const whole = { size: [640, 420], closer: 1.6, at: [0.54, 0.74] };
  // Where ridge, groove and ripples meet.
  const detail = { size: [640, 420], closer: 3, at: [0.485, 0.58] };
  const normals = { title: 'their normals, turned upwards: x, y, z as red, green, blue', shading: 'normals' };
  for (const [group, variant, view] of [
    ['surface', '0.4 L', whole],
    ['surface', '0.4 L', { ...whole, ...normals }],
    ['surface', 'knn', whole],
    ['detail', '0.4 L', detail],
    ['detail', '1.0 L', detail],
    ['detail', 'knn', detail],
  ]) {
    await show(camera, positions, variant, view);
    const title = view.title ?? (variant === 'knn' ? 'ENN' : variant);
    groups[group].push(await take(camera, `${group}-${groups[group].length + 1}`, title));
  }

  for (const { name, title, positions, origin, view } of scans.filter(({ title }) => title)) {
    await show(camera, positions, '0.4 L', { size: [480, 360], origin, ...view });
    groups.scans.push(await take(camera, name, title));
  }
  return groups;
}

/**
 * Puts a cloud with its normals before the camera: `turn`ed by degrees to the right and down, then so many times
 * `closer` to a place `at` the picture (shares of its sides).
 */
async function show({ estimator, page }, positions, variant, view) {
  const { size, shading = 'shaded', pointSize = 1, origin = [0, 0, 0], up, turn, closer, at = [0.5, 0.5] } = view;
  const { normals } = await estimator.estimateNormals(positions, VARIANTS[variant]);
  if (shading === 'normals') turnUpwards(normals);
  writeFileSync(join(FOLDER, 'positions'), positions);
  writeFileSync(join(FOLDER, 'normals'), normals);
  const [width, height] = size;
  await page.setViewportSize({ width, height });
  await page.evaluate((cloud) => window.showCloud(cloud), {
    positions: 'positions',
    normals: 'normals',
    origin,
    up,
    shading,
    pointSize,
  });
  const place = [at[0] * width, at[1] * height];
  await page.mouse.move(...place);
  if (turn) {
    await page.mouse.down();
    // A drag over the height of the view is a full turn.
    await page.mouse.move(...place.map((start, axis) => start + (turn[axis] / 360) * height), { steps: 4 });
    await page.mouse.up();
    await page.mouse.move(...place);
  }
  // What OrbitControls makes of a wheel.
  if (closer) await page.mouse.wheel(0, (100 * Math.log(closer)) / Math.log(0.95));
  // A view in motion is drawn in part.
  if (turn || closer) await page.waitForTimeout(1500);
  // Till a large cloud is whole, what was drawn in motion is shown.
  await page.locator('canvas[aria-busy=false]').waitFor();
}

function turnUpwards(normals) {
  for (let at = 0; at < normals.length; at += 3) {
    if (normals[at + 2] < 0) for (let axis = 0; axis < 3; axis++) normals[at + axis] *= -1;
  }
}

/** Saves what is seen, in the best quality that is small enough. */
async function take({ page, folder }, name, title) {
  for (const quality of [85, 75, 65, 50, 35]) {
    const bytes = await page.screenshot({ type: 'jpeg', quality });
    if (bytes.length > MOST_BYTES && quality > 35) continue;
    writeFileSync(join(folder, `${name}.jpg`), bytes);
    return { file: `${name}.jpg`, title };
  }
}
