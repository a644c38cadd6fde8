// Packages of npm to compare with, which are no dependencies of ours: each set in a folder of its own in .tools.

import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { run, tell, tools } from '../../scripts/run.mjs';

/** The folder `name` with these packages, each with its version. */
export function setupNpm(name, packages) {
  const folder = join(tools, name);
  // An install may have been broken off, or be of other versions.
  const isThere = (wanted) => {
    const [, name, version] = wanted.match(/^(.+)@(.+)$/);
    const file = join(folder, 'node_modules', name, 'package.json');
    return existsSync(file) && JSON.parse(readFileSync(file, 'utf8')).version === version;
  };
  if (!packages.every(isThere)) {
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
