// What a laser scanner on its tripod sees of open ground with trees: a sampler as in shapes.mjs, normals towards the scanner,
// which is at the origin.

/** Where the ground is, and how it rises along x and y. */
const HEIGHT = 1.7;
const ground = (x, y) => {
  const [along, across, fine] = [x / 9 + 1, y / 12, x / 3.5 + y / 4.5];
  return {
    z: -HEIGHT - 1.6 * Math.sin(1) + 1.6 * Math.sin(along) * Math.cos(across) + 0.25 * Math.sin(fine),
    rise: [
      (1.6 / 9) * Math.cos(along) * Math.cos(across) + (0.25 / 3.5) * Math.cos(fine),
      (-1.6 / 12) * Math.sin(along) * Math.sin(across) + (0.25 / 4.5) * Math.cos(fine),
    ],
  };
};

/** Crowns of trees on the ground. */
const TREES = [
  [6, 4],
  [-9, 2],
  [3, -12],
  [-5, -8],
  [14, -5],
  [-12, 13],
  [10, 15],
].map(([x, y], i) => ({ middle: [x, y, ground(x, y).z + 2 + (i % 3) / 2], radius: 1 + (i % 2) / 2 }));

/** How far it sees, and the least rise of its rays: none goes to where the tripod stands. */
const REACH = 30;
const LOWEST = -0.9;

export const hills = () => (random, out) => {
  for (;;) {
    const [height, a] = [LOWEST + (1 - LOWEST) * random(), 2 * Math.PI * random()];
    const ring = Math.sqrt(1 - height * height);
    const along = [ring * Math.cos(a), ring * Math.sin(a), height];
    const hit = nearest(along);
    if (!hit) continue;
    out.set(hit);
    return;
  }
};

/** The first place on a ray from the origin, and the normal there, if there is one. */
function nearest(along) {
  const at = (distance) => along.map((c) => distance * c);
  let first = { distance: REACH };
  for (const { middle, radius } of TREES) {
    const closest = middle.reduce((sum, c, axis) => sum + c * along[axis], 0);
    const square = radius ** 2 - (Math.hypot(...middle) ** 2 - closest ** 2);
    const distance = closest - Math.sqrt(Math.max(square, 0));
    if (square > 0 && distance > 0 && distance < first.distance) {
      first = { distance, normal: at(distance).map((c, axis) => (c - middle[axis]) / radius) };
    }
  }
  // No step leads through the ground, which rises by less than 1, but for the last.
  for (let distance = 0; distance < first.distance;) {
    const [x, y, z] = at(distance);
    const { z: low, rise } = ground(x, y);
    if (z - low < 1e-6) {
      const length = Math.hypot(...rise, 1);
      first = { distance, normal: [-rise[0] / length, -rise[1] / length, 1 / length] };
      break;
    }
    distance += Math.max((z - low) / 2, 1e-6);
  }
  return first.normal && [...at(first.distance), ...first.normal];
}
