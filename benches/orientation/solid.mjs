// What the triangles of a mesh enclose: its outside, what overlaps, and how thick its walls are.

import { cloudOf } from '../accuracy/clouds.mjs';
import { rays } from './rays.mjs';

/** The corners of all triangles, nine numbers each. */
export function cornersOf({ vertices, triangles }) {
  const corners = new Float64Array(9 * triangles.length);
  triangles.forEach((triangle, i) => triangle.forEach((vertex, j) => corners.set(vertices[vertex], 9 * i + 3 * j)));
  return corners;
}

/** The volume inside; below zero where the faces are wound inwards. */
export function signedVolume(corners) {
  let sum = 0;
  for (let at = 0; at < corners.length; at += 9) {
    // From a corner of the mesh, so that the holes of an open one count little.
    const [a, b, c] = [0, 3, 6].map((from) => [0, 1, 2].map((axis) => corners[at + from + axis] - corners[axis]));
    sum += dot(a, cross(b, c)) / 6;
  }
  return sum;
}

/** How often the mesh goes round a place: 1 inside, 0 outside. Solid angles after van Oosterom and Strackee (1983). */
export function windingNumber(corners, [x, y, z]) {
  let sum = 0;
  for (let at = 0; at < corners.length; at += 9) {
    const [ax, ay, az] = [corners[at] - x, corners[at + 1] - y, corners[at + 2] - z];
    const [bx, by, bz] = [corners[at + 3] - x, corners[at + 4] - y, corners[at + 5] - z];
    const [cx, cy, cz] = [corners[at + 6] - x, corners[at + 7] - y, corners[at + 8] - z];
    const [a, b, c] = [length(ax, ay, az), length(bx, by, bz), length(cx, cy, cz)];
    const volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx);
    const ab = ax * bx + ay * by + az * bz;
    const bc = bx * cx + by * cy + bz * cz;
    const ca = cx * ax + cy * ay + cz * az;
    sum += Math.atan2(volume, a * b * c + ab * c + bc * a + ca * b);
  }
  return sum / (2 * Math.PI);
}

/** Samples that show whether a mesh overlaps itself. */
const SAMPLES = 200;

/** The share of a mesh's surface that lies inside of it or against another part of it. The sampler's normals are outward. */
export function hidden(corners, sampler, diagonal) {
  const { positions, normals } = cloudOf(sampler, SAMPLES, {}, 1);
  const away = 1e-4 * diagonal;
  let count = 0;
  for (let at = 0; at < positions.length; at += 3) {
    const before = [0, 1, 2].map((axis) => positions[at + axis] + away * normals[at + axis]);
    // At the rim of a hole it is a half.
    if (Math.abs(windingNumber(corners, before)) > 0.7) count++;
  }
  return count / SAMPLES;
}

/**
 * How thick the wall behind each point is: along the inward normal to where the ray leaves the mesh; infinite where it
 * does not. `nearest`: nothing nearer is a wall, as the surface that the point is on.
 */
export function thickness(corners, { positions, normals }, nearest) {
  const cast = rays(corners);
  return Float32Array.from({ length: positions.length / 3 }, (_, i) => {
    const [from, normal] = [positions, normals].map((values) => values.subarray(3 * i, 3 * i + 3));
    return cast(
      from,
      [...normal].map((value) => -value),
      nearest,
    );
  });
}

const length = (x, y, z) => Math.sqrt(x * x + y * y + z * z);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
