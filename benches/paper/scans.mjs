// Real scans from a folder: which of its files are measured, and what is known of them.

import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';

/** Of scans that are met often: what they are, and whom they are owed to. Pictures are taken of those with a title. */
const KNOWN = {
  las_ahn3_cropped: {
    about: 'aerial lidar; AHN3, CC0',
    title: 'a village from the air',
    view: { size: [640, 420], closer: 1.15 },
  },
  las_indoor: {
    about: 'rooms, lidar; loaders.gl, MIT',
    title: 'rooms, from outside',
    view: { closer: 1.1 },
  },
  las_autzen_trim: {
    about: 'aerial lidar; PDAL, BSD',
    title: 'a river and woods from the air',
    view: { closer: 1.1 },
  },
  stanford_bunny_ranges_merged_normals: {
    about: 'ten range scans of the Stanford bunny; Stanford Computer Graphics Laboratory',
    title: 'the bunny, ten range scans',
    view: { closer: 1.2 },
  },
  potree_lion_takanawa_normals_be: {
    about: 'photogrammetry of a statue; potree, BSD',
    title: 'a lion',
    view: { up: 'z', closer: 1.4 },
  },
  igea: { about: 'vertices of a scanned head; Cyberware, from common-3d-test-models' },
  cilantro_frame_1: { about: 'a frame of a depth camera; cilantro, MIT' },
  cgal_building: {
    about: 'a building; CGAL',
    title: 'a building',
    view: { up: 'z', turn: [-50, 0], closer: 1.1 },
  },
};

/** Gaussian splats are no surface points. */
const isSplat = ({ properties }) => properties.some((name) => /^(f_dc_|rot_|packed_)/.test(name));

/**
 * The PLY files of a folder, also gzipped, that hold at least `least` points, the smallest first; and the others, each
 * with the reason. Nothing of the folder's path comes out.
 */
export async function readScans(folder, { readPointCloud, least }) {
  const [scans, skipped] = [[], []];
  for (const file of folder ? readdirSync(folder).sort() : []) {
    if (!/\.ply(\.gz)?$/i.test(file)) continue;
    const name = file.replace(/\.ply(\.gz)?$/i, '');
    try {
      const bytes = readFileSync(join(folder, file));
      const { count, positions, origin, source } = await readPointCloud(
        /\.gz$/i.test(file) ? gunzipSync(bytes) : bytes,
      );
      if (isSplat(source)) throw new Error('Gaussian splats, no surface points');
      if (count < least) throw new Error(`${count.toLocaleString('en')} points, fewer than wanted here`);
      scans.push({ name, positions, origin, ...KNOWN[name] });
    } catch ({ message }) {
      skipped.push({ name: file, reason: message });
    }
  }
  scans.sort((a, b) => a.positions.length - b.positions.length);
  return { scans, skipped };
}
