// The package itself: what is in it, how large it is, what importing it does, and its types.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, readFileSync, readdirSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { installPacked, root } from './packed.mjs';

const { project, home, load } = installPacked();
const manifest = JSON.parse(readFileSync(join(home, 'package.json'), 'utf8'));

const node = (code) =>
  spawnSync(process.execPath, ['--input-type=module', '-e', code], { cwd: project, encoding: 'utf8' });

test('every export is there, and nothing that only the build needs', () => {
  const paths = [
    manifest.types,
    ...Object.values(manifest.bin),
    ...JSON.stringify([manifest.exports, manifest.typesVersions]).match(/\.\/[^"*]*\.\w+/g),
  ];
  for (const path of paths.filter((path) => path.includes('dist'))) {
    assert.ok(existsSync(join(home, path)), path);
  }
  // For TypeScript that does not read `exports`: the same types under the same names.
  const older = Object.entries(manifest.typesVersions['*']).map(([name, [types]]) => [`./${name}`, types]);
  const typed = Object.entries(manifest.exports).filter(([name, { types }]) => name !== '.' && types);
  assert.deepEqual(
    older,
    typed.map(([name, { types }]) => [name, types]),
  );
  assert.deepEqual(Object.keys(manifest.dependencies ?? {}), []);
  const files = readdirSync(home, { recursive: true }).filter((path) => statSync(join(home, path)).isFile());
  for (const file of files) {
    assert.match(file, /^(package\.json|README\.md|CHANGELOG\.md|LICENSE-\w+|dist[/\\].*\.(js|d\.ts|wasm))$/);
    assert.doesNotMatch(file, /\.ts$(?<!\.d\.ts)|\.map$|\.gitignore$/);
  }
  assert.match(readFileSync(join(home, 'dist', 'cli.js'), 'utf8'), /^#!\/usr\/bin\/env node\n/);
});

test('wasm files can be addressed by name', () => {
  const { stdout } =
    node(`const names = ['single.wasm', 'single-full.wasm', 'threads.wasm', 'threads-full.wasm', 'worker'];
    console.log(...names.map((name) => import.meta.resolve('bilinormal/' + name)));`);
  assert.match(
    stdout,
    /single\/core\.wasm .*single\/full\.wasm .*threads\/core\.wasm .*threads\/full\.wasm .*worker-node\.js/,
  );
});

test('addresses of scripts and modules stand there as plain strings, which every bundler sees', () => {
  const found = ['index', 'worker'].flatMap((name) => {
    const script = readFileSync(join(home, 'dist', `${name}.js`), 'utf8');
    return [...script.matchAll(/(?:new URL|import)\((.)\.\/[\w/]+\.(\w+)/g)].map(([, quote, kind]) => quote + kind);
  });
  assert.deepEqual(found.sort(), ['"js', '"js', '"js', '"js', '"wasm', '"wasm', '"wasm', '"wasm']);
});

test('a thread has its glue by a static import, because Parcel finds it in no other way', () => {
  for (const name of ['thread', 'thread-node']) {
    assert.match(readFileSync(join(home, 'dist', `${name}.js`), 'utf8'), /\bfrom"\.\/threads\/bilinormal\.js"/);
  }
});

test('the glue imports nothing: WebKit runs the script of a worker once more if anything imports it', () => {
  for (const build of ['single', 'threads']) {
    assert.doesNotMatch(
      readFileSync(join(home, 'dist', build, 'bilinormal.js'), 'utf8'),
      /\b(import|from)\b *["'`{(*]/,
    );
  }
});

test('importing does nothing, and a process that is done ends without a word', () => {
  const idle = node(`
    import * as everything from 'bilinormal';
    if (process.getActiveResourcesInfo().some((name) => /Worker|MessagePort/.test(name))) console.log('not idle');
    console.log(Object.keys(everything).sort().join());`);
  assert.equal(idle.stderr, '');
  assert.equal(idle.stdout.trim(), 'BilinormalError,createEstimator,estimateNormals,features,readPointCloud,writePly');
  const done = node(`
    import { createEstimator, estimateNormals } from 'bilinormal';
    await createEstimator({ threads: 2 });
    console.log((await estimateNormals(new Float32Array(9))).normals.length);`);
  assert.equal(done.stderr, '');
  assert.equal(done.stdout, '9\n');
  assert.equal(done.status, 0);
});

test('the entry for browsers can be imported where there is no browser', async () => {
  const { stderr, stdout } = node(`
    const { features } = await import(${JSON.stringify(`file://${home}/dist/index.js`)});
    console.log(typeof features);`);
  assert.equal(stderr, '');
  assert.equal(stdout, 'function\n');
});

test('a worker from another origin starts by a Blob that imports it, whose address goes when it has answered', async () => {
  const started = [];
  const revoked = [];
  class Worker extends EventTarget {
    constructor(script) {
      super();
      started.push(script);
    }
  }
  const { createObjectURL, revokeObjectURL } = URL;
  Object.assign(globalThis, { self: globalThis, origin: 'https://page.org', Worker });
  URL.revokeObjectURL = (url) => revoked.push(url);
  let blob;
  URL.createObjectURL = (made) => {
    blob = made;
    return 'blob:it';
  };
  const { starter } = await import(pathToFileURL(join(home, 'dist', 'link.js')).href);
  const start = (url, type) => {
    let made;
    starter(() => (made = new self.Worker(new URL(url), { type })))(
      () => {},
      () => {},
    );
    return made;
  };
  const address = `https://cdn.org/it's "here"/worker.js?a="'`;
  const escaped = `https://cdn.org/it's%20%22here%22/worker.js?a=%22%27`;
  for (const [type, code] of [
    ['module', `import "${escaped}"`],
    [undefined, `importScripts("${escaped}")`],
  ]) {
    const worker = start(address, type);
    assert.equal(started.pop(), 'blob:it');
    assert.equal(await blob.text(), code);
    assert.deepEqual(revoked, []);
    worker.dispatchEvent(new Event('message'));
    assert.deepEqual(revoked.splice(0), ['blob:it']);
  }
  start('https://page.org/worker.js', 'module');
  assert.equal(`${started.pop()}`, 'https://page.org/worker.js');
  assert.equal(globalThis.Worker, Worker, 'as it was');
  Object.assign(URL, { createObjectURL, revokeObjectURL });
});

test('the point material is lit, and its properties can be changed', async (context) => {
  const three = join(root, 'node_modules', 'three');
  if (!existsSync(three)) return context.skip('three is not installed');
  const { symlinkSync } = await import('node:fs');
  symlinkSync(three, join(project, 'node_modules', 'three'), 'junction');
  const { createPointMaterial } = await load('bilinormal/three');
  const material = createPointMaterial({ shading: 'normals', size: 0.5, pixels: 3, color: '#ff0000' });
  assert.ok(material.isShaderMaterial);
  assert.deepEqual([material.shading, material.size, material.pixels, material.round], ['normals', 0.5, 3, true]);
  material.shading = 'plain';
  material.color = '#00ff00';
  assert.equal(material.shading, 'plain');
  assert.equal(material.color.getHexString(), '00ff00');
  assert.deepEqual([material.backColor, material.colorSpace], [null, 'srgb']);
  material.colorSpace = 'srgb-linear';
  material.backColor = '#0000ff';
  assert.throws(() => (material.shading = 'sparkling'), /sparkling; wanted one of shaded, normals, colors, plain/);
  const copy = material.clone();
  assert.deepEqual([copy.shading, copy.size, copy.pixels, copy.color.getHexString()], ['plain', 0.5, 3, '00ff00']);
  assert.deepEqual([copy.backColor.getHexString(), copy.colorSpace], ['0000ff', 'srgb-linear']);
  material.backColor = null;
  assert.deepEqual([material.backColor, copy.backColor.getHexString()], [null, '0000ff']);
  const renderer = {
    getRenderTarget: () => null,
    getDrawingBufferSize: (size) => size.set(800, 600),
    getPixelRatio: () => 2,
  };
  material.onBeforeRender(renderer);
  assert.equal(material.uniforms.viewportHeight.value, 600);
  assert.equal(material.uniforms.pixelRatio.value, 2);
});

test('the types accept what the documentation shows, and refuse what is wrong', () => {
  const settings = {
    compilerOptions: {
      strict: true,
      exactOptionalPropertyTypes: true,
      module: 'nodenext',
      target: 'es2022',
      noEmit: true,
      skipLibCheck: false,
      types: [],
      lib: ['es2022', 'dom', 'dom.iterable'],
    },
    files: ['types.ts'],
  };
  copyFileSync(join(root, 'tests', 'node', 'types.ts'), join(project, 'types.ts'));
  writeFileSync(join(project, 'tsconfig.json'), JSON.stringify(settings));
  const tsc = join(root, 'node_modules', 'typescript', 'bin', 'tsc');
  try {
    execFileSync(process.execPath, [tsc, '--project', project], { encoding: 'utf8' });
  } catch (error) {
    assert.fail(error.stdout);
  }
});
