// What one scanner sees of a mesh, as of an object in a single range scan or in a frame of a depth camera.

import { rays } from './rays.mjs';

/** Where the scanner stands, from the middle of the box. */
export const VIEWS = { 'from a corner': [1, 1, 1], 'along z': [0, 0, 1] };

/** How far from there, in diagonals of the box. */
const DISTANCE = 1.5;

/** A sampler of what a scanner sees, as many points in every direction. That of the mesh has outward normals. */
export function seenFrom(direction, corners, sampler) {
  const [low, high] = [
    [Infinity, Infinity, Infinity],
    [-Infinity, -Infinity, -Infinity],
  ];
  corners.forEach((value, i) => {
    low[i % 3] = Math.min(low[i % 3], value);
    high[i % 3] = Math.max(high[i % 3], value);
  });
  const diagonal = Math.hypot(...low.map((value, axis) => high[axis] - value));
  const away = (DISTANCE * diagonal) / Math.hypot(...direction);
  const scanner = low.map((value, axis) => (value + high[axis]) / 2 + away * direction[axis]);
  const nearest = (DISTANCE - 0.5) * diagonal;
  const cast = rays(corners);
  return (random, out) => {
    for (;;) {
      sampler(random, out);
      const to = scanner.map((value, axis) => value - out[axis]);
      const distance = Math.hypot(...to);
      const along = to.map((value) => value / distance);
      const cosine = along.reduce((sum, value, axis) => sum + value * out[3 + axis], 0);
      // The share of the directions that a piece of surface takes.
      if (random() >= cosine * (nearest / distance) ** 2) continue;
      if (cast(out.subarray(0, 3), along, 1e-5 * diagonal) >= distance) return;
    }
  };
}
