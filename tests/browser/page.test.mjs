// The page in a real browser, from a dropped file to a saved one.

import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { after, afterEach, before, test as nodeTest } from 'node:test';
import { gunzipSync, gzipSync } from 'node:zlib';
import { data } from '../node/data.mjs';
import { parsePly } from '../node/ply.mjs';
import {
  ARTEFACTS,
  backsShown,
  brightestShown,
  choose,
  colorsShown,
  commonestShown,
  drop,
  openBrowser,
  result,
  save,
  spherePly,
} from './browser.mjs';

let browser;
let page;

/** A page that hangs is a failure, not a wait without end; software rendering on a busy machine is slow. */
const test = (name, ...rest) => nodeTest(name, { timeout: 240_000, ...(rest.length > 1 && rest[0]) }, rest.at(-1));

before(async () => {
  browser = await openBrowser();
});
after(() => browser?.close());
afterEach(async () => {
  await page?.close();
  page = undefined;
  assert.deepEqual(browser.surprises(), []);
});

/** Positions, normals and `more` of a PLY that the page has saved from `spherePly`. */
function readSaved(bytes, ...more) {
  const names = ['x', 'y', 'z', 'nx', 'ny', 'nz', ...more];
  const start = bytes.indexOf('end_header\n') + 'end_header\n'.length;
  const header = bytes.toString('latin1', 0, start);
  assert.deepEqual(
    [...header.matchAll(/property (\w+ \w+)/g)].map(([, property]) => property),
    names.map((name) => `float ${name}`),
  );
  const values = new Float32Array(bytes.buffer.slice(bytes.byteOffset + start, bytes.byteOffset + bytes.length));
  assert.equal(values.length, names.length * Number(header.match(/element vertex (\d+)/)[1]));
  return values;
}

/** From now on the page presses a button (`data-do`) as soon as the title of the job begins with `title`. */
function pressWhen(title, action) {
  return page.evaluate(
    ([title, action]) => {
      const job = document.querySelector('#job-title');
      const observer = new MutationObserver(() => {
        if (!job.textContent.startsWith(title)) return;
        observer.disconnect();
        if (action === 'Escape') dispatchEvent(new KeyboardEvent('keydown', { key: 'Escape' }));
        else document.querySelector(`[data-do=${action}]`).click();
      });
      observer.observe(job, { childList: true, characterData: true, subtree: true });
    },
    [title, action],
  );
}

test('a dropped scan gets its normals by threads and is shaded', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(60_000));
  const shown = await result(page, 'ball.ply');
  assert.equal(shown.error, undefined);
  assert.match(shown.headline, /^[\d.]+ m?s for 60,000 points$/);
  assert.equal(shown.mode, 'threads');
  assert.equal(shown.fallback, undefined);
  // Of the smallest cubes, if there is more than one size.
  const edge = shown.to ?? shown.edge;
  assert.ok(shown.cubes > 1_000 && edge > 0 && shown.noise < 0.01 * edge, JSON.stringify(shown));
  assert.equal(shown.without, 0);
  assert.ok(shown.phases.length > 2 && shown.phases.includes('reading the file'), String(shown.phases));

  const shaded = await colorsShown(page, { side: 300 });
  await page.screenshot({ path: join(ARTEFACTS, 'ball-shaded.png') });
  await page.getByRole('radio', { name: 'Plain' }).check();
  const plain = await colorsShown(page, { side: 300 });
  await page.getByRole('radio', { name: 'Normals' }).check();
  const normals = await colorsShown(page, { side: 300 });
  assert.ok(shaded > plain && normals > 2 * shaded, `colours shaded ${shaded}, plain ${plain}, normals ${normals}`);
  assert.ok(await page.getByRole('radio', { name: 'Colours' }).isDisabled(), 'the file has no colours');
});

test('the saved file holds right normals, the same bits with threads and without', async () => {
  const saved = {};
  for (const kind of ['isolated', 'plain']) {
    page = await browser.openPage(browser[kind]);
    await drop(page, 'ball.one.ply', spherePly(60_000));
    const shown = await result(page, 'ball.one.ply');
    assert.equal(shown.mode, kind === 'isolated' ? 'threads' : 'single', shown.fallback);
    if (kind === 'plain') {
      assert.equal(shown.thread, 1);
      assert.match(shown.fallback, /threads, which are not/);
      assert.match(await page.locator('#fallback').getAttribute('title'), /isolat/);
    }
    saved[kind] = await save(page);
    await page.close();
  }
  assert.equal(saved.isolated.name, 'ball.one-normals.ply');
  assert.ok(saved.isolated.bytes.equals(saved.plain.bytes), 'the two builds differ');
  const values = readSaved(saved.isolated.bytes);
  for (let i = 0; i < values.length; i += 6) {
    const [x, y, z, nx, ny, nz] = values.subarray(i, i + 6);
    // The position is the true normal of the unit sphere: within 3 degrees.
    assert.ok(Math.abs(x * nx + y * ny + z * nz) > 0.9986, `point ${i / 6}: ${[x, y, z]} has normal ${[nx, ny, nz]}`);
  }
});

test('a job can be cancelled while it reads and while it computes, and the next one works', async () => {
  page = await browser.openPage(browser.isolated);
  const large = spherePly(1_000_000);
  await pressWhen('Reading', 'cancel');
  await choose(page, 'large.ply', large);
  await page.locator('#start').waitFor();
  assert.ok(await page.locator('#notice').isHidden(), 'to cancel is no error');

  await pressWhen('Computing', 'Escape');
  await choose(page, 'large.ply', large);
  await page.getByText('1,000,000 points, without normals').waitFor();
  await page.locator('#job').waitFor({ state: 'hidden' });
  assert.ok(await page.getByRole('button', { name: 'Save as PLY' }).isDisabled());
  const compute = page.getByRole('button', { name: 'Compute' });
  await compute.press('Enter');
  // Out of use while it runs, but still in focus: a press does not begin anew.
  // Looked at in the page at once: on a busy machine the job may be over before the test hears of it.
  const seen = await page.waitForFunction(() => {
    const [job, button] = [document.querySelector('#job progress'), document.activeElement];
    if (!(job.value > 0)) return false;
    const isDisabled = button.ariaDisabled === 'true';
    button.click();
    return { isDisabled, value: job.value };
  });
  const { isDisabled, value } = await seen.jsonValue();
  assert.ok(isDisabled && value > 0, `disabled: ${isDisabled}, ${value} after a press`);
  assert.match((await result(page, 'large.ply')).headline, /1,000,000 points/);
  assert.equal(await page.evaluate(() => document.activeElement.textContent), 'Re-run');

  await drop(page, 'small.ply', spherePly(5_000));
  assert.match((await result(page, 'small.ply')).headline, /5,000 points/);
});

test('a file dropped while another is worked on takes its place', async () => {
  page = await browser.openPage(browser.isolated);
  await choose(page, 'large.ply', spherePly(1_000_000));
  await drop(page, 'small.ply', spherePly(5_000));
  assert.match((await result(page, 'small.ply')).headline, /5,000 points/);
  await page.waitForTimeout(1000);
  assert.equal(await page.locator('#name').textContent(), 'small.ply');
});

test('what is no scan stops no work', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(200_000));
  await result(page, 'ball.ply');
  // So many that it takes long.
  await page.getByRole('radio', { name: 'k nearest' }).check();
  await page.getByRole('textbox', { name: 'nearest points' }).fill('1000');
  await page.getByRole('button', { name: 'Re-run' }).click();
  await page.locator('#job').waitFor();
  await drop(page, 'notes.txt', Buffer.from('Milk, bread'));
  await page.getByText(/^notes\.txt is not a PLY file, .* The work goes on\.$/).waitFor();
  assert.ok(await page.locator('#job').isVisible());
  assert.equal(await page.locator('#name').textContent(), 'ball.ply');
  // A scan does, also where it begins with a byte order mark and with capitals.
  const marked = Buffer.from(spherePly(5_000).toString('latin1').replace('ply', '\xef\xbb\xbfPLY'), 'latin1');
  await drop(page, 'marked.ply', marked);
  assert.equal((await result(page, 'marked.ply')).error, undefined);
});

test('of several files the first scan is taken, and folders are refused', async () => {
  page = await browser.openPage(browser.isolated);
  // Those before it are empty, whatever their names: nothing to be told of.
  await drop(page, 'ball.PLY', spherePly(5_000), { before: ['photo.jpg', 'empty.ply'] });
  assert.equal((await result(page, 'ball.PLY')).error, undefined);
  assert.ok(await page.locator('#note').isHidden());
  await drop(page, 'first.ply', spherePly(5_000), { before: ['notes.txt'], after: ['second.ply', 'third.ply'] });
  assert.equal((await result(page, 'first.ply')).error, undefined);
  const note = page.locator('#note').getByText('The first of 3 scans is shown.');
  assert.ok(await note.isVisible());
  assert.equal(await page.locator('#told').textContent(), 'The first of 3 scans is shown.');
  await page.getByRole('button', { name: 'Dismiss the note' }).click();
  assert.ok(await note.isHidden());
  // Without a scan among them, what is there stays.
  await drop(page, 'notes.txt', Buffer.alloc(0), { after: ['photo.jpg'] });
  await page.getByRole('alert').filter({ hasText: 'notes.txt' }).waitFor();
  assert.match((await result(page, 'first.ply')).error, /^notes\.txt is empty/);
  // As a browser tells a folder, which cannot be made in a test.
  await page.evaluate(() => (DataTransferItem.prototype.webkitGetAsEntry = () => ({ isDirectory: true })));
  await drop(page, 'scans', Buffer.alloc(0));
  assert.match((await result(page, 'first.ply')).error, /^Folders are not taken/);
});

test('a file that is too large for one buffer says so, and one that is no scan says that', async () => {
  page = await browser.openPage(browser.isolated);
  for (const [name, begin, message] of [
    [
      'city.ply',
      'ply\nformat ascii 1.0\n',
      'city.ply: the file has 2.25 GiB, and text or a mesh can be opened up to 2; ',
    ],
    ['city.las', 'LASF', 'city.las is a LAS or LAZ file. Only PLY'],
  ]) {
    // One without its bytes: nothing may ask for more than the first of them.
    await page.evaluate(
      ([name, begin]) => {
        const file = Object.defineProperty(new File([begin], name), 'size', { value: 2.25 * 2 ** 30 });
        const input = document.querySelector('#file');
        Object.defineProperty(input, 'files', { value: [file], configurable: true });
        input.dispatchEvent(new Event('change'));
      },
      [name, begin],
    );
    await page.locator('#notice').filter({ hasText: message }).waitFor();
  }
});

test('while a file hangs over the window, nothing shines through what asks for it', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  // They stay in sight while the panel is scrolled.
  const covered = ['[data-do=save]', '#name'].map((selector) => page.locator(selector));
  const clips = await Promise.all(covered.map((part) => part.boundingBox()));
  for (const clip of clips) assert.ok((await brightestShown(page, { clip })) > 160);
  await page.keyboard.press('?');
  await page.getByRole('dialog').waitFor();
  await page.evaluate(() => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([], 'next.ply'));
    document.body.dispatchEvent(new DragEvent('dragover', { dataTransfer, bubbles: true, cancelable: true }));
  });
  await page.getByText('Drop the scan to see it shaded').waitFor();
  assert.ok(await page.getByRole('dialog').isHidden(), 'the help gives way');
  for (const clip of clips) assert.ok((await brightestShown(page, { clip })) < 80);
});

test('a bad file gives a message that can be read, and the cloud before stays', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'photo.ply', Buffer.from('GIF89a, not a scan'));
  const alert = page.getByRole('alert').filter({ hasText: 'photo.ply' });
  await alert.waitFor();
  assert.match(await alert.textContent(), /^photo\.ply is not a PLY file, .* CloudCompare/);
  assert.ok(await page.locator('#start').isVisible());
  // What to do depends on what it is, not on the words of the reader.
  for (const [name, bytes, remedy] of [
    ['flight.las', 'LASF\0\0\0\0', /is a LAS or LAZ file\. .*CloudCompare .* save scans as PLY\.$/],
    ['ball.ply.gz', '\x1f\x8b\x08', /is packed with gzip, and cannot be unpacked here\. Unpack it, /],
    ['flight.las.gz', gzipSync('LASF'), /is a LAS or LAZ file\. /],
    ['bunny.tar.gz', gzipSync(`bunny/`.padEnd(257, '\0') + 'ustar'), /is a tar archive\. Unpack it, /],
    ['castle.spz', '\x1f\x8b\x08', /holds Gaussian splats\. .*SuperSplat.* saves splats as PLY\.$/],
    ['utf16.ply', '\xff\xfep\0l\0y\0', /is text in UTF-16\. Save it as ASCII or UTF-8\.$/],
    ['nothing.ply', '', /is empty\.$/],
  ]) {
    await drop(page, name, Buffer.from(bytes, 'latin1'));
    await page.getByRole('alert').filter({ hasText: name }).waitFor();
    assert.match(await page.locator('#notice').textContent(), remedy);
  }

  await drop(page, 'ball.ply', spherePly(5_000));
  const before = await result(page, 'ball.ply');
  assert.equal(before.error, undefined, 'a new file clears the message');
  await drop(page, 'short.ply', spherePly(5_000).subarray(0, 30_000));
  await page.getByRole('alert').filter({ hasText: 'short.ply' }).waitFor();
  const { error, ...after } = await result(page, 'ball.ply');
  assert.match(error, /^short\.ply: ./);
  assert.deepEqual({ ...after, error: undefined }, before);
  // It is read out once, and not whenever anything else changes.
  const changes = await page.evaluate(() => {
    let changes = 0;
    const observer = new MutationObserver((found) => (changes += found.length));
    observer.observe(document.querySelector('#error'), { childList: true, characterData: true, subtree: true });
    const size = document.querySelector('#point-size');
    for (const value of [1, 2]) {
      size.value = value;
      size.dispatchEvent(new Event('input', { bubbles: true }));
    }
    return new Promise((resolve) => setTimeout(() => resolve(changes)));
  });
  assert.equal(changes, 0);
  await page.getByRole('button', { name: 'Dismiss the message' }).click();
  assert.ok(await page.locator('#error').isHidden());
});

test('a scan packed with gzip is unpacked, also among others, and one that is cut off leaves what is shown', async () => {
  page = await browser.openPage(browser.isolated);
  const packed = gzipSync(spherePly(5_000));
  await drop(page, 'ball.ply.gz', packed, { before: ['photo.jpg'] });
  const before = await result(page, 'ball.ply');
  assert.equal(before.error, undefined);
  assert.match(before.headline, / for 5,000 points$/);
  const { name, bytes } = await save(page);
  assert.equal(name, 'ball-normals.ply');
  assert.equal(readSaved(bytes).length, 6 * 5_000);

  await drop(page, 'cut.ply.gz', packed.subarray(0, packed.length / 2));
  const { error, ...after } = await result(page, 'cut.ply');
  assert.match(error, /^cut\.ply\.gz is packed with gzip, and cannot be unpacked here\. /);
  assert.deepEqual({ ...after, error: undefined }, before);
});

test('a file of one point ends too, without a normal', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'one.ply', spherePly(1));
  const { headline, error, without, cube } = await result(page, 'one.ply');
  assert.deepEqual({ error, without, cube }, { error: undefined, without: 1, cube: 1 });
  assert.match(headline, /for 1 point: no normal was found$/);
});

test('points that are not finite and a stray one neither blank the view nor shrink the rest', async () => {
  page = await browser.openPage(browser.isolated);
  const file = spherePly(20_000);
  const first = file.indexOf('end_header\n') + 'end_header\n'.length;
  file.writeFloatLE(NaN, first);
  file.writeFloatLE(Infinity, first + 16);
  file.writeFloatLE(1e6, first + 24);
  await drop(page, 'stray.ply', file);
  const shown = await result(page, 'stray.ply');
  assert.equal(shown.error, undefined);
  assert.ok(shown.without >= 2, `${shown.without} without a normal`);
  assert.match(await page.locator('#facts').innerText(), /99\.9% in the largest/);
  await page.getByRole('radio', { name: 'Normals' }).check();
  const colors = await colorsShown(page, { side: 300 });
  await page.screenshot({ path: join(ARTEFACTS, 'stray-normals.png') });
  assert.ok(colors > 100, `${colors} colours`);
});

test('a keyboard alone opens a file', async () => {
  page = await browser.openPage(browser.isolated);
  // Asked for early, because the browser takes a while to hand choosers over.
  const chosen = page.waitForEvent('filechooser');
  await page.keyboard.press('Tab');
  assert.equal(await page.evaluate(() => document.activeElement.textContent.trim()), 'Choose a PLY file');
  await page.keyboard.press('Enter');
  const chooser = await chosen;
  await chooser.setFiles({ name: 'ball.ply', mimeType: '', buffer: spherePly(5_000) });
  await result(page, 'ball.ply');
});

test('another cell, after a number that cannot be one', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(60_000));
  const auto = await result(page, 'ball.ply');
  await page.getByRole('radio', { name: '× L' }).check();
  const field = page.getByRole('textbox', { name: 'multiples of L' });
  const again = page.getByRole('button', { name: 'Re-run' });
  await field.fill('-1');
  assert.equal(await field.getAttribute('aria-invalid'), 'true');
  assert.match(await page.locator('#problem').textContent(), /0\.1 to 100/);
  assert.ok(await again.isDisabled());
  await field.fill('1,000');
  assert.match(await page.locator('#problem').textContent(), /two ways/);
  await field.fill('3');
  await again.click();
  await page.waitForFunction(
    (cubes) => !document.querySelector('#facts').textContent.includes(cubes),
    auto.cubes.toLocaleString('en'),
  );
  const coarse = await result(page, 'ball.ply');
  assert.ok(coarse.cubes < auto.cubes / 2, `${coarse.cubes} cubes after ${auto.cubes}`);

  await page.getByRole('radio', { name: 'Edge' }).check();
  await page.getByRole('textbox', { name: 'unit of the file' }).fill('0,05');
  await page.keyboard.press('Enter');
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('0.05 edge'));
});

test('another method, after a k that cannot be one', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  await page.getByRole('radio', { name: 'k nearest' }).check();
  assert.ok(await page.locator('#cell').isHidden());
  const field = page.getByRole('textbox', { name: 'nearest points' });
  const again = page.getByRole('button', { name: 'Re-run' });
  assert.equal(await field.inputValue(), '16');
  for (const text of ['2', '7.5', '', '1e15']) {
    await field.fill(text);
    assert.match(await page.locator('#problem').textContent(), /from 3 to 1,000,000/);
    assert.ok(await again.isDisabled(), text);
  }
  await field.fill('30');
  await again.click();
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('k = 30'));
  const { phases, without } = await result(page, 'ball.ply');
  assert.ok(phases.includes('search tree') && phases.includes('normals'), String(phases));
  assert.equal(without, 0);
  await page.screenshot({ path: join(ARTEFACTS, 'method.png') });

  // Back to cubes: what the report of the other method knows nothing of begins anew.
  await page.getByRole('radio', { name: 'Bilinear' }).check();
  await page.getByRole('radio', { name: '× L' }).check();
  assert.equal(await page.getByRole('textbox', { name: 'multiples of L' }).inputValue(), '1');
  await again.click();
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('cubes'));

  // In a low window it comes into sight.
  await page.setViewportSize({ width: 1280, height: 420 });
  await page.getByRole('textbox', { name: 'multiples of L' }).fill('none');
  const [problem, save] = await Promise.all(['#problem', '.save'].map((part) => page.locator(part).boundingBox()));
  assert.ok(problem.y + problem.height <= save.y, JSON.stringify({ problem, save }));
});

test('curvature is computed to be shown, for the normals that are there, and saved with them', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  const { cubes } = await result(page, 'ball.ply');
  const choice = page.getByRole('radio', { name: 'Curvature' });
  assert.ok(await choice.isEnabled());
  // What is chosen but not yet computed is not for the curvature either.
  await page.getByRole('radio', { name: '× L' }).check();
  await page.getByRole('textbox', { name: 'multiples of L' }).fill('5');
  await page.getByRole('radio', { name: 'Plain' }).check();
  const plain = await colorsShown(page, { side: 300 });
  await pressWhen('Computing normals and curvature', 'cancel');
  await choice.click();
  const shaded = page.getByRole('radio', { name: 'Shaded' });
  await page.waitForFunction(() => document.querySelector('input[value=shaded]').checked);
  assert.deepEqual(readSaved((await save(page)).bytes).length, 6 * 20_000, 'cancelled');
  await choice.check();
  assert.equal((await result(page, 'ball.ply')).cubes, cubes);
  const bent = await colorsShown(page, { side: 300 });
  assert.ok(bent > plain + 10, `colours ${bent}, plain ${plain}`);
  const saved = readSaved((await save(page)).bytes, 'curvature');
  for (let i = 6; i < saved.length; i += 7) assert.ok(saved[i] > 1e-6 && saved[i] < 0.01, `${saved[i]}`);

  // Computed again as long as it is shown, and no longer.
  const again = page.getByRole('button', { name: 'Re-run' });
  await again.click();
  await page.waitForFunction(
    (cubes) => !document.querySelector('#facts').textContent.includes(cubes),
    cubes.toLocaleString('en'),
  );
  await result(page, 'ball.ply');
  const coarse = readSaved((await save(page)).bytes, 'curvature');
  assert.ok(coarse[6] > 2 * saved[6], 'of larger cubes');
  await shaded.check();
  const open = await again.evaluate((button) => {
    button.click();
    return !document.querySelector('input[value=curvature]').disabled;
  });
  assert.ok(!open, 'what is computed without curvature has none to show');
  await result(page, 'ball.ply');
  assert.equal(readSaved((await save(page)).bytes).length, 6 * 20_000);
});

const upAxis = () => page.getByRole('combobox', { name: 'Up' });
const orientation = (name) => page.getByRole('group', { name: 'Orientation' }).getByRole('radio', { name });

/** Computes again with an orientation; the points and normals that are saved then, and what the status line says. */
async function oriented(name, file = 'ball.ply') {
  await orientation(name).check();
  await page.getByRole('button', { name: 'Re-run' }).click();
  assert.equal((await result(page, file)).error, undefined);
  return { facts: await page.locator('#facts').innerText(), saved: readSaved((await save(page)).bytes) };
}

/** The share of the points of a saved sphere whose normals go along what `side` says, given position and normal. */
function shareOf(saved, side) {
  let along = 0;
  for (let i = 0; i < saved.length; i += 6) along += side(saved.subarray(i, i + 3), saved.subarray(i + 3, i + 6)) > 0;
  return along / (saved.length / 6);
}

test('normals are saved with the signs of the orientation that was chosen', async () => {
  page = await browser.openPage(browser.isolated);
  const centre = [10, -4, 3];
  const outwards = (position, normal) => normal.reduce((sum, n, axis) => sum + n * (position[axis] - centre[axis]), 0);
  await drop(page, 'ball.ply', spherePly(20_000, { centres: [centre] }));
  await result(page, 'ball.ply');
  assert.ok(await orientation('Consistent').isChecked());
  assert.equal(shareOf(readSaved((await save(page)).bytes), outwards), 1);

  const asFound = await oriented('As found');
  const found = shareOf(asFound.saved, outwards);
  assert.ok(found > 0.4 && found < 0.6, `${found} outwards as found`);
  assert.doesNotMatch(asFound.facts, /surface|wards/);

  for (const name of ['Consistent', 'Outward']) {
    const { facts, saved } = await oriented(name);
    assert.equal(shareOf(saved, outwards), 1, name);
    assert.match(facts, /1 surface\s+100% in the largest\s+outwards confidence (1\.00|0\.[89]\d)/);
  }
  // Across the axis the sign is free, and a normal of the sphere is off by a degree at the most.
  await page.getByRole('checkbox', { name: 'Back faces' }).check();
  const rising = (axis, sign) => (_, normal) => sign * normal[axis] + 0.001;
  for (const [up, axis, sign] of [
    ['X', 0, 1],
    ['−X', 0, -1],
    ['Y', 1, 1],
    ['−Y', 1, -1],
    ['−Z', 2, -1],
    ['Z', 2, 1],
  ]) {
    await upAxis().selectOption({ label: up });
    const { facts, saved } = await oriented('Upwards');
    assert.equal(shareOf(saved, rising(axis, sign)), 1, up);
    assert.match(facts, new RegExp(`upwards\\s+along ${up}`));
    // The top of the ball is shown at the top.
    assert.ok((await backsShown(page, { y: 250, side: 100 })) < 0.01, up);
    assert.doesNotMatch(facts, /surface/);
  }
  await upAxis().selectOption('y');
  assert.match(await page.locator('#facts').innerText(), /along Z/, 'as it was computed');
});

test('towards the camera no back faces show, wherever it is, and after a flip there is nothing else', async () => {
  // A turn ends at once: the camera must stand still when it is asked where it is.
  page = await browser.openPage(browser.isolated, { reducedMotion: 'reduce' });
  // So that a camera in the coordinates of the view, which has its middle in the ball, would be on the other side.
  await drop(page, 'ball.ply', spherePly(20_000, { centres: [[-10, 4, -3]] }));
  await result(page, 'ball.ply');
  await upAxis().selectOption('z');
  await page.mouse.move(400, 400);
  await page.mouse.down();
  await page.mouse.move(640, 250, { steps: 3 });
  await page.mouse.up();
  await colorsShown(page);
  await page.getByRole('checkbox', { name: 'Back faces' }).check();
  const square = { side: 300 };
  await oriented('As found');
  const found = await backsShown(page, square);
  assert.ok(found > 0.1, `${found} of the view as found`);
  const { facts } = await oriented('Camera');
  assert.match(facts, /towards the camera/);
  assert.equal(await backsShown(page, square), 0);
  const flip = page.getByRole('button', { name: 'Flip all' });
  await flip.click();
  assert.match(await page.locator('#facts').innerText(), /away from the camera/);
  const flipped = await backsShown(page, square);
  assert.ok(flipped > 0.95, `${flipped} of the view after a flip`);

  // The key does what the box does; without it both sides look the same.
  await page.keyboard.press('b');
  assert.ok(!(await page.getByRole('checkbox', { name: 'Back faces' }).isChecked()));
  assert.equal(await backsShown(page, square), 0);
});

test('plus enlarges the cloud, minus makes it smaller, F fits it, B shows back faces', async () => {
  page = await browser.openPage(browser.isolated);
  await page.keyboard.press('b');
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  const backs = page.getByRole('checkbox', { name: 'Back faces' });
  assert.ok(!(await backs.isChecked()), 'before there was a scan');
  await page.keyboard.press('Shift+B');
  assert.ok(await backs.isChecked());
  // A ball that has only back faces is told from the background by their colour.
  await page.getByRole('button', { name: 'Flip all' }).click();
  const share = () => backsShown(page, { side: 780 });
  const before = await share();
  await page.locator('#canvas').focus();
  await page.keyboard.press('-');
  const smaller = await share();
  for (let presses = 1; presses <= 2; presses++) await page.keyboard.press('+');
  const larger = await share();
  assert.ok(smaller < 0.9 * before && larger > 1.1 * before, `${smaller}, ${before}, ${larger} of the view`);
  await page.keyboard.press('Shift+F');
  assert.equal(await share(), before);
});

test('a question mark opens the help, and Escape or a click closes it and nothing else', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  const help = page.getByRole('dialog', { name: 'How to move' });
  await page.getByRole('button', { name: 'Flip one' }).click();
  for (const open of [() => page.keyboard.press('?'), () => page.getByRole('button', { name: 'Help' }).click()]) {
    for (const close of [() => page.keyboard.press('Escape'), () => page.mouse.click(20, 20)]) {
      await open();
      assert.ok(await help.isVisible());
      assert.ok(await help.evaluate(({ scrollWidth, clientWidth }) => scrollWidth <= clientWidth), 'all of it');
      await close();
      await help.waitFor({ state: 'hidden' });
    }
  }
  assert.ok(await page.locator('#hint').isVisible());
  // In a low window it begins at its beginning.
  await page.setViewportSize({ width: 720, height: 300 });
  await page.keyboard.press('?');
  assert.ok((await page.getByRole('heading', { name: 'How to move' }).boundingBox()).y > 0);
});

test('the view follows the window until it is moved', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  await page.getByRole('button', { name: 'Flip all' }).click();
  await page.setViewportSize({ width: 390, height: 844 });
  const ball = () => backsShown(page, { clip: { x: 0, y: 0, width: 390, height: 844 } });
  const side = () => backsShown(page, { clip: { x: 0, y: 0, width: 4, height: 844 } });
  const before = await ball();
  assert.ok(before > 0.1 && (await side()) === 0, 'the whole ball fits again');
  await page.locator('#canvas').focus();
  for (let presses = 1; presses <= 5; presses++) await page.keyboard.press('+');
  const larger = await ball();
  assert.ok(larger > 1.5 * before);
  // Also what still coasts.
  await page.mouse.move(100, 400);
  await page.mouse.down();
  await page.mouse.move(300, 420, { steps: 3 });
  await page.mouse.up();
  await page.keyboard.press('f');
  await page.setViewportSize({ width: 300, height: 844 });
  assert.equal(await side(), 0, 'the whole ball fits once more');
  await page.setViewportSize({ width: 390, height: 844 });
  for (let presses = 1; presses <= 5; presses++) await page.keyboard.press('+');
  const moved = await ball();
  await page.setViewportSize({ width: 400, height: 844 });
  assert.ok(Math.abs((await ball()) / moved - 1) < 0.15, 'as it was moved');
});

test('settings that were not computed with are told from those that were', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  const note = page.getByText('computed with other settings');
  assert.ok(await note.isHidden());
  await page.getByRole('radio', { name: 'k nearest' }).check();
  assert.ok(await note.isVisible());
  await page.getByRole('radio', { name: 'Bilinear' }).check();
  assert.ok(await note.isHidden());
  await page.getByRole('radio', { name: 'Upwards' }).check();
  assert.ok(await note.isVisible());
  await page.getByRole('button', { name: 'Re-run' }).click();
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('upwards'));
  assert.ok(await note.isHidden());
  // The axis now decides; the shading does not.
  await page.getByRole('radio', { name: 'Normals' }).check();
  assert.ok(await note.isHidden());
  await upAxis().selectOption('z');
  assert.ok(await note.isVisible());
});

test('the focus of the keyboard goes where the work goes', async () => {
  page = await browser.openPage(browser.isolated);
  const focused = () => page.evaluate(() => document.activeElement.dataset.do ?? document.activeElement.id);
  await page.getByRole('button', { name: 'Try the sample' }).press('Enter');
  await page.getByRole('button', { name: 'Cancel' }).waitFor();
  assert.equal(await focused(), 'cancel');
  await result(page, 'sample.ply');
  assert.equal(await focused(), 'canvas');
  await drop(page, 'bad.ply', Buffer.from('ply\nformat'));
  await page.getByRole('button', { name: 'Dismiss the message' }).press('Enter');
  assert.equal(await focused(), 'canvas');
  assert.ok(await page.locator('#error').isHidden());
});

test('normals that the file had are compared with the computed ones, and shown in their place', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  const facts = () => page.locator('#facts').innerText();
  assert.doesNotMatch(await facts(), /the file's/);
  const fromFile = page.getByRole('radio', { name: 'From the file' });
  assert.ok(await fromFile.isHidden());
  // All along Z, the first without one: off those of a sphere by one radian in the mean, and half of them opposite.
  const { bytes } = await save(page);
  const start = bytes.indexOf('end_header\n') + 'end_header\n'.length;
  for (let at = start; at < bytes.length; at += 24) {
    [0, 0, at > start ? 2 : NaN].forEach((value, axis) => bytes.writeFloatLE(value, at + 12 + 4 * axis));
  }
  await drop(page, 'ball-normals.ply', bytes);
  await result(page, 'ball-normals.ply');
  assert.match(await facts(), /57(\.\d)?° from the file's normals\s+(49|50|51)(\.\d)?% of these opposite/);

  await page.getByRole('radio', { name: 'Normals', exact: true }).check();
  const computed = await colorsShown(page);
  await fromFile.check();
  assert.ok((await colorsShown(page)) < computed / 10);
  assert.ok(await page.getByRole('button', { name: 'Save computed normals' }).isVisible());
  // What is flipped and saved is what was computed, and it is shown again.
  await page.getByRole('button', { name: 'Flip all' }).click();
  assert.ok(await page.getByRole('radio', { name: 'Computed' }).isChecked());
  assert.ok((await colorsShown(page)) > computed / 2);
  assert.equal((await save(page)).name, 'ball-normals.ply');
});

test('a file without a finite point is refused', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  await drop(page, 'nan.ply', spherePly(50, { radius: NaN }));
  await page.locator('#error').waitFor();
  assert.match(await page.locator('#error p').textContent(), /nan\.ply: no point .* finite/);
  assert.equal(await page.locator('#name').textContent(), 'ball.ply');
  await page.keyboard.press('Escape');
  assert.ok(await page.locator('#error').isHidden());
});

test('what is told of a cloud covers no part of it, whatever its shape', async () => {
  const ball = [[0, 0, 0]];
  const tower = [-8, -6, -4, -2, 0, 2, 4, 6, 8].map((y) => [0, y, 0]);
  const plain = [-4, 0, 4].flatMap((x) => [-4, 0, 4].map((z) => [x, 0, z]));
  for (const [width, height] of [
    [1280, 800],
    [900, 900],
    [720, 900],
    [360, 740],
    [844, 390],
  ]) {
    for (const centres of [ball, tower, plain]) {
      page = await browser.openPage(browser.isolated, { viewport: { width, height } });
      await drop(page, 'balls.ply', spherePly(20_000, { centres }));
      await result(page, 'balls.ply');
      await page.evaluate(() => document.querySelector('[data-do=flip]').click());
      const boxes = ['#status', '#panel'];
      const areas = await Promise.all(boxes.map((box) => page.locator(box).boundingBox()));
      await page.evaluate(
        (boxes) => boxes.forEach((box) => (document.querySelector(box).style.visibility = 'hidden')),
        boxes,
      );
      assert.ok((await backsShown(page, { clip: { x: 0, y: 0, width, height } })) > 0.005);
      for (const [i, clip] of areas.entries())
        assert.equal(await backsShown(page, { clip }), 0, `${boxes[i]}: ${centres} in ${width} x ${height}`);
      await page.close();
    }
  }
});

test('points are as large as the gaps between them, however far the cloud reaches', async () => {
  page = await browser.openPage(browser.isolated);
  const centres = [
    [-20, 0, 0],
    [20, 0, 0],
  ];
  await drop(page, 'balls.ply', spherePly(20_000, { centres }));
  await result(page, 'balls.ply');
  await page.getByRole('button', { name: 'Flip all' }).click();
  const area = () => backsShown(page, { side: 780 });
  const shown = await area();
  // Both balls are so small that points of the least size close them, too.
  await page.getByRole('slider', { name: 'Point size' }).fill('-2');
  const least = await area();
  assert.ok(shown < 1.4 * least, `${shown} of the view after ${least}`);
});

test('a cloud in any unit is lit, moved and picked alike', async () => {
  page = await browser.openPage(browser.isolated);
  for (const radius of [1e-19, 1e-3, 1e19]) {
    await drop(page, `${radius}.ply`, spherePly(60_000, { radius, centres: [[-10, 4, -3]] }));
    await result(page, `${radius}.ply`);
    const square = { side: 300 };
    await page.getByRole('checkbox', { name: 'Back faces' }).check();
    // A few of the far side are seen through the near one.
    assert.ok((await backsShown(page, square)) < 0.05, `${radius}`);
    const still = await page.screenshot();
    await page.locator('#canvas').focus();
    await page.keyboard.press('ArrowLeft');
    await colorsShown(page);
    assert.ok(!still.equals(await page.screenshot()), `moved at ${radius}`);
    await page.getByRole('button', { name: 'Flip one' }).click();
    await page.locator('#canvas').press('Enter');
    assert.match(await page.locator('#facts').innerText(), /\b1 flipped by hand/, `${radius}`);
    assert.ok((await backsShown(page, square)) > 0.9, `${radius}`);
  }
});

test('where the file says that the scanner stood is offered as a viewpoint', async () => {
  page = await browser.openPage(browser.isolated);
  const ball = spherePly(20_000);
  await drop(page, 'ball.ply', ball);
  await result(page, 'ball.ply');
  assert.ok(await orientation('Scanner').isHidden());
  // From the middle of the ball all normals point inwards. Another comment names a size, and no place.
  for (const [place, expected] of [
    ['0, 0, 0', 1],
    ['3 0 -1e30', 0.5],
  ]) {
    const comments = `comment camera position 640 480 1 1\ncomment Scanner position: ${place}\n`;
    const file = Buffer.from(ball.toString('latin1').replace('element', `${comments}element`), 'latin1');
    await drop(page, 'said.ply', file);
    assert.equal((await result(page, 'said.ply')).error, undefined);
    await orientation('Scanner').check();
    await page.getByRole('button', { name: 'Re-run' }).click();
    const { error } = await result(page, 'said.ply');
    assert.equal(error, undefined);
    assert.match(await page.locator('#facts').innerText(), /towards the scanner/);
    const saved = readSaved((await save(page)).bytes);
    const inwards = shareOf(
      saved,
      (point, normal) => -point[0] * normal[0] - point[1] * normal[1] - point[2] * normal[2],
    );
    assert.ok(Math.abs(inwards - expected) < 0.02, `${inwards} from ${place}`);
  }
  // A scan without one is not asked for it, and where the camera was is not where it is for the next scan.
  for (const name of ['ball.ply', 'next.ply']) {
    await drop(page, name, ball);
    await result(page, name);
    assert.ok(await orientation('Consistent').isChecked());
    await orientation('Camera').check();
  }
});

test('a flip turns what is saved, again undoes it, and curvature keeps it', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  const flip = page.getByRole('button', { name: 'Flip all' });
  const { saved: before } = await oriented('Outward');
  await flip.click();
  assert.equal(await flip.getAttribute('aria-pressed'), 'true');
  assert.match(await page.locator('#facts').innerText(), /inwards/);
  assert.equal(await page.locator('#told').textContent(), 'All flipped');
  const turned = before.map((value, i) => (i % 6 < 3 ? value : 0 - value));
  assert.deepEqual(readSaved((await save(page)).bytes), turned);
  assert.ok((await backsShown(page)) > 0.9, 'a flip can be seen');

  // Shown with the signs that are on the screen, though it is all computed again.
  await page.getByRole('radio', { name: 'Curvature' }).check();
  await result(page, 'ball.ply');
  const bent = readSaved((await save(page)).bytes, 'curvature').filter((_, i) => i % 7 < 6);
  assert.deepEqual(bent, turned);
  await page.getByRole('radio', { name: 'Shaded' }).check();

  await flip.click();
  assert.equal(await flip.getAttribute('aria-pressed'), 'false');
  assert.deepEqual(
    readSaved((await save(page)).bytes, 'curvature').filter((_, i) => i % 7 < 6),
    before,
  );

  // The key takes back what the button has done, and no more.
  const backs = page.getByRole('checkbox', { name: 'Back faces' });
  await backs.uncheck();
  await flip.click();
  assert.ok(await backs.isChecked());
  for (let presses = 1; presses <= 4; presses++) await page.keyboard.press('Control+z');
  assert.equal(await flip.getAttribute('aria-pressed'), 'false');
  assert.ok(!(await backs.isChecked()), 'the flip had switched it on');

  // What is computed anew is as its orientation promises.
  await flip.click();
  const { saved: anew } = await oriented('Outward');
  assert.deepEqual(anew, before);
  assert.equal(await flip.getAttribute('aria-pressed'), 'false');
});

test('flips that a new result or another file takes away can be brought back', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(
    page,
    'balls.ply',
    spherePly(20_000, {
      centres: [
        [-1.5, 0, 0],
        [1.5, 0, 0],
      ],
    }),
  );
  await result(page, 'balls.ply');
  const flip = page.getByRole('button', { name: 'Flip all' });
  const note = page.locator('#note');
  const isFlipped = async () => (await flip.getAttribute('aria-pressed')) === 'true';
  await flip.click();
  const turned = readSaved((await save(page)).bytes);

  await oriented('As found', 'balls.ply');
  assert.ok(!(await isFlipped()));
  assert.match(await note.innerText(), /^Re-run undid your flips\./);
  // Computed again as it was, signs and all; and what has the focus keeps it.
  await flip.focus();
  await page.keyboard.press('Control+z');
  await page.waitForFunction(() => document.querySelector('[data-do=flip]').ariaPressed === 'true');
  await result(page, 'balls.ply');
  assert.ok(await note.isHidden());
  assert.ok(await orientation('Consistent').isChecked());
  assert.equal(await page.evaluate(() => document.activeElement.dataset.do), 'flip');
  assert.deepEqual(readSaved((await save(page)).bytes), turned);

  // What is saved is not lost.
  await drop(page, 'other.ply', spherePly(5_000));
  await result(page, 'other.ply');
  assert.ok(await note.isHidden());
  await flip.click();
  await drop(page, 'balls.ply', spherePly(5_000));
  await result(page, 'balls.ply');
  assert.match(await note.innerText(), /^Your flips of other\.ply were not saved\./);
  assert.ok(!(await isFlipped()));
  await note.getByRole('button', { name: 'Bring back' }).click();
  await result(page, 'other.ply');
  assert.ok(await isFlipped());
  assert.ok(await note.isHidden());
  // And can be undone as before.
  await page.keyboard.press('Control+z');
  assert.ok(!(await isFlipped()));
  await drop(page, 'balls.ply', spherePly(5_000));
  await result(page, 'balls.ply');
  assert.ok(await note.isHidden());
});

test('what is brought back stands as it was turned, and tells what it faces', async () => {
  page = await browser.openPage(browser.isolated);
  const rod = spherePly(20_000, { centres: [-4, -3, -2, -1, 0, 1, 2, 3, 4].map((y) => [0, y, 0]) });
  const said = 'comment scanner position: 0 0 30\nelement';
  await drop(page, 'rod.ply', Buffer.from(rod.toString('latin1').replace('element', said), 'latin1'));
  await result(page, 'rod.ply');
  assert.equal(await upAxis().inputValue(), 'y');
  const isUpright = async () => (await brightestShown(page, { x: 688, y: 80, side: 60 })) > 100;
  assert.ok(await isUpright());
  await upAxis().selectOption('x');
  assert.ok(!(await isUpright()));
  await oriented('Scanner', 'rod.ply');
  await page.getByRole('button', { name: 'Flip all' }).click();
  const told = /away from the scanner/;
  assert.match(await page.locator('#facts').innerText(), told);
  await drop(page, 'other.ply', spherePly(5_000));
  await result(page, 'other.ply');
  await page.locator('#note').getByRole('button', { name: 'Bring back' }).click();
  await result(page, 'rod.ply');
  assert.match(await page.locator('#facts').innerText(), told);
  assert.equal(await upAxis().inputValue(), 'x');
  assert.ok(!(await isUpright()));
});

test('the cloud stays in sight while the window changes its size', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  await page.evaluate(() => {
    const { style } = document.querySelector('#canvas');
    const change = (frame) => {
      style.width = `${innerWidth - (frame % 40)}px`;
      if (frame < 600) requestAnimationFrame(() => change(frame + 1));
    };
    change(0);
  });
  for (let shot = 0; shot < 3; shot++) assert.ok((await brightestShown(page)) > 100, `picture ${shot}`);
});

test('one surface is turned by a click, or by Enter in the middle of the view', async () => {
  page = await browser.openPage(browser.isolated);
  const left = [-1.5, 0, 0];
  await drop(page, 'balls.ply', spherePly(40_000, { centres: [left, [1.5, 0, 0]] }));
  await result(page, 'balls.ply');
  const turn = page.getByRole('button', { name: 'Flip one' });
  await oriented('As found', 'balls.ply');
  assert.ok(await turn.isDisabled());
  const { saved: before, facts } = await oriented('Outward', 'balls.ply');
  assert.match(facts, /\b2 surfaces/);
  await turn.click();
  assert.equal(await turn.getAttribute('aria-pressed'), 'true');
  const hint = page.getByText('Click or tap a surface to flip it');
  assert.ok(await hint.isVisible());
  assert.equal(await page.evaluate(() => document.activeElement.id), 'canvas', 'which hears Enter');

  // A double click centres the view on a point of the left one, and turns nothing; a click there does.
  const canvas = page.locator('#canvas');
  const { width, height } = await canvas.boundingBox();
  const panel = await page.locator('#panel').evaluate(({ offsetWidth }) => offsetWidth);
  // What is wide is shown above the status line.
  const middle = { x: (width - panel) / 2, y: (await page.locator('#status').boundingBox()).y / 2 };
  const position = { x: middle.x - 0.2 * height, y: middle.y };
  await canvas.dblclick({ position });
  assert.doesNotMatch(await page.locator('#facts').innerText(), /by hand/);
  // Later, or it is a third click; and where the view is centred now.
  await page.waitForTimeout(600);
  await canvas.click({ position: middle });
  assert.equal(await page.locator('#told').textContent(), '1 surface flipped by hand');
  const turned = before.map((value, i) => (i % 12 < 3 || i % 12 > 5 ? value : 0 - value));
  assert.deepEqual(readSaved((await save(page)).bytes), turned);
  assert.match(await page.locator('#facts').innerText(), /\b1 flipped by hand/);

  // What is computed again for its curvature keeps that.
  await page.getByRole('radio', { name: 'Curvature' }).check();
  await result(page, 'balls.ply');
  const bent = readSaved((await save(page)).bytes, 'curvature').filter((_, i) => i % 7 < 6);
  assert.deepEqual(bent, turned);

  await canvas.focus();
  await page.keyboard.press('Meta+z');
  const undone = readSaved((await save(page)).bytes, 'curvature').filter((_, i) => i % 7 < 6);
  assert.deepEqual(undone, before);

  // A drag moves the camera, and Escape ends it all.
  await canvas.dragTo(canvas, { sourcePosition: position, targetPosition: { x: position.x + 40, y: position.y } });
  await page.keyboard.press('Escape');
  assert.equal(await turn.getAttribute('aria-pressed'), 'false');
  assert.ok(await hint.isHidden());
  await canvas.click({ position });
  assert.doesNotMatch(await page.locator('#facts').innerText(), /by hand/);
});

test('the sides of the plinth of the sample face outwards', async () => {
  page = await browser.openPage(`${browser.isolated}?sample`);
  await result(page, 'sample.ply');
  await orientation('Outward').check();
  await page.getByRole('button', { name: 'Re-run' }).click();
  assert.equal((await result(page, 'sample.ply')).error, undefined);
  await page.keyboard.press('b');
  const backs = await backsShown(page, { y: 300, side: 100 });
  assert.ok(backs < 0.02, `${backs} of the outside of the shell`);
  await page.screenshot({ path: join(ARTEFACTS, 'sample-backs.png') });
  const { properties } = parsePly((await save(page)).bytes).elements[0];
  const [x, y, z, nx, nz] = ['x', 'y', 'z', 'nx', 'nz'].map((wanted) => properties.find(({ name }) => name === wanted));
  let [all, outwards] = [0, 0];
  for (let i = 0; i < x.values.length; i++) {
    if (y.values[i] < 0.016 || y.values[i] > 0.04 || Math.hypot(x.values[i], z.values[i]) < 0.12) continue;
    all++;
    outwards += x.values[i] * nx.values[i] + z.values[i] * nz.values[i] > 0;
  }
  assert.ok(all > 20_000 && outwards > 0.999 * all, `${outwards} of ${all}`);
});

test('the baselines without threads', async () => {
  page = await browser.openPage(browser.plain, { viewport: { width: 390, height: 844 } });
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  await page.locator('#panel > summary').click();
  await page.getByRole('radio', { name: 'EGG' }).check();
  await page.screenshot({ path: join(ARTEFACTS, 'narrow-method.png') });
  await page.getByRole('button', { name: 'Re-run' }).click();
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('k = 8'));
  assert.equal((await result(page, 'ball.ply')).mode, 'single');
});

test('the sample loads by its address, with colours, and can be turned', async () => {
  page = await browser.openPage(`${browser.isolated}?sample`);
  const shown = await result(page, 'sample.ply');
  assert.match(shown.headline, /500,000 points/);
  const front = await colorsShown(page);
  await page.screenshot({ path: join(ARTEFACTS, 'sample-shaded.png') });
  await page.getByRole('radio', { name: 'Normals' }).check();
  assert.ok((await colorsShown(page)) > 2 * front);
  await page.screenshot({ path: join(ARTEFACTS, 'sample-normals.png') });
  await page.getByRole('radio', { name: 'Curvature' }).check();
  await result(page, 'sample.ply');
  assert.ok((await colorsShown(page)) > 20);
  const cut = () => [...document.querySelectorAll('.segments')].filter((row) => row.scrollWidth > row.clientWidth);
  assert.equal(await page.evaluate(`(${cut})().length`), 0, 'choices that are cut off');
  await page.screenshot({ path: join(ARTEFACTS, 'sample-curvature.png') });
  await page.getByRole('radio', { name: 'Colours' }).check();
  await colorsShown(page);
  await page.screenshot({ path: join(ARTEFACTS, 'sample-colours.png') });
  await page.mouse.move(400, 400);
  const still = await page.screenshot();
  await page.mouse.down();
  await page.mouse.move(600, 300, { steps: 3 });
  await page.mouse.up();
  await colorsShown(page);
  assert.ok(!still.equals(await page.screenshot()), 'a drag turns the cloud');
});

test('nothing can be sent to another host, by the page or by its workers', async () => {
  const received = [];
  const elsewhere = createServer((request, response) => {
    received.push(request.url);
    response.writeHead(200, { 'Access-Control-Allow-Origin': '*' }).end();
  });
  await new Promise((ready) => elsewhere.listen(0, '127.0.0.1', ready));
  const address = `http://127.0.0.1:${elsewhere.address().port}/`;
  // The page brings its policy along; a worker has one only where the server sends it.
  page = await browser.openPage(browser.guarded);
  await drop(page, 'ball.ply', spherePly(5_000));
  assert.equal((await result(page, 'ball.ply')).error, undefined);
  const send = (address) =>
    fetch(address).then(
      () => 'sent',
      () => 'refused',
    );
  assert.equal(await page.evaluate(send, address), 'refused');
  // The threads of the pool wait inside wasm and run nothing else.
  const workers = page.workers().filter((worker) => !worker.url().includes('thread'));
  assert.ok(workers.length > 0);
  for (const worker of workers) assert.equal(await worker.evaluate(send, address), 'refused');
  const image = await page.evaluate((address) => {
    const image = new Image();
    return new Promise((settle) => {
      image.onload = image.onerror = ({ type }) => settle(type);
      image.src = `${address}image.png`;
    });
  }, address);
  assert.equal(image, 'error');
  elsewhere.close();
  assert.deepEqual(received, []);

  // The meta element alone, as on a server that sends no policy.
  page = await browser.openPage(browser.isolated);
  assert.equal(await page.evaluate(send, address), 'refused');
  assert.ok(browser.surprises().every((text) => text.includes('Content Security Policy') || text.includes(address)));
});

test('a narrow screen shows everything without scrolling sideways', async () => {
  page = await browser.openPage(browser.isolated, { viewport: { width: 360, height: 640 }, hasTouch: true });
  const inside = () =>
    page.evaluate(() => {
      const boxes = [...document.querySelectorAll('button, input, label, p, summary, li')].filter((e) =>
        e.checkVisibility(),
      );
      const out = boxes.filter(
        (element) => element.getBoundingClientRect().right > innerWidth || element.getBoundingClientRect().left < 0,
      );
      return { width: document.documentElement.scrollWidth, out: out.map((element) => element.outerHTML.slice(0, 80)) };
    });
  assert.deepEqual(await inside(), { width: 360, out: [] });
  await page.screenshot({ path: join(ARTEFACTS, 'narrow-start.png') });
  await page.getByRole('button', { name: 'Try the sample' }).tap();
  await result(page, 'sample.ply');
  await colorsShown(page, { x: 180, y: 300 });
  await page.screenshot({ path: join(ARTEFACTS, 'narrow-sample.png') });
  await page.locator('#panel > summary').tap();
  await page.getByRole('button', { name: 'Save as PLY' }).waitFor();
  assert.deepEqual(await inside(), { width: 360, out: [] });
  await page.screenshot({ path: join(ARTEFACTS, 'narrow-panel.png') });
});

test('on a phone what was cancelled can be computed without the panel', async () => {
  const viewport = { width: 390, height: 844 };
  page = await browser.openPage(browser.isolated, { viewport, hasTouch: true, isMobile: true });
  await pressWhen('Computing', 'cancel');
  await choose(page, 'large.ply', spherePly(1_000_000));
  await page.getByText('1,000,000 points, without normals').waitFor();
  const compute = page.getByRole('button', { name: 'Compute' });
  await compute.tap();
  assert.match((await result(page, 'large.ply')).headline, /for 1,000,000 points/);
  assert.ok(await compute.isHidden());
});

test('on a phone the cloud is seen below the open panel, and fingers meet what they press', async () => {
  for (const [width, height] of [
    [390, 844],
    [844, 390],
  ]) {
    page = await browser.openPage(browser.isolated, { viewport: { width, height }, hasTouch: true, isMobile: true });
    await drop(page, 'ball.ply', spherePly(20_000));
    await result(page, 'ball.ply');
    const panel = page.locator('#panel');
    if (width < height) await page.locator('#panel > summary').tap();
    await page.getByRole('button', { name: 'Flip all' }).tap();
    const sizes = await page.evaluate(() =>
      [...document.querySelectorAll('button, input, select, summary')]
        .filter((control) => control.checkVisibility())
        .map((control) => (control.closest('label:not(.line)') ?? control).getBoundingClientRect())
        .map(({ width, height }) => Math.round(Math.min(width, height))),
    );
    assert.ok(sizes.length > 15 && Math.min(...sizes) >= 44, String(sizes));
    const hideAndCount = async (box) => {
      const clip = await page.locator(box).boundingBox();
      await page.evaluate((box) => (document.querySelector(box).style.visibility = 'hidden'), box);
      return backsShown(page, { clip });
    };
    // A surface is flipped with the panel out of the way, and the hint takes the place of the result.
    await page.getByRole('button', { name: 'Flip one' }).tap();
    assert.ok(!/Ctrl|Enter/.test(await page.locator('#hint').innerText()), 'no keys without a keyboard');
    const undo = page.getByRole('button', { name: 'Undo' });
    await undo.tap();
    assert.ok(await undo.isDisabled());
    await page.evaluate(() => document.querySelector('[data-do=flip]').click());
    assert.equal(await hideAndCount('#hint'), 0, 'the hint covers nothing');
    await page.evaluate(() => (document.querySelector('#panel').open = true));
    assert.ok((await backsShown(page, { clip: { x: 0, y: 0, width, height } })) > 0.05, 'the cloud is seen');
    assert.ok((await panel.boundingBox()).height < (width < height ? 0.5 : 1) * height);
    assert.equal(await hideAndCount('#panel'), 0, 'the panel covers nothing');
    await page.close();
  }
});

test('a low window shows both buttons, and all that was measured by scrolling', async () => {
  for (const [width, height] of [
    [740, 360],
    [640, 400],
  ]) {
    page = await browser.openPage(browser.isolated, { viewport: { width, height } });
    const boxes = await Promise.all(
      ['Drop a 3D scan', 'Choose a PLY file', 'Try the sample'].map((text) => page.getByText(text).boundingBox()),
    );
    for (const box of boxes) assert.ok(box.y >= 0 && box.y + box.height <= height, JSON.stringify(boxes));
    await drop(page, 'ball.ply', spherePly(5_000));
    await result(page, 'ball.ply');
    await page.getByText('Time for each phase').click();
    assert.ok((await page.locator('#status').boundingBox()).y >= 0);
    await page.getByText('reading the file').scrollIntoViewIfNeeded();
    await page.getByText('reading the file').click();
    await page.close();
  }
});

test('frames keep coming while the normals of a million points are computed', async () => {
  page = await browser.openPage(browser.isolated);
  await choose(page, 'large.ply', spherePly(1_000_000));
  await result(page, 'large.ply');
  await colorsShown(page);
  await page.evaluate(() => {
    window.frames_during_work = 0;
    const count = () => {
      if (!document.querySelector('#job').hidden) window.frames_during_work++;
      requestAnimationFrame(count);
    };
    requestAnimationFrame(count);
  });
  for (let run = 1; run <= 3; run++) {
    await page.getByRole('button', { name: 'Re-run' }).click();
    await result(page, 'large.ply');
  }
  const frames = await page.evaluate(() => window.frames_during_work);
  assert.ok(frames >= 6, `${frames} frames in three runs`);
});

test('a large cloud is drawn by many frames, until it is whole', async () => {
  page = await browser.openPage(browser.isolated, {
    script: () => {
      window.draws = [];
      const { drawArrays } = WebGL2RenderingContext.prototype;
      WebGL2RenderingContext.prototype.drawArrays = function (mode, first, count) {
        const isShown = this.getParameter(this.FRAMEBUFFER_BINDING) === null;
        window.draws.push({ isOfPoints: mode === this.POINTS, isShown, first, end: first + count });
        drawArrays.call(this, mode, first, count);
      };
    },
  });
  // More than one buffer holds.
  const points = 3_200_000;
  const buffer = 3_000_000;
  await choose(page, 'large.ply', spherePly(points));
  await result(page, 'large.ply');
  await page.locator('#canvas[aria-busy=false]').waitFor();
  // A frame later it has begun.
  await page.evaluate(() => {
    window.draws = [];
    document.querySelector('[data-do=flip]').click();
    return new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
  });
  await page.locator('#canvas[aria-busy=false]').waitFor();
  const [first, second, ...rest] = await page.evaluate(() => window.draws);
  // Some of all, at once.
  assert.ok(first.isOfPoints && first.first === 0 && first.end < points, JSON.stringify(first));
  assert.ok(second.isShown && !second.isOfPoints, JSON.stringify(second));
  const whole = rest.pop();
  assert.ok(whole.isShown && !whole.isOfPoints, JSON.stringify(whole));
  assert.ok(rest.length > 2 && rest.every(({ isOfPoints, isShown }) => isOfPoints && !isShown), JSON.stringify(rest));
  let next = 0;
  for (const { first, end } of rest) {
    assert.equal(first, next % buffer);
    next += end - first;
  }
  assert.equal(next, points);
  assert.ok((await backsShown(page)) > 0.9);
});

for (const [what, refuse] of [
  [
    'refuses',
    () => {
      const { bufferData, getError } = WebGL2RenderingContext.prototype;
      let isRefused = false;
      WebGL2RenderingContext.prototype.bufferData = function (target, data, usage) {
        if (data.byteLength > 2e7) isRefused = true;
        else bufferData.call(this, target, data, usage);
      };
      WebGL2RenderingContext.prototype.getError = function () {
        if (!isRefused) return getError.call(this);
        isRefused = false;
        return this.OUT_OF_MEMORY;
      };
    },
  ],
  [
    'stops at',
    () => {
      const { bufferData } = WebGL2RenderingContext.prototype;
      WebGL2RenderingContext.prototype.bufferData = function (target, data, usage) {
        bufferData.call(this, target, data, usage);
        if (data.byteLength < 2e7 || this.isContextLost()) return;
        const extension = this.getExtension('WEBGL_lose_context');
        extension.loseContext();
        setTimeout(() => extension.restoreContext(), 100);
      };
    },
  ],
]) {
  test(`of a cloud that the graphics card ${what} a part is drawn, evenly spread, and the page says so`, async () => {
    page = await browser.openPage(browser.isolated, { script: refuse });
    const points = 2_500_000;
    await choose(page, 'large.ply', spherePly(points));
    const facts = await result(page, 'large.ply');
    assert.match(facts.headline, /2,500,000 points/);
    await page.locator('#note').getByText('no memory for all points: 625,000 of them are drawn').waitFor();
    await page.locator('#canvas[aria-busy=false]').waitFor();
    await page.locator('#lost').waitFor({ state: 'hidden' });
    await page.getByRole('radio', { name: 'Normals' }).check();
    const colors = await colorsShown(page, { side: 300 });
    assert.ok(colors > 100, `${colors} colours`);
    await page.evaluate(() => document.querySelector('[data-do=flip]').click());
    await page.getByRole('checkbox', { name: 'Back faces' }).check();
    assert.ok((await backsShown(page)) > 0.9);
  });
}

test('where memory does not suffice for signs, normals are as found, and the page says so', async () => {
  page = await browser.openPage(browser.isolated);
  // The page's workers get memory for the normals of a million points, but not for their signs.
  await page.route(/worker-[^/]*\.js$/, async (route) => {
    const response = await route.fetch();
    const less = `{
      const { Memory } = WebAssembly;
      WebAssembly.Memory = class extends Memory {
        constructor(limits) { super({ ...limits, maximum: Math.min(limits.maximum, 720) }); }
      };
    }\n`;
    await route.fulfill({ response, body: less + (await response.text()) });
  });
  await page.reload();
  await page.locator('[data-do=choose]:enabled').first().waitFor({ state: 'attached' });
  await choose(page, 'large.ply', spherePly(1_000_000));
  const facts = await result(page, 'large.ply');
  assert.equal(facts.error, undefined);
  assert.equal(facts.without, 0);
  const lack = page.locator('#facts').getByText('no memory for signs');
  assert.ok(await lack.isVisible());
  assert.equal(facts.surface, undefined);
  // For the next file, which may be smaller.
  assert.ok(await page.getByRole('radio', { name: 'Consistent' }).isChecked());
  assert.ok(await page.locator('#pending').isHidden());
  // There is for what takes less.
  await page.getByRole('radio', { name: 'Upwards' }).check();
  await page.getByRole('button', { name: 'Re-run' }).click();
  await page.waitForFunction(() => document.querySelector('#facts').textContent.includes('upwards'));
  assert.ok(await lack.isHidden());
});

test('a browser that has no room for the file that is saved is told of', async () => {
  page = await browser.openPage(browser.isolated, {
    script: () => {
      const { slice } = Blob.prototype;
      Blob.prototype.slice = function (...range) {
        const part = slice.apply(this, range);
        // As Chromium does with what its memory does not hold.
        if (this.constructor === Blob)
          part.arrayBuffer = () => Promise.reject(new DOMException('', 'NotReadableError'));
        return part;
      };
    },
  });
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  await page.getByRole('button', { name: 'Save as PLY' }).click();
  await page.getByRole('alert').filter({ hasText: 'no room for the file' }).waitFor();
});

test('what lies behind an edge is set off, a slope is not', async () => {
  page = await browser.openPage(browser.isolated);
  // So many that a slope is no step between two of them.
  await choose(page, 'ball.ply', spherePly(500_000));
  await result(page, 'ball.ply');
  await page.getByRole('radio', { name: 'Plain' }).check();
  // Where the ball turns away.
  assert.ok((await commonestShown(page, { x: 315, y: 400, side: 100 })) > 0.995);
  const centres = [
    [0, 0, 0],
    [2, 0, 1],
  ];
  await drop(page, 'two.ply', spherePly(40_000, { centres }));
  await result(page, 'two.ply');
  // Across the edge of the nearer one.
  assert.ok((await commonestShown(page, { x: 600, y: 400 })) < 0.995);
});

test('a browser without WebGL 2 is told so', async () => {
  page = await browser.openPage(browser.isolated, {
    script: () => {
      const original = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        return kind === 'webgl2' ? null : original.call(this, kind, ...rest);
      };
    },
  });
  await page.getByRole('alert').filter({ hasText: 'WebGL 2' }).waitFor();
  assert.ok(await page.getByRole('button', { name: 'Choose a PLY file' }).isDisabled());
  // The browser would show a file that the page leaves to it.
  const untaken = () => dispatchEvent(new DragEvent('drop', { cancelable: true }));
  assert.equal(await page.evaluate(untaken), false);
});

test('a browser that has WebGL 2, and then does not start it, is told so', async () => {
  page = await browser.openPage(browser.isolated, {
    script: () => {
      const original = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        return kind === 'webgl2' && this.id === 'canvas' ? null : original.call(this, kind, ...rest);
      };
    },
  });
  await page.getByRole('alert').filter({ hasText: 'did not start' }).waitFor();
  assert.ok(await page.getByRole('button', { name: 'Choose a PLY file' }).isDisabled());
  assert.ok(browser.surprises().every((text) => text.includes('Error creating WebGL context')));
});

test('a window that is zoomed gets a picture of as many pixels', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(5_000));
  await result(page, 'ball.ply');
  const session = await page.context().newCDPSession(page);
  // As a window is zoomed: the emulation tells the page nothing where only the pixels change.
  for (const [width, deviceScaleFactor] of [
    [640, 2],
    [800, 1.5],
  ]) {
    const metrics = { width, height: 600, deviceScaleFactor, mobile: false };
    await session.send('Emulation.setDeviceMetricsOverride', metrics);
    await page.waitForFunction(
      (pixels) => document.querySelector('#canvas').width === pixels,
      width * deviceScaleFactor,
    );
  }
});

test('while WebGL is stopped the page says so, and then it draws again', async () => {
  page = await browser.openPage(browser.isolated);
  await drop(page, 'ball.ply', spherePly(20_000));
  await result(page, 'ball.ply');
  const drawn = await colorsShown(page);
  const stopped = await page.evaluateHandle(() => {
    const extension = document.querySelector('#canvas').getContext('webgl2').getExtension('WEBGL_lose_context');
    extension.loseContext();
    return extension;
  });
  const told = page.getByRole('alert').filter({ hasText: 'WebGL' });
  await told.waitFor();
  await page.screenshot({ path: join(ARTEFACTS, 'lost.png') });
  await stopped.evaluate((extension) => extension.restoreContext());
  await told.waitFor({ state: 'hidden' });
  assert.equal(await colorsShown(page), drawn);
});

test('what a depth camera saw stands upright', async () => {
  page = await browser.openPage(browser.isolated);
  for (const [name, ahead, up] of [
    ['thing.ply', 0, 'y'],
    ['frame.ply', 3, '-y'],
    ['behind.ply', -3, 'y'],
  ]) {
    await drop(page, name, spherePly(5_000, { centres: [[0.2, -0.1, ahead]] }));
    await result(page, name);
    assert.equal(await upAxis().inputValue(), up, name);
  }
  // A shallow thing, which is ground unless the scanner stood before it; one amid it, or beside it, tells nothing.
  const relief = spherePly(5_000);
  const first = relief.indexOf('end_header\n') + 'end_header\n'.length;
  for (let at = first + 8; at < relief.length; at += 12) relief.writeFloatLE(0.2 * relief.readFloatLE(at), at);
  for (const [place, up] of [
    ['', 'z'],
    ['comment scanner position: 0.3 0.2 0.1\n', 'z'],
    ['comment scanner position: 4 0 5\n', 'z'],
    ['comment scanner position: 0.3 0.2 5\n', 'y'],
    ['comment scanner position: 0.3 0.2 -5\n', '-y'],
  ]) {
    const name = `relief${up}${place.length}.ply`;
    await drop(page, name, Buffer.from(relief.toString('latin1').replace('element', `${place}element`), 'latin1'));
    await result(page, name);
    assert.equal(await upAxis().inputValue(), up, place);
  }
});

test('what stands along z stands upright', async () => {
  page = await browser.openPage(browser.isolated);
  // A table: its legs make it taller than what is flat, and it would fall over on its side.
  const table = [-2, 2].flatMap((x) => [-3, 3].map((y) => [x, y, 0])).concat([-1, 1].map((y) => [0, y, 4]));
  for (const [name, centres, up] of [
    ['z.ply', table, 'z'],
    ['y.ply', table.map(([x, y, z]) => [y, z, x]), 'y'],
  ]) {
    await drop(page, name, spherePly(6_000, { centres }));
    await result(page, name);
    assert.equal(await upAxis().inputValue(), up, name);
  }
});

const SCANS = join(data, 'scans');
test('real scans stand upright', { skip: !existsSync(SCANS) && `no ${SCANS}` }, async () => {
  page = await browser.openPage(browser.isolated);
  for (const [name, up] of [
    ['cgal_building.ply', 'z'],
    ['probreg_horse.ply', 'z'],
    ['potree_lion_takanawa_normals_be.ply.gz', 'z'],
    ['stanford_bun000_raw.ply', 'y'],
    ['igea.ply', 'y'],
    ['cilantro_frame_1.ply', '-y'],
  ]) {
    await choose(page, name, readFileSync(join(SCANS, name)));
    await result(page, name.replace('.gz', ''));
    assert.equal(await upAxis().inputValue(), up, name);
  }
});

const AERIAL = join(SCANS, 'las_ahn3_cropped.ply.gz');
test('a real aerial scan of 849 thousand points', { skip: !existsSync(AERIAL) && `no ${AERIAL}` }, async () => {
  page = await browser.openPage(browser.isolated);
  await choose(page, 'aerial.ply', gunzipSync(readFileSync(AERIAL)));
  const shown = await result(page, 'aerial.ply');
  assert.equal(shown.error, undefined);
  assert.match(shown.headline, /848,942 points/);
  assert.equal(await upAxis().inputValue(), 'z', 'surveys are z-up');
  assert.ok((await colorsShown(page)) > 20);
  await page.screenshot({ path: join(ARTEFACTS, 'aerial-shaded.png') });
});
