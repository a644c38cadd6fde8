// The command line of the packed package.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { mkdirSync, readFileSync, readdirSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { gunzipSync, gzipSync } from 'node:zlib';
import { deviation, sphere } from './clouds.mjs';
import { installPacked } from './packed.mjs';
import { parsePly, propertyOf, withoutNormals } from './ply.mjs';

const { project, cli } = installPacked();
const folder = join(project, 'files');
mkdirSync(folder);

function run(args, options = {}) {
  const { status, stdout, stderr } = spawnSync(process.execPath, [cli, ...args], {
    cwd: folder,
    encoding: 'utf8',
    timeout: 60000,
    ...options,
  });
  return { status, stdout, stderr };
}

const header = (count, format = 'binary_little_endian') =>
  `ply\nformat ${format} 1.0\ncomment a sphere\nelement vertex ${count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n`;
const positions = sphere(20000);
const ply = Buffer.concat([Buffer.from(header(20000)), Buffer.from(positions.buffer)]);
writeFileSync(join(folder, 'sphere.ply'), ply);

const written = (name) => parsePly(readFileSync(join(folder, name)));
function normalsOf(parsed) {
  const [x, y, z] = ['nx', 'ny', 'nz'].map((name) => propertyOf(parsed, 'vertex', name).values);
  return Float64Array.from({ length: 3 * x.length }, (_, i) => [x, y, z][i % 3][Math.floor(i / 3)]);
}
const leftovers = () => readdirSync(folder).filter((name) => name.startsWith('.'));

test('a file gains normals, and a report of one screen is printed', () => {
  const { status, stdout, stderr } = run(['sphere.ply', '-o', 'out.ply', '--cell-scale', '1.0']);
  assert.deepEqual({ status, stderr }, { status: 0, stderr: '' });
  assert.match(stdout, /points +20,000\n/);
  assert.ok(stdout.split('\n').length < 24);
  const parsed = written('out.ply');
  assert.equal(parsed.format, 'binary_little_endian');
  assert.deepEqual(withoutNormals(parsed), withoutNormals(parsePly(ply)));
  assert.ok(deviation(positions, normalsOf(parsed)).worst < 3);
  assert.deepEqual(leftovers(), []);
});

test('the other methods, and a report without cubes', () => {
  for (const [method, more, worst] of [
    ['knn', ['--k', '12'], 3],
    ['egg', [], 5],
  ]) {
    const { status, stdout, stderr } = run(['sphere.ply', '-o', 'method.ply', '--method', method, ...more]);
    assert.deepEqual({ status, stderr }, { status: 0, stderr: '' });
    assert.match(stdout, new RegExp(`method +${method}\n`));
    assert.doesNotMatch(stdout, /cube|nodes/);
    assert.ok(deviation(positions, normalsOf(written('method.ply'))).worst < worst);
  }
});

test('--curvature adds a property, and replaces it when there is one', () => {
  const of = (name) => propertyOf(written(name), 'vertex', 'curvature');
  assert.equal(run(['sphere.ply', '-o', 'bent.ply', '--curvature', '--quiet']).status, 0);
  assert.equal(of('bent.ply').type, 'float');
  assert.equal(of('bent.ply').values.length, 20000);
  assert.ok(of('bent.ply').values.every((value) => value > 0 && value < 0.01));
  assert.equal(run(['bent.ply', '-o', 'again.ply', '--curvature', '--quiet', '--method', 'knn']).status, 0);
  const { elements } = written('again.ply');
  assert.deepEqual(
    elements[0].properties.map(({ name }) => name),
    written('bent.ply').elements[0].properties.map(({ name }) => name),
  );
  assert.notDeepEqual(of('again.ply').values, of('bent.ply').values);
});

test('the report tells what each kind of cells has to tell', () => {
  const auto = run(['sphere.ply', '-o', 'told.ply']).stdout;
  assert.match(auto, /^ *noise +[\d.e-]+$/m);
  assert.match(auto, /^ *cube edges +.+: [\d.]+ %/m);
  const fixed = run(['sphere.ply', '-o', 'told.ply', '--cell-scale', '1']).stdout;
  assert.match(fixed, /^ *nodes used +0: 0 /m);
  assert.doesNotMatch(fixed, /noise/);
});

test('--orient chooses the side, and the report tells of surfaces', () => {
  const outwards = (name) => {
    const [x, y, z, nx, ny, nz] = ['x', 'y', 'z', 'nx', 'ny', 'nz'].map(
      (p) => propertyOf(written(name), 'vertex', p).values,
    );
    return x.filter((_, i) => x[i] * nx[i] + y[i] * ny[i] + z[i] * nz[i] > 0).length;
  };
  for (const [how, right, told] of [
    ['consistent', 20000, /^surfaces +20,000 points outwards, 9\d % sure$/m],
    ['outward', 20000, /^surfaces +20,000 points outwards/m],
    ['viewpoint=0,0,0', 0, /^points/m],
  ]) {
    const { status, stdout } = run(['sphere.ply', '-o', 'turned.ply', '--orient', how]);
    assert.equal(status, 0);
    assert.equal(outwards('turned.ply'), right, how);
    assert.match(stdout, told);
  }
  assert.equal(run(['sphere.ply', '-o', 'turned.ply', '--orient', 'up=0,0,-1', '--quiet']).status, 0);
  assert.ok(propertyOf(written('turned.ply'), 'vertex', 'nz').values.every((nz) => nz <= 0));
});

test('--orient scanner takes the place that the file tells, in its own coordinates', () => {
  const away = [691000.5, 5336000.25, 512];
  const body = Float64Array.from(positions, (value, i) => value + away[i % 3]);
  const said = `comment scanner position: ${away.join(' ')}\nelement`;
  const surveyed = header(20000).replaceAll('float', 'double').replace('element', said);
  writeFileSync(join(folder, 'surveyed.ply'), Buffer.concat([Buffer.from(surveyed), Buffer.from(body.buffer)]));
  assert.equal(run(['surveyed.ply', '-o', 'seen.ply', '--orient', 'scanner', '--quiet']).status, 0);
  const normals = normalsOf(written('seen.ply'));
  for (let at = 0; at < normals.length; at += 3) {
    assert.ok(
      positions[at] * normals[at] + positions[at + 1] * normals[at + 1] + positions[at + 2] * normals[at + 2] < 0,
    );
  }
  const { status, stderr } = run(['sphere.ply', '-o', 'unseen.ply', '--orient', 'scanner']);
  assert.equal(status, 1);
  assert.match(stderr, /^bilinormal: sphere\.ply: .*does not say where it stood/);
});

test('--json prints the report as one line, --quiet nothing', () => {
  const { stdout } = run([
    'sphere.ply',
    '--out=json.ply',
    '--json',
    '--threads',
    '1',
    '--cell-size',
    '0.05',
    '--ascii',
  ]);
  assert.match(stdout, /^\{.*\}\n$/);
  const report = JSON.parse(stdout);
  assert.equal(report.points, 20000);
  assert.equal(report.mode, 'single');
  assert.ok(Math.abs(report.cellSize - 0.05) < 1e-6 && report.milliseconds.total > 0);
  assert.equal(written('json.ply').format, 'ascii');
  const quiet = run(['sphere.ply', '-o', 'quiet.ply', '--quiet']);
  assert.deepEqual(quiet, { status: 0, stdout: '', stderr: '' });
});

test('input and output may be the same file; links and permissions stay', () => {
  const path = join(folder, 'same.ply');
  writeFileSync(path, ply, { mode: 0o640 });
  assert.equal(run(['same.ply', '-o', 'same.ply', '--quiet']).status, 0);
  assert.equal(statSync(path).mode & 0o777, 0o640);
  const once = readFileSync(path);
  if (process.platform !== 'win32') {
    symlinkSync('same.ply', join(folder, 'link.ply'));
    assert.equal(run(['link.ply', '-o', 'link.ply', '--quiet']).status, 0);
    // Also through two links, where there is nothing yet.
    mkdirSync(join(folder, 'deep'));
    symlinkSync('deep/second.ply', join(folder, 'first.ply'));
    symlinkSync('new.ply', join(folder, 'deep', 'second.ply'));
    assert.equal(run(['same.ply', '-o', 'first.ply', '--quiet']).status, 0);
    assert.ok(readFileSync(join(folder, 'deep', 'new.ply')).equals(once));
    symlinkSync('circle.ply', join(folder, 'circle.ply'));
    assert.match(
      run(['same.ply', '-o', 'circle.ply']).stderr,
      /^bilinormal: circle\.ply: the link leads in a circle\n$/,
    );
  }
  const longest = `${'n'.repeat(251)}.ply`;
  assert.equal(run(['same.ply', '-o', longest, '--quiet']).status, 0);
  assert.ok(readFileSync(join(folder, longest)).equals(once));
  assert.ok(readFileSync(path).equals(once), 'normals are replaced, not added');
  assert.equal(propertyOf(written('link.ply'), 'vertex', 'nx').values.length, 20000);
});

test('an output that is read-only stays as it is, also behind a link', () => {
  const path = join(folder, 'archive.ply');
  writeFileSync(path, ply, { mode: 0o444 });
  if (process.platform !== 'win32') symlinkSync('archive.ply', join(folder, 'latest.ply'));
  for (const name of process.platform === 'win32' ? ['archive.ply'] : ['archive.ply', 'latest.ply']) {
    const { status, stderr } = run(['sphere.ply', '-o', name]);
    assert.deepEqual(
      { status, stderr },
      { status: 1, stderr: `bilinormal: ${name}: the file is read-only, and stays as it is\n` },
    );
  }
  assert.ok(readFileSync(path).equals(ply));
});

test(
  'a folder that nothing can be written to is told before the work',
  { skip: process.platform === 'win32' || process.getuid() === 0 },
  () => {
    mkdirSync(join(folder, 'closed'), { mode: 0o555 });
    const { status, stderr } = run(['missing.ply', '-o', 'closed/out.ply']);
    assert.deepEqual({ status, stderr }, { status: 1, stderr: 'bilinormal: closed/out.ply: permission denied\n' });
  },
);

test('files packed with gzip are unpacked, also from standard input, and packed if their name says so', () => {
  const packed = gzipSync(ply);
  writeFileSync(join(folder, 'sphere.ply.gz'), packed);
  const quiet = (...args) => [...args, '--quiet'];
  assert.equal(run(quiet('sphere.ply', '-o', 'plain.ply')).status, 0);
  const expected = readFileSync(join(folder, 'plain.ply'));
  assert.equal(run(quiet('sphere.ply.gz', '-o', 'unpacked.ply')).status, 0);
  assert.ok(readFileSync(join(folder, 'unpacked.ply')).equals(expected));
  assert.equal(run(quiet('-', '-o', 'unpacked.ply'), { input: packed }).status, 0);
  assert.ok(readFileSync(join(folder, 'unpacked.ply')).equals(expected));
  assert.equal(run(quiet('sphere.ply.gz', '-o', 'sphere.ply.gz')).status, 0);
  assert.ok(gunzipSync(readFileSync(join(folder, 'sphere.ply.gz'))).equals(expected));

  writeFileSync(join(folder, 'cut.ply.gz'), packed.subarray(0, packed.length / 2));
  const { status, stderr } = run(['cut.ply.gz', '-o', 'never.ply']);
  assert.equal(status, 1);
  assert.match(stderr, /^bilinormal: cut\.ply\.gz: packed with gzip, and damaged: .+\n$/);
  assert.ok(!readdirSync(folder).includes('never.ply'));
});

test('standard input and devices', { skip: process.platform === 'win32' }, () => {
  assert.equal(run(['-', '-o', 'piped.ply', '--quiet'], { input: ply }).status, 0);
  assert.equal(propertyOf(written('piped.ply'), 'vertex', 'nx').values.length, 20000);
  assert.equal(run(['sphere.ply', '-o', '/dev/null', '--quiet']).status, 0);
  assert.ok(statSync('/dev/null').isCharacterDevice());
  // A link to a pipe.
  const command = `"${process.execPath}" "${cli}" sphere.ply -o /dev/stdout --quiet | cat > through.ply`;
  const { status, stderr } = spawnSync('bash', ['-c', command], { cwd: folder, encoding: 'utf8', timeout: 60000 });
  assert.deepEqual({ status, stderr }, { status: 0, stderr: '' });
  assert.equal(propertyOf(written('through.ply'), 'vertex', 'nx').values.length, 20000);
});

test(
  'a reader that leaves early is no failure, and one that cannot take the report is told',
  { skip: process.platform !== 'linux' },
  () => {
    const told = (to) => {
      const command = `"${process.execPath}" "${cli}" sphere.ply -o told.ply ${to}; echo $?`;
      const { stdout, stderr } = spawnSync('bash', ['-c', command], { cwd: folder, encoding: 'utf8', timeout: 60000 });
      return { status: stdout.trim(), stderr };
    };
    assert.deepEqual(told('| true; echo "${PIPESTATUS[0]}" >&2'), { status: '0', stderr: '0\n' });
    const full = told('> /dev/full');
    assert.equal(full.status, '1');
    assert.equal(full.stderr, 'bilinormal: no space left on the device\n');
  },
);

test('--help prints the usage', () => {
  const { status, stdout, stderr } = run(['--help']);
  assert.deepEqual({ status, stderr }, { status: 0, stderr: '' });
  for (const option of ['--method', '--cell-scale', '--orient', '--threads', '--json'])
    assert.ok(stdout.includes(option));
});

test('--version prints that of the package', () => {
  const { version } = JSON.parse(readFileSync(new URL('../../package.json', import.meta.url), 'utf8'));
  const { status, stdout, stderr } = run(['--version']);
  assert.deepEqual({ status, stdout, stderr }, { status: 0, stdout: `${version}\n`, stderr: '' });
});

test('wrong usage ends with 2, one line and a hint', () => {
  const cases = [
    [[], /no input file/],
    [['a.ply'], /no output file/],
    [['a.ply', 'b.ply', '-o', 'c.ply'], /b\.ply/],
    [['a.ply', '-o', 'b.ply', '--magic'], /--magic/],
    [['a.ply', '-o', 'b.ply', '--method', 'magic'], /--method is magic; wanted bilinear, knn, egg/],
    [['a.ply', '-o', 'b.ply', '--method', 'knn', '--k', '2'], /--k is 2; wanted a whole number of at least 3/],
    [['a.ply', '-o', 'b.ply', '--cell-scale', 'big'], /--cell-scale is big; wanted a number/],
    [['a.ply', '-o', 'b.ply', '--cell-scale', '1', '--cell-size', '1'], /exclude/],
    [['a.ply', '-o', 'b.ply', '--cell', 'huge'], /--cell is huge; wanted auto/],
    [['a.ply', '-o', 'b.ply', '--threads', '0'], /--threads is 0; wanted a whole number/],
    [['sphere.ply', '-o', 'b.ply', '--threads', '300'], /threads is 300; wanted/],
    [['sphere.ply', '-o', 'b.ply', '--cell-scale', '1000'], /cell\.scale is 1000; wanted/],
    [['sphere.ply', '-o', 'b.ply', '--orient', 'up=0,0,0'], /orient\.up is 0, 0, 0; wanted/],
    [['a.ply', '-o', 'b.ply', '--orient', 'up=1,2'], /three numbers/],
    [['a.ply', '-o', 'b.ply', '--orient', 'down=1,2,3'], /down/],
    [['a.ply', '-o', 'b.ply', '--orient', 'up=1,2,3=4'], /up=1,2,3=4/],
    [['a.ply', '-o', '-'], /standard output/],
  ];
  for (const [args, message] of cases) {
    const { status, stdout, stderr } = run(args);
    assert.equal(status, 2, args.join(' '));
    assert.equal(stdout, '');
    const [first, hint, ...rest] = stderr.split('\n');
    assert.match(first, /^bilinormal: /);
    assert.match(first, message);
    assert.equal(hint, 'Try bilinormal --help');
    assert.deepEqual(rest, ['']);
  }
});

test('an error ends with 1 and one line that names the file; no output appears', () => {
  writeFileSync(join(folder, 'short.ply'), ply.subarray(0, 1000));
  writeFileSync(join(folder, 'points.xyz'), '0 0 1\n0 1 0\n');
  writeFileSync(join(folder, 'empty.ply'), '');
  const cases = [
    [['missing.ply', '-o', 'never.ply'], /^bilinormal: missing\.ply: no such file or folder\n$/],
    [['.', '-o', 'never.ply'], /^bilinormal: \.: it is a folder\n$/],
    [['short.ply', '-o', 'never.ply'], /^bilinormal: short\.ply: byte \d+: .*\n$/],
    [['points.xyz', '-o', 'never.ply'], /^bilinormal: points\.xyz: .*(ply|PLY).*\n$/],
    [['empty.ply', '-o', 'never.ply'], /^bilinormal: empty\.ply: .+\n$/],
    [['sphere.ply', '-o', 'no/never.ply'], /^bilinormal: no\/never\.ply: no such file or folder\n$/],
    [['sphere.ply', '-o', 'new/'], /^bilinormal: new\/: no such file or folder\n$/],
    [['sphere.ply', '-o', '..'], /^bilinormal: \.\.: it is a folder\n$/],
  ];
  for (const [args, message] of cases) {
    const { status, stdout, stderr } = run(args);
    assert.equal(status, 1, args.join(' '));
    assert.equal(stdout, '');
    assert.match(stderr, message);
  }
  assert.ok(!readdirSync(folder).includes('never.ply'));
  assert.deepEqual(leftovers(), []);
});

test('an interrupted run leaves no half file', { skip: process.platform === 'win32' }, async () => {
  const count = 500000;
  const large = Buffer.concat([Buffer.from(header(count)), Buffer.from(sphere(count).buffer)]);
  writeFileSync(join(folder, 'large.ply'), large);
  // Ctrl+C, and a terminal that is closed.
  for (const sent of ['SIGINT', 'SIGHUP']) {
    const name = `${sent}.ply`;
    const child = spawn(process.execPath, [cli, 'large.ply', '-o', name, '--ascii'], { cwd: folder, stdio: 'ignore' });
    const ended = new Promise((resolve) => child.once('exit', (code, signal) => resolve({ code, signal })));
    let running = true;
    ended.then(() => (running = false));
    // As soon as the temporary file is there, if it is seen at all.
    while (running && !leftovers().length) await new Promise((resolve) => setTimeout(resolve, 1));
    child.kill(sent);
    const { code, signal } = await ended;
    assert.deepEqual(leftovers(), []);
    const complete = readdirSync(folder).includes(name);
    assert.ok(complete ? code === 0 || signal === sent : signal === sent, `code ${code}, signal ${signal}`);
    if (complete) assert.equal(propertyOf(written(name), 'vertex', 'nz').values.length, count);
  }
});
