// What anybody could reach: the signs of who knows the surface and how large the noise is, but of a noisy point only where it
// lies now.

/** Hardly a point lies farther off its place than so many deviations. */
const REACH = 4;
/** Normals count as one that are the same when rounded to so many steps to 1. */
const STEPS = 16;
/** A normal across a direction, by the cosine, is on neither side of it: rounding must not decide. */
const ACROSS = 1e-3;
/** Sides of more weight than the others: the best direction is looked for from each, and from the middle of any two. */
const STARTS = 12;
/** How often the direction is replaced by the mean of the sides that it met. */
const ROUNDS = 4;

/**
 * Answers for a place the direction whose side is most likely the right one for a point that was found there, one of a surface
 * with noise of a deviation. `positions` and `normals` are of points without noise, evenly spread, and so many that there are
 * many within a deviation. Each may be where the point comes from, with the weight that the normal distribution
 * gives to what lies between the two.
 */
export function likeliest({ positions, normals, deviation }) {
  const [reach, variance] = [REACH * deviation, deviation * deviation];
  const near = search(positions, reach);
  const { kinds, count } = alike(normals);
  const sums = new Float64Array(4 * count);
  return (place) => {
    const met = new Set();
    near(place, (j) => {
      let square = 0;
      for (let axis = 0; axis < 3; axis++) square += (positions[3 * j + axis] - place[axis]) ** 2;
      if (square > reach * reach) return;
      const weight = Math.exp(square / (-2 * variance));
      const kind = 4 * kinds[j];
      met.add(kind);
      sums[kind] += weight;
      for (let axis = 0; axis < 3; axis++) sums[kind + 1 + axis] += weight * normals[3 * j + axis];
    });
    const sides = [...met].map((kind) => {
      const [weight, x, y, z] = sums.subarray(kind, kind + 4);
      sums.fill(0, kind, kind + 4);
      return { weight, x, y, z };
    });
    return best(sides.sort((a, b) => b.weight - a.weight));
  };
}

/** The direction on whose side the most weight is. */
function best(sides) {
  const first = sides.slice(0, STARTS).map(({ x, y, z }) => unit([x, y, z]));
  const pairs = first.flatMap((a, i) => first.slice(0, i).map((b) => unit(a.map((value, axis) => value + b[axis]))));
  let [most, found] = [-1, [0, 0, 0]];
  for (const start of [mean(sides), ...first, ...pairs]) {
    let direction = start;
    for (let round = 0; round < ROUNDS; round++) {
      const along = ({ x, y, z }) => x * direction[0] + y * direction[1] + z * direction[2];
      const met = sides.filter((side) => along(side) > ACROSS * side.weight);
      const weight = met.reduce((sum, side) => sum + side.weight, 0);
      if (weight > most) [most, found] = [weight, direction];
      direction = mean(met);
    }
  }
  return found;
}

const mean = (sides) => unit(sides.reduce(([a, b, c], { x, y, z }) => [a + x, b + y, c + z], [0, 0, 0]));

/** A vector of length 1, or zero. */
function unit(vector) {
  const length = Math.hypot(...vector) || 1;
  return vector.map((value) => value / length);
}

/** For each normal the number of its kind, and how many kinds there are. */
function alike(normals) {
  const numbers = new Map();
  const kinds = Uint32Array.from({ length: normals.length / 3 }, (_, i) => {
    const [x, y, z] = normals.subarray(3 * i, 3 * i + 3).map((value) => Math.round(STEPS * value) + STEPS);
    const key = (64 * x + y) * 64 + z;
    if (!numbers.has(key)) numbers.set(key, numbers.size);
    return numbers.get(key);
  });
  return { kinds, count: numbers.size };
}

/** Calls `each` for a place with the number of every position in the cubes in and round it, of edges of a length. */
function search(positions, length) {
  const [cubes, SIDE] = [new Map(), 2 ** 17];
  const cubeOf = (place) => [0, 1, 2].map((axis) => Math.floor(place[axis] / length) + SIDE / 2);
  const key = (x, y, z) => (x * SIDE + y) * SIDE + z;
  for (let i = 0; i < positions.length / 3; i++) {
    const own = key(...cubeOf(positions.subarray(3 * i, 3 * i + 3)));
    if (!cubes.has(own)) cubes.set(own, []);
    cubes.get(own).push(i);
  }
  const steps = [-1, 0, 1];
  return (place, each) => {
    const [x, y, z] = cubeOf(place);
    for (const dx of steps)
      for (const dy of steps) for (const dz of steps) cubes.get(key(x + dx, y + dy, z + dz))?.forEach(each);
  };
}
