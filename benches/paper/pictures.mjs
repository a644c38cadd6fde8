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
    const page = await browser.newPage();
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
    await show(camera, sphere(points), '1.0 L', { size: [240, 240] });
    groups.spheres.push(await take(camera, `sphere-${points}`, `${points / 1e6} M`));
  }

  const { positions } = freeForm(plan.freeForm);
  const view = { size: [640, 400], pointSize: 0.8 };
  for (const [variant, file, title] of [
    ['0.4 L', 'ours', '0.4 L'],
    ['1.0 L', 'ours-1', '1.0 L'],
    ['knn', 'enn', 'ENN'],
  ]) {
    await show(camera, positions, variant, view);
    if (variant !== '1.0 L') groups.surface.push(await take(camera, `surface-${file}`, title));
    await zoom(camera, [380, 150], 5);
    groups.detail.push(await take(camera, `detail-${file}`, title));
  }
  await show(camera, positions, '0.4 L', { ...view, shading: 'normals' });
  groups.surface.splice(1, 0, await take(camera, 'surface-normals', 'its normals: x, y, z as red, green, blue'));

  for (const { name, title, positions, origin } of scans.filter(({ title }) => title)) {
    await show(camera, positions, '0.4 L', { size: [480, 360], origin });
    groups.scans.push(await take(camera, name, title));
  }
  return groups;
}

/** Puts a cloud with its normals before the camera. */
async function show({ estimator, page }, positions, variant, view) {
  const { size, shading = 'shaded', pointSize = 1, origin = [0, 0, 0] } = view;
  const { normals } = await estimator.estimateNormals(positions, VARIANTS[variant]);
  writeFileSync(join(FOLDER, 'positions'), positions);
  writeFileSync(join(FOLDER, 'normals'), normals);
  await page.setViewportSize({ width: size[0], height: size[1] });
  await page.evaluate((cloud) => window.showCloud(cloud), {
    positions: 'positions',
    normals: 'normals',
    origin,
    shading,
    pointSize,
  });
}

/** Turns the wheel over a place of the picture, and waits for the view to come to rest. */
async function zoom({ page }, [x, y], turns) {
  await page.mouse.move(x, y);
  for (let turn = 0; turn < turns; turn++) {
    await page.mouse.wheel(0, -240);
    await page.waitForTimeout(50);
  }
  await page.waitForTimeout(1500);
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
