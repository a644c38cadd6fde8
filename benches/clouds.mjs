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

/** The same points in Morton order, 10 bits an axis: neighbours in space are neighbours in memory. */
export function sorted(points) {
  const count = points.length / 3;
  const spread = (value) => {
    value = (value | (value << 16)) & 0x030000ff;
    value = (value | (value << 8)) & 0x0300f00f;
    value = (value | (value << 4)) & 0x030c30c3;
    return (value | (value << 2)) & 0x09249249;
  };
  const place = (coordinate) => spread(Math.min(1023, Math.floor((coordinate + 1) * 512)));
  const keys = new Float64Array(count);
  for (let i = 0; i < count; i++) {
    const code = place(points[3 * i]) + 2 * place(points[3 * i + 1]) + 4 * place(points[3 * i + 2]);
    keys[i] = code * 2 ** 23 + i;
  }
  keys.sort();
  const result = new Float32Array(points.length);
  keys.forEach((key, to) => {
    const from = key % 2 ** 23;
    result.set(points.subarray(3 * from, 3 * from + 3), 3 * to);
  });
  return result;
}

/** Seeded numbers in 0 to 1 (Mulberry32, Tommy Ettinger, public domain). */
function mulberry(state) {
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}
