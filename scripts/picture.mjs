// npm run picture: takes docs/picture.jpg, the picture of the README, from the page with its sample.

import { join } from 'node:path';
import { build, buildPage } from './build.mjs';
import { main, root } from './run.mjs';
import { setup } from './setup.mjs';

await main(async () => {
  setup({ browser: true });
  build();
  buildPage();
  // Not before the set-up: it needs npm packages.
  const { openBrowser, result } = await import('../tests/browser/browser.mjs');
  const browser = await openBrowser();
  try {
    const page = await browser.openPage(`${browser.isolated}?sample`, { viewport: { width: 1280, height: 720 } });
    await result(page, 'sample.ply');
    // The view comes to rest, and the cloud is drawn in full.
    await page.waitForTimeout(3000);
    await page.screenshot({ path: join(root, 'docs', 'picture.jpg'), type: 'jpeg', quality: 80 });
  } finally {
    await browser.close();
  }
});
