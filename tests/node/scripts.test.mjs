// What the scripts share.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { test } from 'node:test';
import { root } from '../../scripts/run.mjs';

test('a script knows that it was started, also through a link, and that it was imported', (context) => {
  const folder = mkdtempSync(join(tmpdir(), 'bilinormal-'));
  context.after(() => rmSync(folder, { recursive: true }));
  const shared = JSON.stringify(new URL('../../scripts/run.mjs', import.meta.url).href);
  writeFileSync(join(folder, 'script.mjs'), `import { started } from ${shared}; console.log(started(import.meta));`);
  writeFileSync(join(folder, 'other.mjs'), `import './script.mjs';`);
  symlinkSync(join(folder, 'script.mjs'), join(folder, 'link.mjs'));
  const told = ['script', 'link', 'other'].map((name) =>
    execFileSync(process.execPath, [join(folder, `${name}.mjs`)], { encoding: 'utf8' }),
  );
  assert.deepEqual(told, ['true\n', 'true\n', 'false\n']);
});

test('no script needs a package before it has set up', () => {
  const commands = Object.values(JSON.parse(readFileSync(join(root, 'package.json'), 'utf8')).scripts);
  const files = new Set(commands.flatMap((command) => command.match(/^node (.*)/)?.slice(1) ?? []));
  assert.ok(files.has('scripts/build.mjs'));
  // A set goes on with what is added meanwhile.
  for (const file of files) {
    for (const [, from] of readFileSync(join(root, file), 'utf8').matchAll(/^(?:import|\S.* from) '(.*)';$/gm)) {
      assert.match(from, /^(node:|\.)/, `${file} imports ${from}`);
      if (from.startsWith('.')) files.add(join(dirname(file), from));
    }
  }
});
