// What the tests of the page share: a browser, the page served with and without isolation, scans made in the test.

import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { chromium } from 'playwright-core';
import { root } from '../../scripts/run.mjs';
import { pageHeaders, serve } from '../../scripts/serve.mjs';
import { findBrowser } from '../../scripts/setup.mjs';

/** For people to look at; not in git. */
export const ARTEFACTS = join(root, 'tests', 'artefacts');
const QUIET = [
  '--no-sandbox',
  '--disable-dev-shm-usage',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--disable-quic',
  '--no-first-run',
];

/**
 * A browser, and the page served in three ways: `isolated`; `plain`, without any header and from a sub-folder, as any
 * file server may; `guarded`, isolated and with the page's own policy as a header.
 */
export async function openBrowser() {
  mkdirSync(ARTEFACTS, { recursive: true });
  const dist = join(root, 'www', 'dist');
  const isolated = await serve(dist);
  const plain = await serve(join(root, 'www'), { headers: {} });
  const guarded = await serve(dist, { headers: pageHeaders(dist) });
  const browser = await chromium.launch({ executablePath: findBrowser(), args: QUIET });
  const surprises = [];
  return {
    isolated: isolated.url,
    plain: `${plain.url}dist/`,
    guarded: guarded.url,
    async openPage(address, options = {}) {
      const page = await browser.newPage({ viewport: { width: 1280, height: 800 }, colorScheme: 'dark', ...options });
      page.on('pageerror', (error) => surprises.push(`page error: ${error.message}`));
      page.on('console', (message) => {
        if (message.type() === 'error') surprises.push(`console: ${message.text()}`);
      });
      page.on('request', (request) => {
        if (!/^(data|blob):/.test(request.url()) && new URL(request.url()).origin !== new URL(address).origin) {
          surprises.push(`request to ${request.url()}`);
        }
      });
      if (options.script) await page.addInitScript(options.script);
      await page.goto(address);
      await page.locator('[data-do=choose]:enabled, #notice:not([hidden])').first().waitFor({ state: 'attached' });
      return page;
    },
    /** Errors on a page and requests to other hosts since the last call. */
    surprises: () => surprises.splice(0),
    async close() {
      await browser.close();
      await Promise.all([isolated, plain, guarded].map((server) => server.close()));
    },
  };
}

/**
 * A binary PLY of spheres, evenly covered in a random order, one point after the other on each in turn; `colored` adds
 * red, green, blue. `centres` are in radii.
 */
export function spherePly(points, { colored = false, centres = [[0, 0, 0]], radius = 1 } = {}) {
  const colors = colored ? 'property uchar red\nproperty uchar green\nproperty uchar blue\n' : '';
  const header = Buffer.from(
    `ply\nformat binary_little_endian 1.0\nelement vertex ${points}\n` +
      `property float x\nproperty float y\nproperty float z\n${colors}end_header\n`,
  );
  const stride = colored ? 15 : 12;
  const file = Buffer.alloc(header.length + points * stride);
  header.copy(file);
  let state = 1;
  const random = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 2 ** 32;
  for (let i = 0, at = header.length; i < points; i++, at += stride) {
    const z = 2 * random() - 1;
    const turn = 2 * Math.PI * random();
    const ring = Math.sqrt(1 - z * z);
    const centre = centres[i % centres.length];
    file.writeFloatLE(radius * (centre[0] + ring * Math.cos(turn)), at);
    file.writeFloatLE(radius * (centre[1] + ring * Math.sin(turn)), at + 4);
    file.writeFloatLE(radius * (centre[2] + z), at + 8);
    if (colored) file.set([255 * (i % 2), 96, 160], at + 12);
  }
  return file;
}

/** Drops a file onto the middle of the window, after empty ones that are named `before`, before its likes `after`. */
export async function drop(page, name, bytes, { before = [], after = [] } = {}) {
  const transfer = await page.evaluateHandle(
    ([names, text, before]) => {
      const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
      const transfer = new DataTransfer();
      for (const name of before) transfer.items.add(new File([], name));
      for (const name of names) transfer.items.add(new File([bytes], name));
      return transfer;
    },
    [[name, ...after], Buffer.from(bytes).toString('base64'), before],
  );
  await page.dispatchEvent('body', 'drop', { dataTransfer: transfer });
}

/** Gives a file to the hidden input, as the browser does after a choice; for files too large to drop from a test. */
export function choose(page, name, buffer) {
  return page.locator('#file').setInputFiles({ name, mimeType: 'application/octet-stream', buffer });
}

/** Waits until the normals of the named scan are on the screen, and returns what the status line says. */
export async function result(page, name) {
  await page.waitForFunction(
    (name) => {
      const shown = (selector) => !document.querySelector(selector).hidden;
      const settled = !shown('#job') && shown('#status') && document.querySelector('#facts').childElementCount > 0;
      return shown('#error') || (settled && document.querySelector('#name').textContent === name);
    },
    name,
    { timeout: 120_000 },
  );
  return page.evaluate(() => {
    const text = (selector) => document.querySelector(selector).textContent.trim();
    const facts = [...document.querySelectorAll('#facts li')].map((item) => item.textContent.split(' '));
    const numbers = facts.map(([value, name]) => [name.replace(/[^a-z]/g, ''), Number(value.replaceAll(',', ''))]);
    return {
      headline: text('.headline'),
      error: document.querySelector('#error').hidden ? undefined : text('#error p'),
      fallback: document.querySelector('#fallback').hidden ? undefined : text('#fallback'),
      mode: document.querySelector('#facts').dataset.mode,
      phases: [...document.querySelectorAll('#phases dt')].map((phase) => phase.textContent),
      ...Object.fromEntries(numbers),
    };
  });
}

/** The bytes that "Save as PLY" downloads, and the name it gives them. */
export async function save(page) {
  const [download] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name: 'Save as PLY' }).click(),
  ]);
  return { name: download.suggestedFilename(), bytes: readFileSync(await download.path()) };
}

/** Once nothing is left to draw: the distinct colours, in steps of 8, in a square in the middle of a view, or elsewhere. */
export async function colorsShown(page, area) {
  return (await colorsIn(page, area)).length;
}

/** The share, 0 to 1, of such a square that has the colour which most of it has. */
export async function commonestShown(page, area) {
  const pixels = (await colorsIn(page, area)).map(({ pixels }) => pixels);
  return Math.max(...pixels) / pixels.reduce((sum, some) => sum + some);
}

/** How bright the brightest pixel of such a square is, 0 to 255. */
export async function brightestShown(page, area) {
  return Math.max(...(await colorsIn(page, area)).map(({ green }) => green));
}

/** The share, 0 to 1, of such a square that has the colour of back faces, which is lit. */
export async function backsShown(page, area) {
  const colors = await colorsIn(page, area);
  const sum = (some) => some.reduce((sum, { pixels }) => sum + pixels, 0);
  return sum(colors.filter(({ red, green, blue }) => red > 2 * green && blue > green && red > blue)) / sum(colors);
}

const squareAt = (x, y, side) => ({ x: x - side / 2, y: y - side / 2, width: side, height: side });

/** The area is the middle of a square and its side, or any rectangle as `clip`. */
async function colorsIn(page, { x = 498, y = 400, side = 200, clip = squareAt(x, y, side) } = {}) {
  await page.waitForTimeout(600);
  const shot = await page.screenshot({ clip });
  return page.evaluate(async (text) => {
    const image = new Image();
    image.src = `data:image/png;base64,${text}`;
    await image.decode();
    const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const found = new Map();
    for (let i = 0; i < data.length; i += 4) {
      const [red, green, blue] = [data[i] & 0xf8, data[i + 1] & 0xf8, data[i + 2] & 0xf8];
      const key = (red << 16) | (green << 8) | blue;
      if (!found.has(key)) found.set(key, { red, green, blue, pixels: 0 });
      found.get(key).pixels++;
    }
    return [...found.values()];
  }, shot.toString('base64'));
}
