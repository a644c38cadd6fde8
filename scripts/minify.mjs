// node scripts/minify.mjs FILE ...: makes modules as short as may be, in place. On its own because the minifier is not
// there before setup.mjs has run. It is that of Rolldown, because esbuild's leaves the package larger, by a thirtieth.

import { readFileSync, writeFileSync } from 'node:fs';
import { minifySync } from 'rolldown/utils';
import { Failure, main } from './run.mjs';

await main(() => {
  for (const path of process.argv.slice(2)) {
    const options = { module: true, compress: { target: 'es2022' } };
    const { code, errors } = minifySync(path, readFileSync(path, 'utf8'), options);
    if (errors.length > 0) throw new Failure(`${path}: ${errors[0].message}`);
    // Not every bundler sees an address in a template.
    writeFileSync(path, code.replace(/(?<=\b(?:import|new URL)\()`([^`$\\]*)`/g, '"$1"'));
  }
});
