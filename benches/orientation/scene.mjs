// What laser scanners see of a room that is furnished, or a corner of it: samplers as in shapes.mjs, normals towards the
// scanner.

/** The floor and two walls, all from 0 on, so far along each axis; there a whole room ends with a ceiling and two more. */
const ROOM = [4, 3.6, 2.4];

/** A box without legs, one that stands on the floor, and two balls above it. */
const BOXES = [
  { low: [1.9, 1.2, 0.7], high: [2.9, 2.1, 0.8] },
  { low: [0.5, 2.2, 0], high: [1.1, 2.9, 1.1] },
];
const BALLS = [
  { middle: [1.2, 0.9, 0.55], radius: 0.4 },
  { middle: [2.4, 2.8, 0.45], radius: 0.35 },
];

/** Where scanners stand. */
const STATIONS = [
  [3.5, 3.1, 1.6],
  [0.7, 1.5, 1.5],
  [3.4, 0.5, 1.3],
];

/** Points that the first `stations` scanners see, as many in every direction; `isWhole`: of the whole room. */
export const scene =
  (stations, isWhole = false) =>
  () =>
  (random, out) => {
    for (;;) {
      const from = STATIONS[Math.floor(stations * random())];
      const [height, a] = [2 * random() - 1, 2 * Math.PI * random()];
      const ring = Math.sqrt(1 - height * height);
      const hit = nearest(from, [ring * Math.cos(a), ring * Math.sin(a), height], isWhole);
      if (!hit) continue;
      out.set(hit);
      return;
    }
  };

/** The first place on a ray, and the normal there; nothing where that is out of the room, unless it is whole. */
function nearest(from, along, isWhole) {
  let first = { distance: Infinity, normal: [0, 0, 0] };
  const meet = (distance, normal) => {
    if (distance > 0 && distance < first.distance) first = { distance, normal };
  };
  const axes = [0, 1, 2];
  const unit = (axis, sign) => axes.map((other) => (other === axis ? sign : 0));
  for (const axis of axes) {
    if (along[axis] < 0) meet(-from[axis] / along[axis], unit(axis, 1));
    else if (isWhole) meet((ROOM[axis] - from[axis]) / along[axis], unit(axis, -1));
  }
  for (const { low, high } of BOXES) {
    const ends = axes.map((axis) => [low[axis], high[axis]].map((at) => (at - from[axis]) / along[axis]));
    const entries = ends.map((pair) => Math.min(...pair));
    const entry = Math.max(...entries);
    const axis = entries.indexOf(entry);
    if (entry < Math.min(...ends.map((pair) => Math.max(...pair)))) meet(entry, unit(axis, -Math.sign(along[axis])));
  }
  for (const { middle, radius } of BALLS) {
    const to = axes.map((axis) => middle[axis] - from[axis]);
    const closest = axes.reduce((sum, axis) => sum + to[axis] * along[axis], 0);
    const square = radius ** 2 - (Math.hypot(...to) ** 2 - closest ** 2);
    const distance = closest - Math.sqrt(Math.max(square, 0));
    if (square > 0) {
      meet(
        distance,
        axes.map((axis) => (distance * along[axis] - to[axis]) / radius),
      );
    }
  }
  const place = axes.map((axis) => from[axis] + first.distance * along[axis]);
  return isWhole || axes.every((axis) => place[axis] < ROOM[axis]) ? [...place, ...first.normal] : undefined;
}
