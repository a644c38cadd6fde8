// What other libraries reach on a cloud of the bench: benches/peers/orientation.py on a file of it.

import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { linesOf } from '../peers/run.mjs';

/** The rows that others are asked for: with noise and density of every kind they would take hours. */
const VARIANTS = ['clean', 'noise0.12', 'noise0.6', 'as it is'];
const isAsked = ({ kind, variant }) => VARIANTS.includes(variant) && !(kind === 'mesh' && variant === 'noise0.12');

/** `[{ method, share, seconds }]`, or with a `failure` in place of the two. */
export async function peersOf(python, row, { positions, normals }, { writePly }) {
  if (!isAsked(row)) return undefined;
  const source = { format: 'generated', properties: [], comments: [] };
  const cloud = { count: positions.length / 3, positions, origin: [0, 0, 0], source };
  const file = await writePly(cloud, { normals: new Float32Array(normals) });
  const folder = mkdtempSync(join(tmpdir(), 'bilinormal-'));
  try {
    const path = join(folder, 'cloud.ply');
    writeFileSync(path, new Uint8Array(await file.arrayBuffer()));
    return linesOf(python, 'orientation.py', [path]);
  } finally {
    rmSync(folder, { recursive: true });
  }
}
