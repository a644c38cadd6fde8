// Packages of npm to compare with, which are no dependencies of ours: each set in a folder of its own in .tools.

import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { run, tell, tools } from '../../scripts/run.mjs';

/** The folder `name` with these packages, each with its version. */
export function setupNpm(name, packages) {
  const folder = join(tools, name);
  if (!existsSync(join(folder, 'node_modules'))) {
    tell(`set-up: ${packages.join(', ')} into .tools, to compare with`);
    run('npm', [
      'install',
      '--no-save',
      '--no-audit',
      '--no-fund',
      '--loglevel=error',
      `--prefix=${folder}`,
      ...packages,
    ]);
  }
  return folder;
}
