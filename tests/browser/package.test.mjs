// The packed package in a browser, loaded in each way that docs/embedding.md promises: plain files on the page's own origin,
// a host on another origin, and a bundle; with and without isolation.
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, readdirSync, renameSync, symlinkSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';
import { ISOLATION, serve } from '../../scripts/serve.mjs';
import { read } from '../../scripts/run.mjs';
import { findBrowser } from '../../scripts/setup.mjs';
import { sphere } from '../node/clouds.mjs';
import { installPacked, root } from '../node/packed.mjs';

const { project, home } = installPacked();
const quiet = [
  '--no-sandbox',
  '--disable-dev-shm-usage',
  '--disable-background-networking',
  '--disable-component-update',
];
const anyOrigin = { 'Access-Control-Allow-Origin': '*', 'Cross-Origin-Resource-Policy': 'cross-origin' };
let browser;
const servers = [];

async function open(folder, headers) {
  const server = await serve(folder, { headers });
  servers.push(server);
  return server.url;
}

before(async () => {
  browser = await chromium.launch({ executablePath: findBrowser(), args: quiet });
});
after(async () => {
  await browser.close();
  await Promise.all(servers.map((server) => server.close()));
});

/** Runs the same calls on a page; `script` puts the package into `window.bilinormal`. */
async function use(address) {
  const page = await browser.newPage();
  const errors = [];
  page.on('pageerror', (error) => errors.push(error.message));
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  await page.goto(address);
  await page.waitForFunction(() => window.bilinormal, undefined, { timeout: 10000 });
  const result = await page.evaluate(
    async (points) => {
      const { createEstimator, estimateNormals, features, readPointCloud, writePly } = window.bilinormal;
      const positions = Float32Array.from(points);
      const told = [];
      const onProgress = ({ fraction }) => told.push(fraction);
      const stop = new AbortController();
      const aborted = estimateNormals(positions, {
        signal: stop.signal,
        onProgress: ({ fraction }) => fraction > 0.3 && stop.abort('stop'),
      }).catch((reason) => reason);
      const { normals, report } = await estimateNormals(positions, { onProgress });
      const file = await writePly({ count: points.length / 3, positions, origin: [0, 0, 0] }, { normals });
      const cloud = await readPointCloud(new File([file], 'sphere.ply'));
      const two = await createEstimator({ threads: 2, memoryMaxMiB: 256 });
      const again = await two.estimateNormals(cloud.positions, { transfer: true });
      two.dispose();
      const hash = async ({ buffer }) => [...new Uint8Array(await crypto.subtle.digest('SHA-256', buffer))].join();
      const rising = told[0] === 0 && told.at(-1) === 1 && told.every((fraction, i) => !i || fraction >= told[i - 1]);
      return {
        aborted: await aborted,
        rising,
        report,
        asked: again.report.threads,
        same:
          (await hash(normals)) === (await hash(again.normals)) &&
          (await hash(normals)) === (await hash(cloud.normals)),
        detached: cloud.positions.length === 0,
        hash: await hash(normals),
        features: await features(),
      };
    },
    [...sphere(30000)],
  );
  await page.close();
  assert.deepEqual(errors, []);
  assert.equal(result.aborted, 'stop');
  assert.ok(result.rising && result.same && result.detached, JSON.stringify(result));
  return result;
}

function checkIsolated({ report, features, asked }) {
  assert.deepEqual(features, { threads: true, simd: true, crossOriginIsolated: true });
  assert.equal(asked, 2);
  assert.ok(report.mode === 'threads' || report.fallbackReason === 'there is one processor', report.fallbackReason);
}

function checkPlain({ report, features, asked }) {
  assert.equal(features.threads, false);
  assert.match(features.reason, /not cross-origin isolated/);
  assert.equal(asked, 1);
  assert.equal(report.mode, 'single');
  assert.equal(report.fallbackReason, features.reason);
}

const html = (from) =>
  `<!doctype html><link rel="icon" href="data:," /><script type="module">window.bilinormal = await import(${JSON.stringify(from)});</script>`;
let hash;

test('plain files on the own origin', async () => {
  writeFileSync(join(project, 'index.html'), html('./node_modules/bilinormal/dist/index.js'));
  const isolated = await use(await open(project, ISOLATION));
  checkIsolated(isolated);
  ({ hash } = isolated);
  const plain = await use(await open(project, {}));
  checkPlain(plain);
  assert.equal(plain.hash, hash, 'both builds give the same bits');
});

test('a page whose policy forbids the worker is told so', async () => {
  const page = await browser.newPage();
  await page.goto(await open(project, { 'Content-Security-Policy': "require-trusted-types-for 'script'" }));
  await page.waitForFunction(() => window.bilinormal, undefined, { timeout: 10000 });
  const [code, message] = await page.evaluate(() =>
    window.bilinormal.estimateNormals(new Float32Array(3)).catch(({ code, message }) => [code, message]),
  );
  assert.equal(code, 'unsupported');
  assert.match(message, /the worker did not start: .*TrustedScriptURL/);
  const points = await page.evaluate(async () => {
    window.trustedTypes.createPolicy('default', { createScriptURL: (url) => url });
    return (await window.bilinormal.estimateNormals(new Float32Array(3))).report.points;
  });
  assert.equal(points, 1, 'a default policy lets it pass');
  await page.close();
});

test('the Content-Security-Policy of docs/embedding.md suffices, for scripts of the own origin and of another', async () => {
  const [shown] = /A Content-Security-Policy needs .*? besides/s.exec(read('docs/embedding.md'));
  const [worker, script, connect, blob] = [...shown.matchAll(/`(.*?)`/g)].map(([, directive]) => directive);
  const folder = join(project, 'policy');
  mkdirSync(folder);
  writePage(folder);
  const check = async (from, directives) => {
    writeFileSync(join(folder, 'main.js'), `window.bilinormal = await import(${JSON.stringify(from)});`);
    const policy = ["default-src 'none'", 'img-src data:', ...directives].join('; ');
    const address = await open(project, { ...ISOLATION, 'Content-Security-Policy': policy });
    checkIsolated(await use(`${address}policy/`));
  };
  await check('../node_modules/bilinormal/dist/index.js', [worker, script, connect]);
  const elsewhere = await open(join(home, 'dist'), anyOrigin);
  const all = [worker, script, connect].map((directive) => `${directive} ${elsewhere}`);
  all[0] += blob.replace(/^worker-src/, '');
  await check(`${elsewhere}index.js`, all);
});

test('a script that does not load: the header is named, threads give way to the single build', async () => {
  const address = await open(project, ISOLATION);
  const page = await browser.newPage();
  const ask = async () => {
    await page.goto(address);
    await page.waitForFunction(() => window.bilinormal, undefined, { timeout: 10000 });
    return page.evaluate(async () => {
      try {
        const estimator = await window.bilinormal.createEstimator({ threads: 2 });
        return (await estimator.estimateNormals(new Float32Array(3))).report.fallbackReason;
      } catch ({ code, message }) {
        return `${code}: ${message}`;
      }
    });
  };
  // Playwright sees requests of the page, not those of its workers.
  const thread = join(home, 'dist', 'thread.js');
  renameSync(thread, `${thread}.away`);
  try {
    assert.equal(await ask(), 'threads did not start: they did not load');
  } finally {
    renameSync(`${thread}.away`, thread);
  }
  await page.route(/worker\.js/, async (route) => {
    const response = await route.fetch();
    const { 'cross-origin-embedder-policy': policy, ...headers } = response.headers();
    assert.equal(policy, 'require-corp');
    await route.fulfill({ response, headers });
  });
  assert.match(await ask(), /^unsupported: the worker did not start: .*Cross-Origin-Embedder-Policy$/);
  await page.close();
});

test('files on another origin', async () => {
  const elsewhere = await open(join(home, 'dist'), anyOrigin);
  const folder = join(project, 'page');
  mkdirSync(folder);
  writeFileSync(join(folder, 'index.html'), html(`${elsewhere}index.js`));
  const isolated = await use(await open(folder, ISOLATION));
  checkIsolated(isolated);
  assert.equal(isolated.hash, hash);
  checkPlain(await use(await open(folder, {})));
});

test('a bundle by Vite, with its default settings, on the own origin and on another', async () => {
  const { build } = await import('vite');
  const folder = join(project, 'app');
  mkdirSync(folder);
  writePage(folder);
  writeFileSync(join(folder, 'main.js'), `import * as bilinormal from 'bilinormal'; window.bilinormal = bilinormal;`);
  await build({ root: folder, logLevel: 'error' });
  const scripts = readdirSync(join(folder, 'dist', 'assets')).filter((name) => name.endsWith('.js'));
  for (const kind of ['worker-', 'thread-'])
    assert.ok(
      scripts.some((name) => name.startsWith(kind)),
      `no ${kind}`,
    );
  for (const name of scripts) {
    // WebKit would run that once more, and all that the worker knows would be gone.
    const script = readFileSync(join(folder, 'dist', 'assets', name), 'utf8');
    assert.doesNotMatch(
      script,
      /\b(from|import)\s*\(?["'`]\.\/(worker|thread)-/,
      `${name} imports the script of a worker`,
    );
  }
  const isolated = await use(await open(join(folder, 'dist'), ISOLATION));
  checkIsolated(isolated);
  assert.equal(isolated.hash, hash);
  checkPlain(await use(await open(join(folder, 'dist'), {})));

  // Its page here, all else on another origin.
  const [assets, page] = [join(folder, 'assets'), join(folder, 'page')];
  [assets, page].forEach((made) => mkdirSync(made));
  await build({ root: folder, logLevel: 'error', base: await open(assets, anyOrigin), build: { outDir: assets } });
  renameSync(join(assets, 'index.html'), join(page, 'index.html'));
  const elsewhere = await use(await open(page, ISOLATION));
  checkIsolated(elsewhere);
  assert.equal(elsewhere.hash, hash);
  checkPlain(await use(await open(page, {})));
});

test('the point material shows what it says', async () => {
  const { build } = await import('vite');
  const folder = join(project, 'material');
  mkdirSync(folder);
  linkThree();
  writePage(folder);
  writeFileSync(
    join(folder, 'main.js'),
    `import * as three from 'three';
    import { createPointMaterial } from 'bilinormal/three';
    const renderer = new three.WebGLRenderer();
    renderer.setSize(64, 64);
    const camera = new three.PerspectiveCamera(90, 1, 0.1, 10);
    camera.position.z = 2;
    window.draw = ({ normal, color, vertexColors = false, ...options }) => {
      const geometry = new three.BufferGeometry();
      geometry.setAttribute('position', new three.BufferAttribute(new Float32Array(3), 3));
      if (normal) geometry.setAttribute('normal', new three.BufferAttribute(Float32Array.from(normal), 3));
      if (color) geometry.setAttribute('color', new three.BufferAttribute(Uint8Array.from(color), 4, true));
      const scene = new three.Scene();
      const material = createPointMaterial({ color: '#808080', ...options });
      material.vertexColors = vertexColors;
      scene.add(new three.Points(geometry, material));
      renderer.render(scene, camera);
      const gl = renderer.getContext();
      const pixels = new Uint8Array(4 * 64 * 64);
      gl.readPixels(0, 0, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      const lit = pixels.filter((value, i) => i % 4 < 3).reduce((sum, value) => sum + (value > 0), 0) / 3;
      return { centre: [...pixels.subarray(4 * (32 * 64 + 32), 4 * (32 * 64 + 32) + 3)], lit };
    };`,
  );
  await build({ root: folder, logLevel: 'error' });
  const page = await browser.newPage();
  const errors = [];
  page.on('console', (message) => message.type() === 'error' && errors.push(message.text()));
  await page.goto(await open(join(folder, 'dist'), {}));
  await page.waitForFunction(() => window.draw);
  const draw = (options) => page.evaluate((options) => window.draw(options), { pixels: 20, ...options });
  const near = (found, wanted) =>
    assert.ok(
      found.every((value, i) => Math.abs(value - wanted[i]) <= 2),
      `${found}; wanted ${wanted}`,
    );

  near((await draw({ normal: [0, 0, 1] })).centre, [128, 128, 128]);
  near((await draw({ normal: [0, 0, -1] })).centre, [128, 128, 128]);
  const edge = (await draw({ normal: [1, 0, 0] })).centre[0];
  const unknown = (await draw({})).centre[0];
  assert.ok(edge > 0 && edge < unknown && unknown < 128, `${edge} ${unknown}`);
  near((await draw({ normal: [0, 0, 1], shading: 'normals' })).centre, [128, 128, 255]);
  near((await draw({ normal: [0, -1, 0], shading: 'normals' })).centre, [128, 0, 128]);
  for (const vertexColors of [false, true]) {
    near((await draw({ color: [200, 100, 50, 255], shading: 'colors', vertexColors })).centre, [200, 100, 50]);
  }
  // What PLYLoader makes of 200, 100, 50.
  const linear = { color: [147, 32, 8, 255], shading: 'colors', colorSpace: 'srgb-linear' };
  near((await draw(linear)).centre, [200, 100, 50]);
  near((await draw({ normal: [1, 0, 0], shading: 'plain' })).centre, [128, 128, 128]);

  // Squares cover more than discs; 1 unit at a distance of 2 is a quarter of the height.
  const round = (await draw({ shading: 'plain' })).lit;
  const square = (await draw({ shading: 'plain', round: false })).lit;
  assert.equal(square, 400);
  assert.ok(Math.abs(round / square - Math.PI / 4) < 0.05, `${round}`);
  assert.equal((await draw({ shading: 'plain', round: false, pixels: 1, size: 1 })).lit, 256);
  assert.deepEqual(errors, []);
  await page.close();
});

test('what docs/embedding.md shows for three.js draws a file', async () => {
  const { build } = await import('vite');
  const folder = join(project, 'embedding');
  mkdirSync(folder);
  linkThree();
  const [, shown] = /## three\.js\n+```js\n(.*?)```/s.exec(readFileSync(join(root, 'docs', 'embedding.md'), 'utf8'));
  writePage(folder);
  writeFileSync(
    join(folder, 'main.js'),
    `${shown}
    import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
    import { writePly } from 'bilinormal';
    window.draw = async (points) => {
      const positions = Float32Array.from(points);
      const scene = new Scene();
      scene.add(await loadScan(await writePly({ count: points.length / 3, positions, origin: [0, 0, 0] }, {})));
      const camera = new PerspectiveCamera(90, 1, 0.1, 10);
      camera.position.z = 2;
      const renderer = new WebGLRenderer();
      renderer.setSize(64, 64);
      renderer.render(scene, camera);
      const gl = renderer.getContext();
      const pixels = new Uint8Array(4 * 64 * 64);
      gl.readPixels(0, 0, 64, 64, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return [32, 16].map((x) => pixels[4 * (32 * 64 + x)]);
    };`,
  );
  await build({ root: folder, logLevel: 'error' });
  const page = await browser.newPage();
  await page.goto(await open(join(folder, 'dist'), ISOLATION));
  await page.waitForFunction(() => window.draw);
  const [middle, rim] = await page.evaluate((points) => window.draw(points), [...sphere(5000)]);
  // Lit from the camera: brighter in the middle of a ball than towards its rim.
  assert.ok(rim > 0 && middle > 1.2 * rim, `${middle} ${rim}`);
  await page.close();
});

function linkThree() {
  const link = join(project, 'node_modules', 'three');
  if (!existsSync(link)) symlinkSync(join(root, 'node_modules', 'three'), link, 'junction');
}

/** A page that does what main.js beside it does. */
function writePage(folder) {
  writeFileSync(
    join(folder, 'index.html'),
    '<!doctype html><link rel="icon" href="data:," /><script type="module" src="main.js"></script>',
  );
}
