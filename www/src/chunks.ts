// The points of a cloud on the graphics card: in buffers of some million points each, because browsers refuse one of more
// than a gigabyte, and if the card has no memory for all, an even part of them.
import { BufferAttribute, BufferGeometry, Group, Points, Sphere, Vector3, type Material } from 'three';
import { spread } from './spread';

export interface Chunks {
  /** What holds the points, in the coordinates of the cloud. */
  readonly group: Group;
  /** How many points can be drawn: all, or after `limit` fewer. */
  readonly count: number;
  /** New values of an attribute: so many numbers for each point of the cloud, kept until the next ones. */
  set(name: string, values: Values, size: number): void;
  has(name: string): boolean;
  /** The attribute that is drawn as colour, if any. */
  colorBy(name: string | undefined): void;
  /** From now on the points are these of those that can be drawn. */
  drawRange(first: number, end: number): void;
  /** From now on they are so many at the most, spread evenly over all; answers how many. */
  drawSpread(most: number): number;
  /** Gives the card back what it holds, and from now on so many points at the most, spread evenly over all. */
  limit(most: number): void;
  dispose(): void;
}

type Values = Float32Array | Uint8Array;

/** Points of the cloud in one set of buffers. */
interface Part {
  points: Points;
  /** Which they are: `order`, or else from `first` to `end`. */
  order: Uint32Array | undefined;
  first: number;
  end: number;
}

/** Points of one chunk. */
const CHUNK = 3_000_000;
/** Clouds of more points can be drawn spread, by as many points as here at the most. */
export const SPARSE_FROM = 200_000;
export const SPARSE_MOST = 2_000_000;

/** `positions`: x0 y0 z0 x1 ...; `reach`: how far from `centre` any of them is. */
export function createChunks(
  positions: Float32Array,
  material: Material,
  { centre, reach }: { centre: readonly [number, number, number]; reach: number },
): Chunks {
  const all = positions.length / 3;
  const group = new Group();
  const attributes = new Map<string, { values: Values; size: number }>();
  const sphere = new Sphere(new Vector3(...centre), reach);
  let colors: string | undefined;
  let count = all;
  let chunks: Part[] = [];
  /** Of several chunks: points spread over all of them, so that no picture has to wait for all. */
  let sparse: Part | undefined;
  /** Of a single one: the same by indices. Every beginning of it is spread evenly. */
  let index: BufferAttribute | undefined;

  const parts = () => (sparse ? [...chunks, sparse] : chunks);

  function build(): void {
    const chosen = count < all ? spread(all, count) : undefined;
    for (let first = 0; first < count; first += CHUNK) {
      const end = Math.min(count, first + CHUNK);
      chunks.push(partOf(chosen?.subarray(first, end), first, end));
    }
    if (chunks.length > 1) sparse = partOf(chosen?.subarray(0, SPARSE_MOST) ?? spread(all, SPARSE_MOST));
    else if (count > SPARSE_FROM) index = new BufferAttribute(spread(count, Math.min(count, SPARSE_MOST)), 1);
    for (const [name, { values, size }] of attributes) fill(name, values, size);
    chooseColors();
  }

  function partOf(order: Uint32Array | undefined, first = 0, end = 0): Part {
    const points = new Points(new BufferGeometry(), material);
    // Bounds come from finite points only; three's own would turn into NaN.
    points.geometry.boundingSphere = sphere;
    points.frustumCulled = false;
    group.add(points);
    return { points, order, first, end };
  }

  function fill(name: string, values: Values, size: number): void {
    for (const { points, order, first, end } of parts()) {
      const own = order ? pick(values, size, order) : values.subarray(size * first, size * end);
      const before = points.geometry.getAttribute(name);
      if (before instanceof BufferAttribute) {
        // Into the buffer that it has on the card.
        before.array = own;
        before.needsUpdate = true;
      } else {
        points.geometry.setAttribute(name, new BufferAttribute(own, size, own instanceof Uint8Array));
      }
    }
  }

  function chooseColors(): void {
    for (const { geometry } of parts().map(({ points }) => points)) {
      if (colors === undefined) geometry.deleteAttribute('color');
      else geometry.setAttribute('color', geometry.getAttribute(colors));
    }
  }

  function draw({ points }: Part, first: number, end: number, by?: BufferAttribute): void {
    points.visible = first < end;
    points.geometry.setIndex(by ?? null);
    points.geometry.setDrawRange(first, end - first);
  }

  function dispose(): void {
    // With the indices, which are not always drawn by.
    for (const { points } of parts()) points.geometry.setIndex(index ?? null).dispose();
    group.clear();
    chunks = [];
    sparse = index = undefined;
  }

  attributes.set('position', { values: positions, size: 3 });
  build();
  return {
    group,
    get count() {
      return count;
    },
    set(name, values, size) {
      attributes.set(name, { values, size });
      fill(name, values, size);
    },
    has: (name) => attributes.has(name),
    colorBy(name) {
      colors = name;
      chooseColors();
    },
    drawRange(first, end) {
      for (const chunk of chunks)
        draw(chunk, Math.max(first, chunk.first) - chunk.first, Math.min(end, chunk.end) - chunk.first);
      if (sparse) draw(sparse, 0, 0);
    },
    drawSpread(most) {
      // Few points are always drawn whole.
      const some = sparse || index ? Math.min(count, most, SPARSE_MOST) : count;
      for (const chunk of chunks) draw(chunk, 0, sparse ? 0 : some, some < count ? index : undefined);
      if (sparse) draw(sparse, 0, some);
      return some;
    },
    limit(most) {
      dispose();
      count = Math.min(all, most);
      build();
    },
    dispose,
  };
}

/** The values of these points. */
function pick(values: Values, size: number, points: Uint32Array): Values {
  const picked =
    values instanceof Uint8Array ? new Uint8Array(size * points.length) : new Float32Array(size * points.length);
  for (let i = 0; i < points.length; i++) {
    for (let k = 0; k < size; k++) picked[size * i + k] = values[size * points[i]! + k]!;
  }
  return picked;
}
