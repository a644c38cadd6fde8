// The shapes of the orientation bench: those of the accuracy bench whose sides are known, and some that are hard to tell
// the outside of. Samplers as there; normals point outwards.

import { SHAPES as KNOWN } from '../accuracy/shapes.mjs';
import { hills } from './hills.mjs';
import { scene } from './scene.mjs';

const TAU = 2 * Math.PI;
const signed = (random) => 2 * random() - 1;

/** The same points with normals to the other side. */
export const turned = (sampler) => (random, out) => {
  sampler(random, out);
  for (let i = 3; i < 6; i++) out[i] = -out[i];
};

/** A closed box of 1 by 1 by 0.02, leaning over about the first axis: so its diagonal grows little, and with it the noise. */
const thinBox = () => {
  const [c, s] = [Math.cos(0.35), Math.sin(0.35)];
  const half = [0.5, 0.5, 0.01];
  const areas = half.map((_, axis) => half[(axis + 1) % 3] * half[(axis + 2) % 3]);
  const total = areas.reduce((sum, area) => sum + area);
  return (random, out) => {
    let left = random() * total;
    const axis = Math.max(
      areas.findIndex((area) => (left -= area) < 0),
      0,
    );
    const side = random() < 0.5 ? 1 : -1;
    for (let i = 0; i < 3; i++) {
      out[i] = i === axis ? side * half[i] : half[i] * signed(random);
      out[3 + i] = i === axis ? side : 0;
    }
    for (const at of [1, 4]) {
      const [y, z] = [out[at], out[at + 1]];
      out[at] = c * y - s * z;
      out[at + 1] = s * y + c * z;
    }
  };
};

const onSphere = (random, radius, [x, y, z], out) => {
  const [height, a] = [signed(random), TAU * random()];
  const ring = Math.sqrt(1 - height * height);
  out.set([ring * Math.cos(a), ring * Math.sin(a), height], 3);
  out.set([x + radius * out[3], y + radius * out[4], z + radius * out[5]]);
};

/** A sphere of radius 0.7 inside the unit sphere; both look away from the middle. */
const nested = () => (random, out) => onSphere(random, random() < 1 / 1.49 ? 1 : 0.7, [0, 0, 0], out);

/** Two unit spheres that touch, on a line about no special axis. */
const touching = () => (random, out) => {
  const side = random() < 0.5 ? 1 : -1;
  onSphere(random, 1, [0.48 * side, 0.64 * side, 0.6 * side], out);
};

/** A prism of a height over a polygon, given counterclockwise round the middle of its plane. */
const prism = (polygon, height) => {
  const edges = polygon.map(([x, y], i) => {
    const [toX, toY] = polygon[(i + 1) % polygon.length];
    return { x, y, dx: toX - x, dy: toY - y, length: Math.hypot(toX - x, toY - y) };
  });
  const end = edges.reduce((sum, { x, y, dx, dy }) => sum + (x * dy - y * dx) / 2, 0);
  const sides = height * edges.reduce((sum, { length }) => sum + length, 0);
  const reach = Math.max(...polygon.flat().map(Math.abs));
  const isInside = (px, py) =>
    edges.filter(({ x, y, dx, dy }) => y > py !== y + dy > py && px < x + (dx * (py - y)) / dy).length % 2 === 1;
  return (random, out) => {
    let left = random() * (2 * end + sides);
    for (const { x, y, dx, dy, length } of edges) {
      if (left < height * length) {
        const along = random();
        out.set([x + along * dx, y + along * dy, height * (random() - 0.5), dy / length, -dx / length, 0]);
        return;
      }
      left -= height * length;
    }
    const side = random() < 0.5 ? 1 : -1;
    do out.set([reach * signed(random), reach * signed(random), (side * height) / 2, 0, 0, side]);
    while (!isInside(out[0], out[1]));
  };
};

/** Two plates that meet in a T, 2 wide, 1 high, 2 long and 0.03 thick: at 100,000 points less than three spacings. */
const bracket = () => {
  const [t, foot] = [0.03, -0.5];
  const right = [
    [1, foot],
    [1, foot + t],
    [t / 2, foot + t],
    [t / 2, 0.5],
  ];
  return prism([...right, ...right.toReversed().map(([x, y]) => [-x, y])], 2);
};

/** A star of twelve tips, between radius 0.5 and 1: the sides of its blades meet at 28 degrees. */
const star = () => {
  const corner = (i) => {
    const [radius, a] = [i % 2 ? 0.5 : 1, (TAU * i) / 24];
    return [radius * Math.cos(a), radius * Math.sin(a)];
  };
  return prism(
    Array.from({ length: 24 }, (_, i) => corner(i)),
    0.4,
  );
};

/** A comb of rectangles 1 wide and high, in steps from left to right: a spine so high, and so many teeth so wide. */
const combed = (spine, teeth, width) => {
  const left = (i) => (i * (1 - width)) / (teeth - 1) - 0.5;
  const tooth = (i) => [
    [left(i) + width, spine - 0.5],
    [left(i) + width, 0.5],
    [left(i), 0.5],
    [left(i), spine - 0.5],
  ];
  return [[-0.5, -0.5], [0.5, -0.5], ...Array.from({ length: teeth }, (_, i) => tooth(teeth - 1 - i)).flat()];
};

/** A heat sink: nine fins, at 100,000 points two and a half spacings thick and six apart. */
const fins = () => prism(combed(0.1, 9, 0.035), 1);

/** A comb: 25 teeth, four spacings wide and as many apart. */
const comb = () => prism(combed(0.25, 25, 0.02), 0.03);

/** A Moebius band of radius 1 and width 0.8; its normals are those of one way round it. */
const moebius = () => (random, out) => {
  for (;;) {
    const [u, t] = [TAU * random(), 0.4 * signed(random)];
    const [c, s, half, rise] = [Math.cos(u), Math.sin(u), Math.cos(u / 2), Math.sin(u / 2)];
    const r = 1 + t * half;
    // The area of the surface above a piece of its parameters, at most 1.42.
    const area = Math.hypot(r, t / 2);
    if (1.42 * random() > area) continue;
    out.set([r * c, r * s, t * rise]);
    const lean = (t / 2) * s - r * rise * c;
    const slant = (-t / 2) * c - r * rise * s;
    out.set([lean / area, slant / area, (r * half) / area], 3);
    return;
  }
};

/**
 * `open`: no side of it is the inside, and signs count up to one flip of all. `sides: false`: it has none. `kind`: what it is,
 * if not a shape. `noise`: the variant of its noisy row, 0.6 % but where that is too much for what is thin, or for a
 * scanner.
 */
export const SHAPES = {
  sphere: { shape: KNOWN.sphere },
  cube: { shape: KNOWN.cube },
  torus: { shape: KNOWN.torus },
  cylinder: { shape: KNOWN.cylinder },
  cone: { shape: KNOWN.cone },
  thinbox: { shape: thinBox, noise: 'noise0.12' },
  nested: { shape: nested },
  touching: { shape: touching },
  terrain: { shape: KNOWN.terrain, open: true },
  // The tube of the accuracy bench, where signs do not count, looks inwards.
  tube: { shape: (count) => turned(KNOWN.tube(count)), open: true },
  room: { shape: KNOWN.room, open: true },
  moebius: { shape: moebius, open: true, sides: false },
  bracket: { shape: bracket, noise: 'noise0.12' },
  star: { shape: star, noise: 'noise0.12' },
  fins: { shape: fins, noise: 'noise0.12' },
  comb: { shape: comb, noise: 'noise0.12' },
  scene: { shape: scene(3), kind: 'scene', noise: 'noise0.12' },
  view: { shape: scene(1), kind: 'scene', noise: 'noise0.12' },
  hall: { shape: scene(1, true), kind: 'scene', noise: 'noise0.12' },
  hills: { shape: hills, kind: 'scene', noise: 'noise0.12' },
};
