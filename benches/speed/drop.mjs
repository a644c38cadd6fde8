// From a file in the page's hands to normals in those of WebGL, beside the same estimate alone.

import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { root } from '../../scripts/run.mjs';
import { pageHeaders, serve } from '../../scripts/serve.mjs';
import { median } from '../median.mjs';
import { measureThere } from './engines.mjs';
import { binaryPly } from './ply.mjs';

/**
 * `{ points, whole, estimate }`: milliseconds, medians, from the choice of a file until its normals were handed to WebGL,
 * each time with a page that was just opened, and of the same estimate alone.
 */
export async function measureDrop({ browser, page }, positions, folder, runs) {
  const [file, cloud] = ['drop.ply', 'cloud.f32'].map((name) => `${folder}/${name}`);
  writeFileSync(join(root, file), binaryPly(positions));
  writeFileSync(join(root, cloud), positions);
  const www = join(root, 'www', 'dist');
  const server = await serve(www, { headers: pageHeaders(www) });
  const whole = [];
  try {
    for (let run = 0; run < runs; run++) {
      const fresh = await browser.newPage();
      await fresh.addInitScript(watchUploads);
      await fresh.goto(server.url);
      await fresh.waitForFunction(() => !document.querySelector('[data-do=choose]').disabled);
      // As long as a person takes to find a file, or less.
      await fresh.waitForTimeout(3_000);
      await fresh.locator('#file').setInputFiles(join(root, file));
      const found = await fresh.waitForFunction((bytes) => globalThis.uploaded(bytes), positions.byteLength, {
        timeout: 120_000,
      });
      whole.push(await found.jsonValue());
      await fresh.close();
    }
  } finally {
    await server.close();
  }
  // What the page asks for by itself.
  const options = { orient: 'consistent', components: true };
  const reports = await page.evaluate(measureThere, { file: cloud, options, runs, threads: 'auto' });
  const estimate = median(reports.map((report) => report.milliseconds.total));
  return { points: positions.length / 3, whole: median(whole), estimate };
}

/**
 * In the page: notes when a file was chosen, and when arrays of some size have been handed to WebGL. Nothing is drawn: where
 * there is no GPU, as on servers, drawing takes the processors that the estimate needs.
 */
function watchUploads() {
  WebGL2RenderingContext.prototype.drawArrays = WebGL2RenderingContext.prototype.drawElements = () => {};
  let chosen;
  const uploads = [];
  addEventListener('change', () => (chosen = performance.now()), { capture: true });
  const { bufferData } = WebGL2RenderingContext.prototype;
  WebGL2RenderingContext.prototype.bufferData = function (...args) {
    bufferData.apply(this, args);
    uploads.push({ bytes: args[1]?.byteLength, at: performance.now() });
  };
  // The positions first, then the normals.
  globalThis.uploaded = (bytes) => {
    const [, normals] = uploads.filter((upload) => upload.bytes === bytes);
    return normals && normals.at - chosen;
  };
}
