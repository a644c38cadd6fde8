// A PLY file with faces or triangle strips -> a sampler of its surface, with the normals of the faces. For the bench
// only: the package reads points, not faces, and three's loader knows no strips.

import { readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';

/** Of meshes that are met often: what they are, and whom they are owed to. */
const KNOWN = {
  stanford_bun_zipper: 'the Stanford bunny; Stanford Computer Graphics Laboratory',
  igea: 'a scanned head; Cyberware, from common-3d-test-models',
  probreg_horse: 'a horse; Georgia Tech Large Geometric Models Archive, from probreg',
  trimesh_fixed_top: 'a machine part; trimesh, MIT',
  trimesh_octagonal_pocket: 'a machine part; trimesh, MIT',
  abc_00011084_mesh: 'two overlapping bodies; ABC dataset, from points2surf',
};

/**
 * The meshes among the PLY files of a folder, also gzipped, `{ name, about, mesh, sampler }`; and the others, each with
 * the reason. Nothing of the folder's path comes out.
 */
export function readMeshes(folder) {
  const [meshes, skipped] = [[], []];
  for (const file of folder ? readdirSync(folder).sort() : []) {
    if (!/\.ply(\.gz)?$/i.test(file)) continue;
    const name = file.replace(/\.ply(\.gz)?$/i, '');
    try {
      const bytes = readFileSync(join(folder, file));
      const mesh = readMesh(/\.gz$/i.test(file) ? gunzipSync(bytes) : bytes);
      meshes.push({ name, about: KNOWN[name], mesh, sampler: samplerOf(mesh) });
    } catch ({ message }) {
      skipped.push({ name: file, reason: message });
    }
  }
  return { meshes, skipped };
}

const SIZES = { char: 1, uchar: 1, short: 2, ushort: 2, int: 4, uint: 4, float: 4, double: 8 };
const NAMES = {
  int8: 'char',
  uint8: 'uchar',
  int16: 'short',
  uint16: 'ushort',
  int32: 'int',
  uint32: 'uint',
  float32: 'float',
  float64: 'double',
};
const METHODS = {
  char: 'getInt8',
  uchar: 'getUint8',
  short: 'getInt16',
  ushort: 'getUint16',
  int: 'getInt32',
  uint: 'getUint32',
  float: 'getFloat32',
  double: 'getFloat64',
};

export const meshSampler = (bytes) => samplerOf(readMesh(bytes));

/** A sampler, as of a shape, that covers the mesh evenly. Throws when there are no triangles. */
function samplerOf({ vertices, triangles }) {
  const ends = [];
  const faces = [];
  let total = 0;
  for (const corners of triangles) {
    const [a, b, c] = corners.map((index) => vertices[index]);
    if (!a || !b || !c) throw new Error('a face names a vertex that is not there');
    const [u, v] = [b, c].map((corner) => corner.map((value, i) => value - a[i]));
    const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    const area = Math.hypot(...normal);
    if (!(area > 0)) continue;
    total += area;
    ends.push(total);
    faces.push({ a, u, v, normal: normal.map((value) => value / area) });
  }
  if (faces.length === 0) throw new Error('no faces');
  return (random, out) => {
    const { a, u, v, normal } = faces[first(ends, random() * total)];
    let [s, t] = [random(), random()];
    if (s + t > 1) [s, t] = [1 - s, 1 - t];
    for (let i = 0; i < 3; i++) {
      out[i] = a[i] + s * u[i] + t * v[i];
      out[3 + i] = normal[i];
    }
  };
}

/** The first of the rising values that is above `value`. */
function first(values, value) {
  let [low, high] = [0, values.length - 1];
  while (low < high) {
    const middle = (low + high) >> 1;
    if (values[middle] > value) high = middle;
    else low = middle + 1;
  }
  return low;
}

/** `{ vertices, triangles }`: places, and three indices each. */
function readMesh(bytes) {
  const { format, elements, end } = header(bytes);
  const has = (name) => elements.some((element) => element.name === name);
  if (!has('face') && !has('tristrips')) throw new Error('no faces');
  // Its faces join noisy points: they are not the surface.
  if (has('camera')) throw new Error('a raw range map');
  const next = format === 'ascii' ? words(bytes, end) : numbers(bytes, end, format === 'binary_little_endian');
  const [vertices, triangles] = [[], []];
  for (const { name, count, properties } of elements) {
    for (let i = 0; i < count; i++) {
      const row = {};
      for (const { name, type, length } of properties) {
        row[name] = length ? Array.from({ length: next(length) }, () => next(type)) : next(type);
      }
      if (name === 'vertex') vertices.push([row.x, row.y, row.z]);
      if (name === 'face') triangles.push(fan(row.vertex_indices ?? row.vertex_index));
      if (name === 'tristrips') triangles.push(strip(row.vertex_indices));
    }
  }
  return { vertices, triangles: triangles.flat() };
}

function header(bytes) {
  const text = new TextDecoder('latin1').decode(bytes.subarray(0, 65_536));
  const [head] = /^ply\r?\n[^]*?\nend_header\r?\n/.exec(text) ?? [];
  if (!head) throw new Error('no PLY header');
  const elements = [];
  let format;
  for (const line of head.split(/\r?\n/)) {
    const [keyword, ...rest] = line.trim().split(/\s+/);
    if (keyword === 'format') [format] = rest;
    if (keyword === 'element') elements.push({ name: rest[0], count: Number(rest[1]), properties: [] });
    if (keyword !== 'property') continue;
    const [length, type] = (rest[0] === 'list' ? rest.slice(1, 3) : [undefined, rest[0]]).map((n) => NAMES[n] ?? n);
    elements.at(-1).properties.push({ name: rest.at(-1), type, length });
  }
  return { format, elements, end: head.length };
}

function words(bytes, end) {
  const all = new TextDecoder('latin1').decode(bytes.subarray(end)).split(/\s+/);
  let at = 0;
  return () => Number(all[at++]);
}

function numbers(bytes, end, isLittle) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = end;
  return (type) => {
    const value = view[METHODS[type]](at, isLittle);
    at += SIZES[type];
    return value;
  };
}

const fan = (corners) => corners.slice(2).map((corner, i) => [corners[0], corners[i + 1], corner]);

/** Every second triangle of a strip is wound the other way; a negative index ends a strip. */
function strip(corners) {
  const triangles = [];
  let start = 0;
  for (let i = 0; i < corners.length; i++) {
    if (corners[i] < 0) start = i + 1;
    else if (i >= start + 2) {
      const [a, b] = (i - start) % 2 === 0 ? [corners[i - 2], corners[i - 1]] : [corners[i - 1], corners[i - 2]];
      triangles.push([a, b, corners[i]]);
    }
  }
  return triangles;
}
