// Rays that meet the triangles of a mesh.

/** Triangles in a leaf, at most. */
const LEAF = 4;

/**
 * A search for the first triangle on a ray, as a function of its origin, its direction and the least distance. A balanced
 * tree of boxes: the children of node i are 2i and 2i + 1, and each has half of its triangles.
 */
export function rays(corners) {
  const count = corners.length / 9;
  const leaves = 2 ** Math.max(0, Math.ceil(Math.log2(count / LEAF)));
  const boxes = new Float64Array(12 * leaves);
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  /** Where the triangles of a node begin and end in the order. */
  const part = (node) => {
    const level = 2 ** (31 - Math.clz32(node));
    return [node - level, node - level + 1].map((i) => Math.floor((count * i) / level));
  };

  for (let node = 1; node < 2 * leaves; node++) {
    const [from, to] = part(node);
    const box = boxes.subarray(6 * node, 6 * node + 6);
    box.set([Infinity, Infinity, Infinity, -Infinity, -Infinity, -Infinity]);
    for (const triangle of order.subarray(from, to)) {
      for (let i = 0; i < 9; i++) {
        const [axis, value] = [i % 3, corners[9 * triangle + i]];
        if (value < box[axis]) box[axis] = value;
        if (value > box[3 + axis]) box[3 + axis] = value;
      }
    }
    if (node >= leaves) continue;
    const sides = [0, 1, 2].map((axis) => box[3 + axis] - box[axis]);
    const axis = sides.indexOf(Math.max(...sides));
    const middle = (triangle) =>
      corners[9 * triangle + axis] + corners[9 * triangle + 3 + axis] + corners[9 * triangle + 6 + axis];
    order.subarray(from, to).sort((a, b) => middle(a) - middle(b));
  }

  const inverse = new Float64Array(3);
  /** Where a ray enters the box of a node; infinite where it does not before `limit`. */
  const enters = (node, origin, limit) => {
    let [low, high] = [0, limit];
    for (let axis = 0; axis < 3; axis++) {
      const a = (boxes[6 * node + axis] - origin[axis]) * inverse[axis];
      const b = (boxes[6 * node + 3 + axis] - origin[axis]) * inverse[axis];
      if (a < b ? a > low : b > low) low = a < b ? a : b;
      if (a < b ? b < high : a < high) high = a < b ? b : a;
    }
    return low <= high ? low : Infinity;
  };

  const stack = new Uint32Array(64);
  return (origin, direction, least) => {
    for (let axis = 0; axis < 3; axis++) inverse[axis] = 1 / (direction[axis] || 1e-30);
    let best = Infinity;
    let depth = 0;
    stack[depth++] = 1;
    while (depth > 0) {
      const node = stack[--depth];
      if (enters(node, origin, best) === Infinity) continue;
      if (node >= leaves) {
        const [from, to] = part(node);
        for (let i = from; i < to; i++) {
          const distance = meets(corners, 9 * order[i], origin, direction);
          if (distance >= least && distance < best) best = distance;
        }
        continue;
      }
      const isFirstNearer = enters(2 * node, origin, best) <= enters(2 * node + 1, origin, best);
      stack[depth++] = isFirstNearer ? 2 * node + 1 : 2 * node;
      stack[depth++] = isFirstNearer ? 2 * node : 2 * node + 1;
    }
    return best;
  };
}

/** Where a ray meets a triangle, from either side; not a number where it does not. After Möller and Trumbore (1997). */
function meets(corners, at, [ox, oy, oz], [dx, dy, dz]) {
  const [x, y, z] = [corners[at], corners[at + 1], corners[at + 2]];
  const [ux, uy, uz] = [corners[at + 3] - x, corners[at + 4] - y, corners[at + 5] - z];
  const [vx, vy, vz] = [corners[at + 6] - x, corners[at + 7] - y, corners[at + 8] - z];
  const [px, py, pz] = [dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx];
  const determinant = ux * px + uy * py + uz * pz;
  const [tx, ty, tz] = [ox - x, oy - y, oz - z];
  const s = (tx * px + ty * py + tz * pz) / determinant;
  if (!(s >= 0 && s <= 1)) return NaN;
  const [qx, qy, qz] = [ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux];
  const t = (dx * qx + dy * qy + dz * qz) / determinant;
  return t >= 0 && s + t <= 1 ? (vx * qx + vy * qy + vz * qz) / determinant : NaN;
}
