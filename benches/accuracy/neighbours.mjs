// Exact nearest neighbours in plain JavaScript: a k-d tree, written without looking at that of the package.

/** A part of the tree with fewer points is searched point by point. */
const LEAF = 12;

/**
 * A function of a point and a number that answers the indices of so many nearest points, the nearest first; a point of
 * the cloud is its own nearest. The answer is overwritten by the next call. Every number must be finite.
 */
export function nearestNeighbours(positions) {
  const count = positions.length / 3;
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  const axes = new Uint8Array(count);
  split(positions, order, axes, 0, count);
  const sorted = new Float64Array(positions.length);
  order.forEach((from, to) => {
    for (let axis = 0; axis < 3; axis++) sorted[3 * to + axis] = positions[3 * from + axis];
  });

  let [x, y, z] = [0, 0, 0];
  const heap = new Heap(count);
  const visit = (i) =>
    heap.offer((sorted[3 * i] - x) ** 2 + (sorted[3 * i + 1] - y) ** 2 + (sorted[3 * i + 2] - z) ** 2, i);
  const search = (from, to) => {
    if (to - from <= LEAF) {
      for (let i = from; i < to; i++) visit(i);
      return;
    }
    const middle = (from + to) >> 1;
    const axis = axes[middle];
    const side = (axis === 0 ? x : axis === 1 ? y : z) - sorted[3 * middle + axis];
    if (side < 0) search(from, middle);
    else search(middle + 1, to);
    if (side * side > heap.limit()) return;
    visit(middle);
    if (side < 0) search(middle + 1, to);
    else search(from, middle);
  };
  return (point, wanted) => {
    [x, y, z] = point;
    heap.reset(Math.min(wanted, count));
    search(0, count);
    return heap.ascending().map((i) => order[i]);
  };
}

/** Puts the middle point of each part in its place, the lower ones before it. */
function split(positions, order, axes, from, to) {
  if (to - from <= LEAF) return;
  const [low, high] = [Array(3).fill(Infinity), Array(3).fill(-Infinity)];
  for (let i = from; i < to; i++) {
    for (let axis = 0; axis < 3; axis++) {
      const value = positions[3 * order[i] + axis];
      if (value < low[axis]) low[axis] = value;
      if (value > high[axis]) high[axis] = value;
    }
  }
  const sides = high.map((value, axis) => value - low[axis]);
  const axis = sides.indexOf(Math.max(...sides));
  const middle = (from + to) >> 1;
  select(order, (index) => positions[3 * index + axis], { from, to: to - 1, middle });
  axes[middle] = axis;
  split(positions, order, axes, from, middle);
  split(positions, order, axes, middle + 1, to);
}

/** Hoare's selection. */
function select(order, key, { from, to, middle }) {
  while (from < to) {
    const pivot = key(order[middle]);
    let [i, j] = [from, to];
    while (i <= j) {
      while (key(order[i]) < pivot) i++;
      while (key(order[j]) > pivot) j--;
      if (i > j) break;
      [order[i], order[j]] = [order[j], order[i]];
      i++;
      j--;
    }
    if (j < middle) from = i;
    if (i > middle) to = j;
  }
}

/** Keeps those of the smallest distances, the largest on top. */
class Heap {
  constructor(most) {
    this.distances = new Float64Array(most);
    this.items = new Uint32Array(most);
  }

  reset(wanted) {
    this.wanted = wanted;
    this.size = 0;
  }

  /** What is farther away is not wanted. */
  limit() {
    return this.size < this.wanted ? Infinity : this.distances[0];
  }

  offer(distance, item) {
    if (this.size < this.wanted) this.rise(this.size++, distance, item);
    else if (distance < this.distances[0]) this.sink(distance, item);
  }

  rise(at, distance, item) {
    while (at > 0) {
      const parent = (at - 1) >> 1;
      if (this.distances[parent] >= distance) break;
      this.put(at, this.distances[parent], this.items[parent]);
      at = parent;
    }
    this.put(at, distance, item);
  }

  sink(distance, item) {
    let at = 0;
    for (;;) {
      let child = 2 * at + 1;
      if (child >= this.size) break;
      if (child + 1 < this.size && this.distances[child + 1] > this.distances[child]) child++;
      if (this.distances[child] <= distance) break;
      this.put(at, this.distances[child], this.items[child]);
      at = child;
    }
    this.put(at, distance, item);
  }

  put(at, distance, item) {
    this.distances[at] = distance;
    this.items[at] = item;
  }

  /** Empties the heap from its top, into the places that it leaves. */
  ascending() {
    const all = this.size;
    while (this.size > 1) {
      const [distance, item] = [this.distances[0], this.items[0]];
      this.size--;
      this.sink(this.distances[this.size], this.items[this.size]);
      this.put(this.size, distance, item);
    }
    return this.items.subarray(0, all);
  }
}
