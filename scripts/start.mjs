// npm start: sets up, builds, and serves the page.

import { join } from 'node:path';
import { build, buildPage } from './build.mjs';
import { Failure, main, root } from './run.mjs';
import { pageHeaders, serve } from './serve.mjs';
import { setup } from './setup.mjs';

const FIRST_PORT = 8080;

await main(async () => {
  const [unknown] = process.argv.slice(2);
  if (unknown) throw new Failure(`${unknown} is no argument; another port is set by PORT=8090 npm start`);
  setup();
  build();
  buildPage();
  const wanted = process.env.PORT;
  if (wanted && !/^\d{1,5}$/.test(wanted)) throw new Failure(`PORT is ${wanted}; wanted a number from 0 to 65535`);
  const { port, next } = wanted ? { port: Number(wanted) } : { port: FIRST_PORT, next: true };
  const folder = join(root, 'www', 'dist');
  const { url } = await serve(folder, { port, next, headers: pageHeaders(folder) }).catch((error) => {
    throw new Failure(`no server on port ${port}: ${error.message}`);
  });
  console.log(`\nbilinormal: ${url}?sample (end with Ctrl-C)`);
});
