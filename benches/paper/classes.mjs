// From how many nodes each point is interpolated: 0 to 4, the paper's classes.
//
// The package's report only counts them. This tells them apart once more, in double precision and written for the eye,
// from the paper and docs/ARCHITECTURE.md; it shares no code with the estimator, and its counts have to be the report's.

/** A cloud's class for each point, for cubes of edge `cellSize` in a box of `grid` of them. Memory grows with the box. */
export function classes(positions, { grid, cellSize }) {
  const lowest = lowestCorner(positions);
  const place = (i, axis) => (positions[3 * i + axis] - lowest[axis]) / cellSize;
  const { cubes, cubeAt, ofPoint } = occupied(positions.length / 3, place, grid);

  const sums = new Float64Array(10 * cubes.length);
  ofPoint.forEach((cube, i) => {
    const [x, y, z] = cubes[cube];
    add(sums, 10 * cube, place(i, 0) - x - 0.5, place(i, 1) - y - 0.5, place(i, 2) - z - 0.5);
  });
  const nodes = cubes.map((cube) => node(cube, cubeAt, sums));
  const hasNode = (cube) => nodes[cubeAt(cube)]?.isGood;

  const result = new Uint8Array(ofPoint.length);
  const ofOctant = new Int8Array(8 * cubes.length).fill(-1);
  ofPoint.forEach((cube, i) => {
    const above = cubes[cube].map((index, axis) => place(i, axis) - index >= 0.5);
    const octant = 8 * cube + above[0] + 2 * above[1] + 4 * above[2];
    if (ofOctant[octant] < 0) ofOctant[octant] = columnsWithNode(cubes[cube], nodes[cube].axis, above, hasNode);
    result[i] = ofOctant[octant];
  });
  return result;
}

function lowestCorner(positions) {
  const lowest = [Infinity, Infinity, Infinity];
  for (let i = 0; i < positions.length; i++) lowest[i % 3] = Math.min(lowest[i % 3], positions[i]);
  return lowest;
}

/** The occupied cubes, each as three indices; the number of the cube at three indices, -1 if it is empty; that of each point. */
function occupied(count, place, [width, depth, height]) {
  const numbers = new Int32Array(width * depth * height).fill(-1);
  const cubes = [];
  const ofPoint = new Int32Array(count);
  const along = (i, axis, size) => Math.min(Math.floor(place(i, axis)), size - 1);
  for (let i = 0; i < count; i++) {
    const [x, y, z] = [along(i, 0, width), along(i, 1, depth), along(i, 2, height)];
    const at = x + width * (y + depth * z);
    if (numbers[at] < 0) numbers[at] = cubes.push([x, y, z]) - 1;
    ofPoint[i] = numbers[at];
  }
  const isInside = (x, y, z) => x >= 0 && x < width && y >= 0 && y < depth && z >= 0 && z < height;
  const cubeAt = ([x, y, z]) => (isInside(x, y, z) ? numbers[x + width * (y + depth * z)] : -1);
  return { cubes, cubeAt, ofPoint };
}

/** Adds a point to ten sums: count; x, y, z; xx, yy, zz; yz, xz, xy. */
function add(sums, at, x, y, z) {
  addShifted(sums.subarray(at, at + 10), [1, 0, 0, 0, 0, 0, 0, 0, 0, 0], x, y, z);
}

/** Of the points in a cube and the 26 round it: the axis in which the normal is largest, and whether the node is good. */
function node([i, j, k], cubeAt, sums) {
  const all = new Float64Array(10);
  for (let step = 0; step < 27; step++) {
    const [x, y, z] = [(step % 3) - 1, (Math.floor(step / 3) % 3) - 1, Math.floor(step / 9) - 1];
    const near = cubeAt([i + x, j + y, k + z]);
    if (near >= 0) addShifted(all, sums.subarray(10 * near, 10 * near + 10), x, y, z);
  }
  const mean = [1, 2, 3].map((at) => all[at] / all[0]);
  const [xx, yy, zz] = mean.map((value, axis) => all[4 + axis] / all[0] - value * value);
  const [yz, xz, xy] = [
    all[7] / all[0] - mean[1] * mean[2],
    all[8] / all[0] - mean[0] * mean[2],
    all[9] / all[0] - mean[0] * mean[1],
  ];
  const normal = all[0] < 3 ? undefined : planeNormal([xx, yy, zz], [yz, xz, xy]);
  if (!normal) return { isGood: false };
  const sizes = normal.map(Math.abs);
  const offset = normal.reduce((sum, value, axis) => sum + value * mean[axis], 0);
  return { axis: sizes.indexOf(Math.max(...sizes)), isGood: Math.max(...sizes) * Math.abs(offset) <= 0.5 };
}

/** Adds the sums of a cube that lies some whole cubes away. */
function addShifted(all, [n, sx, sy, sz, xx, yy, zz, yz, xz, xy], x, y, z) {
  all[0] += n;
  all[1] += sx + n * x;
  all[2] += sy + n * y;
  all[3] += sz + n * z;
  all[4] += xx + 2 * x * sx + n * x * x;
  all[5] += yy + 2 * y * sy + n * y * y;
  all[6] += zz + 2 * z * sz + n * z * z;
  all[7] += yz + y * sz + z * sy + n * y * z;
  all[8] += xz + x * sz + z * sx + n * x * z;
  all[9] += xy + x * sy + y * sx + n * x * y;
}

/** A second eigenvalue below this, in square edges and against the first, is a line. */
const LINE = 1e-6;

/** The unit eigenvector of the smallest eigenvalue of a symmetric matrix, by the closed form; none for a line. */
function planeNormal([xx, yy, zz], [yz, xz, xy]) {
  const mean = (xx + yy + zz) / 3;
  const [x, y, z] = [xx - mean, yy - mean, zz - mean];
  const size = Math.sqrt((x * x + y * y + z * z + 2 * (yz * yz + xz * xz + xy * xy)) / 6);
  const determinant = x * (y * z - yz * yz) - xy * (xy * z - yz * xz) + xz * (xy * yz - y * xz);
  const turn = Math.acos(Math.max(-1, Math.min(1, determinant / 2 / size ** 3))) / 3;
  const largest = 2 * size * Math.cos(turn);
  const smallest = 2 * size * Math.cos(turn + (2 * Math.PI) / 3);
  const middle = mean - largest - smallest;
  if (middle <= LINE * Math.max(1, mean + largest)) return undefined;

  // The rows of the matrix less the eigenvalue lie across its vector; the longest of their products is the safest.
  const rows = [
    [x - smallest, xy, xz],
    [xy, y - smallest, yz],
    [xz, yz, z - smallest],
  ];
  const products = [cross(rows[0], rows[1]), cross(rows[1], rows[2]), cross(rows[2], rows[0])];
  const lengths = products.map((product) => Math.hypot(...product));
  const longest = lengths.indexOf(Math.max(...lengths));
  return products[longest].map((value) => value / lengths[longest]);
}

const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];

/** In how many of the four columns of the 2x2x2 cubes on a point's side there is a good node. */
function columnsWithNode(cube, axis, above, isGood) {
  if (axis === undefined) return 0;
  const side = (along) => (above[along] ? 1 : -1);
  const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
  let columns = 0;
  for (const [stepU, stepV] of [
    [0, 0],
    [side(u), 0],
    [0, side(v)],
    [side(u), side(v)],
  ]) {
    const at = [...cube];
    at[u] += stepU;
    at[v] += stepV;
    const beside = [...at];
    beside[axis] += side(axis);
    columns += isGood(at) || isGood(beside) ? 1 : 0;
  }
  return columns;
}
