// The sample scan: a spiny sea shell on a fluted plinth, sampled evenly by area and written as PLY bytes, so that it
// takes the same path as a file that a person drops. Seeded: the same bytes on every machine and every run.

type Vector = [number, number, number];
type Surface = (u: number, v: number, out: Vector) => void;

/** The bytes of a binary PLY of `points` points with colours, y upwards, in metres. */
export function sampleScan(points: number, seed = 7): Uint8Array<ArrayBuffer> {
  const random = mulberry32(seed);
  const header = new TextEncoder().encode(
    [
      'ply',
      'format binary_little_endian 1.0',
      'comment a sea shell on a plinth, made by the page itself',
      `element vertex ${points}`,
      ...['x', 'y', 'z'].map((name) => `property float ${name}`),
      ...['red', 'green', 'blue'].map((name) => `property uchar ${name}`),
      'end_header\n',
    ].join('\n'),
  );
  const bytes = new Uint8Array(header.length + points * 15);
  bytes.set(header);
  const view = new DataView(bytes.buffer);
  const shell = sampler(shellSurface, shellRow, random);
  const plinth = sampler(plinthSurface, (u) => u, random);
  const shellPoints = Math.round((points * shell.area) / (shell.area + plinth.area));
  const position: Vector = [0, 0, 0];
  const color: Vector = [0, 0, 0];
  for (let i = 0, at = header.length; i < points; i++, at += 15) {
    const [u, v] = (i < shellPoints ? shell : plinth).draw(position);
    (i < shellPoints ? shellColor : plinthColor)(u, v, color);
    for (let axis = 0; axis < 3; axis++) {
      // A scanner's noise: 30 micrometres on a thing of 40 centimetres.
      view.setFloat32(at + axis * 4, position[axis]! + 3e-5 * (random() + random() - 1), true);
      bytes[at + 12 + axis] = 255 * Math.min(1, color[axis]! * (0.97 + 0.06 * random()));
    }
  }
  return bytes;
}

// The shell: a tube along a logarithmic spiral down a cone.
const TURNS = 5.96;
const GROWTH = Math.log(1.72) / (2 * Math.PI);
const END = TURNS * 2 * Math.PI;
const SLOPE = 2.1;
const SIZE = 0.098;
const TOP = 0.362;

const angleOf = (u: number) => Math.log(1 + u * (Math.exp(2 * GROWTH * END) - 1)) / (2 * GROWTH);

/** Area grows with the square of the radius: equal steps of u are to be equal areas. */
function shellRow(u: number): number {
  return angleOf(u) / END;
}

function shellSurface(u: number, v: number, out: Vector): void {
  const turn = u * END;
  const radius = SIZE * Math.exp(GROWTH * (turn - END));
  const around = v * 2 * Math.PI;
  const rib = Math.max(0, Math.cos(turn * 5.5));
  const spine = 0.34 * rib ** 8 * Math.exp(-(((around - 0.55) / 0.24) ** 2));
  const cords = 0.018 * Math.cos(22 * around) * (1 - rib ** 4);
  const lip = 0.22 * Math.exp(-(((turn - END) / 0.35) ** 2));
  const tube = radius * 0.69 * (1 + 0.09 * rib ** 3 + cords + spine + lip);
  const across = radius + tube * Math.cos(around);
  out[0] = across * Math.cos(turn);
  out[1] = TOP - radius * SLOPE + tube * 1.12 * Math.sin(around);
  out[2] = across * Math.sin(turn);
}

function shellColor(u: number, v: number, out: Vector): void {
  const turn = u * END;
  const around = v * 2 * Math.PI;
  const wave = Math.sin(turn * 11 + 2.2 * Math.sin(around * 2)) * 0.5 + 0.5;
  const band = wave ** 2 * (0.45 + 0.55 * Math.cos(around * 3) ** 2);
  mix([0.95, 0.89, 0.8], [0.71, 0.36, 0.2], band, out);
}

// The plinth: a profile turned round the y axis, [radius, height] from the middle of the top down to that of the foot.
const PROFILE: [number, number][] = [
  [0, 0.06],
  [0.139, 0.06],
  [0.144, 0.055],
  [0.144, 0.049],
  [0.137, 0.042],
  [0.137, 0.014],
  [0.147, 0.008],
  [0.15, 0.004],
  [0.15, 0],
  [0, 0],
];
const FLUTES = 36;

function plinthSurface(u: number, v: number, out: Vector): void {
  const at = Math.min(PROFILE.length - 1 - 1e-9, u * (PROFILE.length - 1));
  const [r0, y0] = PROFILE[Math.floor(at)]!;
  const [r1, y1] = PROFILE[Math.floor(at) + 1]!;
  const along = at % 1;
  const turn = v * 2 * Math.PI;
  const height = y0 + (y1 - y0) * along;
  let radius = r0 + (r1 - r0) * along;
  const drum = smooth(0.014, 0.018, height) * (1 - smooth(0.038, 0.042, height));
  radius -= 0.005 * drum * Math.abs(Math.sin((turn * FLUTES) / 2));
  out[0] = radius * Math.cos(turn);
  out[1] = height;
  out[2] = radius * Math.sin(turn);
}

function plinthColor(u: number, v: number, out: Vector): void {
  const vein = Math.sin(u * 37 + 3 * Math.sin(v * 19)) * Math.sin(v * 41 + 2 * Math.sin(u * 23));
  mix([0.36, 0.42, 0.45], [0.62, 0.67, 0.68], smooth(0.2, 1, vein), out);
}

/**
 * Draws points evenly by area from a surface over the unit square: cells of a table get their share of the points by
 * their measured area. `row` maps equal steps to rows of roughly equal area, so that the table is fine where it matters.
 */
function sampler(surface: Surface, row: (u: number) => number, random: () => number) {
  const rows = 512;
  const columns = 192;
  const below = new Float64Array(rows * columns);
  const corners = new Float64Array((columns + 1) * 6);
  const point: Vector = [0, 0, 0];
  let total = 0;
  for (let i = 0; i <= rows; i++) {
    for (let j = 0; j <= columns; j++) {
      corners.copyWithin(j * 6, j * 6 + 3, j * 6 + 6);
      surface(row(i / rows), j / columns, point);
      corners.set(point, j * 6 + 3);
      if (i === 0 || j === 0) continue;
      total += area(corners, (j - 1) * 6);
      below[(i - 1) * columns + j - 1] = total;
    }
  }
  const draw = (out: Vector): [number, number] => {
    const wanted = random() * total;
    let low = 0;
    let high = below.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (below[middle]! < wanted) low = middle + 1;
      else high = middle;
    }
    const u = row((Math.floor(low / columns) + random()) / rows);
    const v = ((low % columns) + random()) / columns;
    surface(u, v, out);
    return [u, v];
  };
  return { area: total, draw };
}

/** Area of a cell from two adjacent corner records of [upper, lower] points: half the cross product of its diagonals. */
function area(corners: Float64Array, at: number): number {
  const diagonal = (from: number, to: number, axis: number) => corners[at + to + axis]! - corners[at + from + axis]!;
  const [ax, ay, az] = [diagonal(0, 9, 0), diagonal(0, 9, 1), diagonal(0, 9, 2)];
  const [bx, by, bz] = [diagonal(3, 6, 0), diagonal(3, 6, 1), diagonal(3, 6, 2)];
  return Math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx) / 2;
}

function smooth(from: number, to: number, value: number): number {
  const t = Math.min(1, Math.max(0, (value - from) / (to - from)));
  return t * t * (3 - 2 * t);
}

function mix(a: Vector, b: Vector, share: number, out: Vector): void {
  for (let axis = 0; axis < 3; axis++) out[axis] = a[axis]! + (b[axis]! - a[axis]!) * share;
}

/** A small generator of 32 bits of state (Tommy Ettinger's mulberry32): numbers in [0, 1). */
function mulberry32(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let bits = Math.imul(state ^ (state >>> 15), state | 1);
    bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
    return ((bits ^ (bits >>> 14)) >>> 0) / 4294967296;
  };
}
