// What the scripts share.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';

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
