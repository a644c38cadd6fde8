// The tables of docs/ARCHITECTURE.md: what a file of the crate or of the page imports is what they say that it may use.
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { read, root } from '../../scripts/run.mjs';

const document = read('docs/ARCHITECTURE.md');

/** For each file of the first table after some words, in its order, what it may use. */
function tableAfter(words) {
  const [table] = document.slice(document.indexOf(words)).match(/(^\|.*\n)+/m);
  const rows = table.split('\n').map((row) => row.split('|').map((cell) => cell.trim()));
  const namesOf = (cell = '') => [...cell.matchAll(/`(\w+)(?:\.[a-z.]+|\/)`/g)].map(([, name]) => name);
  return new Map(rows.flatMap(([, files, , uses]) => namesOf(files).map((name) => [name, uses.split(', ')])));
}

/** What the files of a module import from those beside it, without their tests and comments. */
function importsOf(folder, path, beside) {
  const [code] = readFileSync(join(root, folder, path), 'utf8').split('#[cfg(test)]');
  return [...code.replace(/\/\/.*/g, '').matchAll(beside)].map(([, name]) => name);
}

for (const { words, folder, ends = '.rs', beside } of [
  { words: '## The crate', folder: 'src', beside: /\bcrate::([a-z]\w*)/g },
  { words: 'In `src/adaptive/`', folder: 'src/adaptive', beside: /\bsuper::([a-z]\w*)/g },
  { words: 'In `src/orient/`', folder: 'src/orient', beside: /\bsuper::([a-z]\w*)/g },
  { words: 'In `www/src/`', folder: 'www/src', ends: '.ts', beside: /from '\.\/([a-z]\w*)/g },
]) {
  test(`${folder} imports what the table allows`, () => {
    const table = tableAfter(words);
    const names = [...table.keys()];
    // What the page says that any file may use.
    const tools = folder === 'src' ? names.slice(names.indexOf('lanes'), names.indexOf('wasm')) : [];
    for (const path of readdirSync(join(root, folder), { recursive: true })) {
      const name = path.match(/^\w+/)[0];
      if (!path.endsWith(ends) || name === 'lib') continue;
      assert.ok(table.has(name), `${path} is not in the table`);
      const allowed = [name, ...tools, ...table.get(name)];
      if (allowed.some((use) => use.startsWith('all '))) continue;
      const others = importsOf(folder, path, beside).filter((use) => !allowed.includes(use));
      assert.deepEqual(others, [], `${path} imports what the table does not allow`);
    }
  });
}
