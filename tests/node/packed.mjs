// The package as npm would publish it, unpacked into a project of its own in a temporary folder.
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));

/** A temporary folder that goes when the tests of the file have ended. */
export function temporaryFolder() {
  const folder = mkdtempSync(join(tmpdir(), 'bilinormal-'));
  after(() => rmSync(folder, { recursive: true, force: true, maxRetries: 5 }));
  return folder;
}

/** Packs, unpacks; the answer has the project's folder, the package's in it, and a way to import from there. */
export function installPacked() {
  const project = temporaryFolder();
  const options = { cwd: root, stdio: ['ignore', 'pipe', 'ignore'], shell: process.platform === 'win32' };
  execFileSync('npm', ['pack', '--ignore-scripts', '--pack-destination', project], options);
  const [archive] = readdirSync(project);
  const home = join(project, 'node_modules', 'bilinormal');
  mkdirSync(home, { recursive: true });
  execFileSync('tar', ['-xzf', join(project, archive), '-C', home, '--strip-components=1']);
  writeFileSync(join(project, 'package.json'), '{ "type": "module" }\n');
  const load = (specifier) => {
    const script = join(project, `${specifier.replace(/\W/g, '-')}.mjs`);
    writeFileSync(script, `export * from '${specifier}';\n`);
    return import(pathToFileURL(script).href);
  };
  return { project, home, load, cli: join(home, 'dist', 'cli.js') };
}
