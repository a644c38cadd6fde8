// The clouds of the benchmarks: generated, seeded.

/** Points evenly spread over the unit sphere, in random order. */
export function sphere(count) {
  const points = new Float32Array(3 * count);
  const random = mulberry(1);
  for (let i = 0; i < 3 * count; i += 3) {
    const z = 2 * random() - 1;
    const turn = 2 * Math.PI * random();
    const ring = Math.sqrt(1 - z * z);
    points[i] = ring * Math.cos(turn);
    points[i + 1] = ring * Math.sin(turn);
    points[i + 2] = z;
  }
  return points;
}

/** The same points, at most 2^26, in Morton order, 9 bits an axis: neighbours in space are neighbours in memory. */
export function sorted(points) {
  const count = points.length / 3;
  const spread = (value) => {
    value = (value | (value << 16)) & 0x030000ff;
    value = (value | (value << 8)) & 0x0300f00f;
    value = (value | (value << 4)) & 0x030c30c3;
    return (value | (value << 2)) & 0x09249249;
  };
  const place = (coordinate) => spread(Math.min(511, Math.floor((coordinate + 1) * 256)));
  const keys = new Float64Array(count);
  for (let i = 0; i < count; i++) {
    const code = place(points[3 * i]) + 2 * place(points[3 * i + 1]) + 4 * place(points[3 * i + 2]);
    keys[i] = code * 2 ** 26 + i;
  }
  keys.sort();
  const result = new Float32Array(points.length);
  keys.forEach((key, to) => {
    const from = key % 2 ** 26;
    result.set(points.subarray(3 * from, 3 * from + 3), 3 * to);
  });
  return result;
}

/** The box of the free-form patch. */
const PATCH = [376, 314, 93];

/**
 * An oval patch of an undulating surface with sharp changes: a ridge, a plateau with a steep edge, a groove, ripples.
 * Its points are evenly spread and in random order; its box has the sides 376, 314 and 93. Also the true normals, of
 * length one.
 */
export function freeForm(count) {
  const [positions, normals] = [new Float32Array(3 * count), new Float32Array(3 * count)];
  const random = mulberry(2);
  for (let at = 0; at < 3 * count;) {
    const [x, y] = [PATCH[0] * (random() - 0.5), PATCH[1] * (random() - 0.5)];
    if (!isInPatch(x, y)) continue;
    const [slopeX, slopeY] = [slope(x, y, STEP, 0), slope(x, y, 0, STEP)];
    const area = Math.sqrt(1 + slopeX * slopeX + slopeY * slopeY);
    // A steep part has more area above the same ground, so more points.
    if (random() * STEEPEST > area) continue;
    positions.set([x, y, HEIGHT * relief(x, y)], at);
    normals.set([-slopeX / area, -slopeY / area, 1 / area], at);
    at += 3;
  }
  return { positions, normals };
}

const isInPatch = (x, y) => Math.abs((2 * x) / PATCH[0]) ** 2 + Math.abs((2 * y) / PATCH[1]) ** 2 < 1;
/** No point of the patch has more area above a unit of ground. */
const STEEPEST = 5;

function relief(x, y) {
  const waves = 17 * Math.sin(x / 53 + 0.4) * Math.cos(y / 46) + 9 * Math.sin((x + 1.7 * y) / 71);
  const ridge = 24 * Math.exp(-Math.abs(x - 70 - 22 * Math.sin(y / 38)) / 13);
  const plateau = 13 / (1 + Math.exp((Math.hypot(x + 84, (y - 42) * 1.25) - 46) / 1.1));
  const groove = -9 * Math.exp(-(((y + 88 + 14 * Math.sin(x / 31)) / 4.5) ** 2));
  const ripples = 1.6 * Math.sin(x / 2.6) * Math.exp(-(((x + 60) / 44) ** 2) - ((y + 35) / 30) ** 2);
  return waves + ridge + plateau + groove + ripples;
}

const STEP = 1e-5;
const slope = (x, y, dx, dy) => (HEIGHT * (relief(x + dx, y + dy) - relief(x - dx, y - dy))) / (2 * STEP);

/** Makes the patch as high as its box. */
const HEIGHT = PATCH[2] / reliefRange();

function reliefRange() {
  let [low, high] = [Infinity, -Infinity];
  for (let x = -PATCH[0] / 2; x <= PATCH[0] / 2; x += 0.5) {
    for (let y = -PATCH[1] / 2; y <= PATCH[1] / 2; y += 0.5) {
      if (!isInPatch(x, y)) continue;
      low = Math.min(low, relief(x, y));
      high = Math.max(high, relief(x, y));
    }
  }
  return high - low;
}

/** Seeded numbers in 0 to 1 (Mulberry32, Tommy Ettinger, public domain). */
export function mulberry(state) {
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
