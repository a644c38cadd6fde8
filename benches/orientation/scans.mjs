// Scans whose files have normals with right signs.

import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';

/** Every normal of it faces the scanner that saw its point. */
const BUNNY = {
  name: 'stanford_bunny_ranges_merged_normals',
  about: 'ten range scans of the Stanford bunny, with the normals of the file; Stanford Computer Graphics Laboratory',
};

/** The scans of a folder, `[{ name, file, about, positions, normals }]`: none or one. */
export async function readScans(folder, readPointCloud) {
  const { name, about } = BUNNY;
  const file = `${name}.ply.gz`;
  if (!folder || !existsSync(join(folder, file))) return [];
  const { positions, normals } = await readPointCloud(gunzipSync(readFileSync(join(folder, file))));
  return [{ name, file, about, positions, normals }];
}
