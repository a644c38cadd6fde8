// Calls a program of this folder: what it says on standard output is an object of JSON in each line.

import { execFileSync } from 'node:child_process';
import { join } from 'node:path';
import { root } from '../../scripts/run.mjs';

export function linesOf(command, script, args) {
  const path = join(root, 'benches', 'peers', script);
  const text = execFileSync(command, [path, ...args], { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
  return text
    .trimEnd()
    .split('\n')
    .map((line) => JSON.parse(line));
}
