// npm run normals -- IN -o OUT: the command line from a clone. Sets up and builds first, if that was not done yet.

import { spawnSync } from 'node:child_process';
import { join } from 'node:path';
import { build } from './build.mjs';
import { main, root } from './run.mjs';
import { setup } from './setup.mjs';

await main(() => {
  setup();
  build();
  const { status } = spawnSync(process.execPath, [join(root, 'dist', 'cli.js'), ...process.argv.slice(2)], {
    // npm changes into the project's folder; file names are meant from where the user stands.
    cwd: process.env.INIT_CWD ?? process.cwd(),
    stdio: 'inherit',
  });
  process.exitCode = status ?? 1;
});
