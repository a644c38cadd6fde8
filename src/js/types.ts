/**
 * `x0 y0 z0 x1 ...` in any unit; another length than a multiple of 3 is an `input` error. Views of a part of a buffer and of
 * shared memory are accepted.
 */
export type Positions = Float32Array | Float64Array;

// Arrays that own plain, not shared memory, as Blobs and `postMessage` want them. Before TypeScript 5.7 no type says so.
type Floats = ReturnType<typeof Float32Array.of>;
type Wholes = ReturnType<typeof Uint32Array.of>;
type Bytes = ReturnType<typeof Uint8Array.of>;

/**
 * Where bytes come from: a File or another Blob (streamed into the worker, never whole in JavaScript memory), bytes
 * (copied), or a URL or Response (downloaded; in Node, `file:` URLs too). Anything else, an answer that is no success, and what
 * breaks off or cannot be read is an `input` error.
 */
export type Source = Blob | ArrayBuffer | Uint8Array | URL | Response;

/** How far a call has come: `fraction` rises from 0 to 1 over the whole call. */
export interface Progress {
  phase: string;
  fraction: number;
}

/** Whatever is not as described here, a name that is not here, and a value that JSON cannot hold is an `input` error. */
export interface EstimateOptions {
  /**
   * Default `'bilinear'`: surfaces on a grid of cubes, with cubes of one size the paper's method. The others are its
   * baselines, eight to sixty times as slow as cubes of one size: `'knn'` fits a plane to the k nearest points, `'egg'` a
   * curved surface to the neighbours in the elliptic Gabriel graph. Time grows with k for `'knn'`, with its square for `'egg'`.
   */
  method?: 'bilinear' | 'knn' | 'egg';
  /**
   * Size of the cubes of `'bilinear'`. Default `'auto'`: every place takes the size that its noise and its detail allow, and
   * edges stay sharp. With one size for all the method is exactly the paper's: `scale`, the edge in multiples of the
   * paper's L (Eq. 1), 0.1 to 100; `size`, in the units of the input, above 0. Small cubes follow detail, large ones average
   * noise away.
   */
  cell?: 'auto' | { scale: number } | { size: number };
  /**
   * How many of the nearest points, a whole number from 3 to 4294967295; if there are fewer, all. For `'knn'` with the point
   * itself (default 16), for `'egg'` as candidates besides it (default 8).
   */
  k?: number;
  /**
   * How signs are chosen. Default `'none'`: `x + 2y + 4z >= 0`, deterministic and nothing more. `'consistent'`: one
   * sign for each connected surface, outwards if it is closed, else towards what stands before it; if nothing does, as
   * what it touches, or away from its middle, and if it is flat `x + 2y + 4z >= 0` for its mean normal; what one
   * scanner saw from one place, or a few from amid it, faces them. `'outward'`: the same, but never to what stands
   * before it, nor to a scanner: for objects, also with holes. Both also average normals, with `cell: 'auto'`, where
   * surfaces face apart within the noise, as at edges and on rods, and without noise give the narrow sides of ribs and
   * grooves the planes that their points lie on, and points next to edges the normals of their faces: elsewhere only
   * signs change. `viewpoint`: towards a position, in the coordinates of `positions`. `up`: towards a direction of any
   * length but 0, for terrain. Both are arrays of three finite numbers.
   */
  orient?:
    'none' | 'consistent' | 'outward' | { viewpoint: [number, number, number] } | { up: [number, number, number] };
  /** Also return `curvature`, 4 bytes a point. Default false. */
  curvature?: boolean;
  /** Also return `components`, 4 bytes a point, with `orient: 'consistent'` or `'outward'`. Default false. */
  components?: boolean;
  /**
   * Default false: the positions are copied when the call is made. True: their buffer is handed over and detached, when the
   * call's turn has come and its options have passed. A call that is refused for its arguments, that is stopped while it
   * waits, or whose worker does not start leaves it as it was; one that is stopped later, or for which memory does not
   * suffice, does not. Until the call has ended the positions must not change. A view of a part of a buffer, or of shared or
   * resizable memory, is copied at that moment: the rest is not the call's to take.
   */
  transfer?: boolean;
  /** Hears a fraction that rises from 0 to exactly 1. What it throws stops the call, which rejects with it. */
  onProgress?: (progress: Progress) => void;
  /** Rejects the call with `signal.reason`, at once; the estimator stays usable. */
  signal?: AbortSignal;
}

export interface EstimateResult {
  /**
   * Unit length, or zero where a point is not finite or has no neighbours that tell a plane: none, or all along a line or in
   * one place; as many numbers as `positions`.
   */
  normals: Floats;
  /**
   * If asked for, the surface variation lambda3 / (lambda1 + lambda2 + lambda3) (Pauly, Gross and Kobbelt 2002), one
   * number a point: 0 where the neighbourhood is flat, up to 1/3 where it has no direction; 0 for unresolved points too.
   * Its square root grows about as the curvature of the surface times the size of the neighbourhood: for `'bilinear'`
   * the cubes round the point, with `cell: 'auto'` those that were chosen for its cube; for `'knn'` and `'egg'` the k
   * nearest points.
   */
  curvature?: Floats;
  /**
   * If asked for, the surface that each point belongs to: its place among `report.components.largest`, 0 for the largest, and
   * so on beyond the end of that list; 4294967295 for unresolved points, and for strays too far from the others to count.
   */
  components?: Wholes;
  report: Report;
}

export interface Report {
  points: number;
  /** Points that got the zero vector. */
  unresolved: number;
  /** Occupied cubes. This and all about cubes and nodes is 0 for the baselines, which have none. */
  cells: number;
  /** Cubes with a valid node; with `cell: 'auto'`, with a surface. */
  nodes: number;
  /** Cubes along each axis, at most 2^30; with `cell: 'auto'` along axes of the cloud's own, at most 2^22. */
  grid: [number, number, number];
  /**
   * Edge of the cubes in the units of the input, at most twice the longest side of the cloud, because larger ones hold the
   * same; with `cell: 'auto'`, of those that it begins with.
   */
  cellSize: number;
  /** Edge of the cubes in multiples of the paper's L. */
  scale: number;
  /**
   * How far the points lie off the surfaces that were chosen for them, in the units of the input: the deviation that half
   * of them do not exceed, to 2 %; 0 if there is no surface. No less than coordinates are off by that were
   * rounded to more than a sixth of the spacing. Only with `cell: 'auto'`.
   */
  noise?: number;
  /**
   * The sizes of the neighbourhoods that `cell: 'auto'` chose, the smallest first, and how many points took each. A
   * neighbourhood is 27 cubes of edge `cellSize`.
   */
  scales?: { cellSize: number; points: number }[];
  /** Points interpolated from 0, 1, 2, 3 and 4 nodes; all from 0 for the baselines and with `cell: 'auto'`. */
  nodesUsed: [number, number, number, number, number];
  /**
   * The surfaces that were given one sign each: how many there are, and at most the thousand largest, the largest
   * first. `side` tells by what: `'air'`, because the surface is closed, and one side sees much more of the open air;
   * `'volume'`, away from the middle of what is open or hidden, or, of what is long and thin, from the middles of its
   * pieces; `'touch'`, as a surface that it touches and that the air told, or that was told so; `'sight'`, because
   * other surfaces, or its own parts, stand before that side; `'view'`, because the cloud is what a scanner saw from
   * that side, or one or a few from amid the surfaces (both by `'consistent'` only); `'convention'`, because it is
   * open and flat, so that nothing tells: the mean normal has `x + 2y + 4z >= 0`, where all was seen from one side
   * that of all surfaces. `confidence`, from 0, a guess, to 1, which is sure: of all that is seen of the open, how
   * much more is seen from one side; for what sees nothing of it how much volume there is, of that of a sphere, or of
   * its pieces; by touch, half of how much more evidence speaks for that side, of all and of what is needed; by sight,
   * half of how much more looks at that side, of all that does; by view, up to a half, or from amid the surfaces how
   * well their densities tell where scanners stood.
   * Only with `orient: 'consistent'` and `'outward'`.
   */
  components?: {
    count: number;
    largest: {
      points: number;
      side: 'air' | 'volume' | 'touch' | 'sight' | 'view' | 'convention';
      confidence: number;
    }[];
  };
  /**
   * Each phase in the wasm module, and `total`: from the moment the call left the queue to its result in the calling
   * thread, so with the start of the worker if this call needed one, and with copying in and out.
   */
  milliseconds: { total: number; [phase: string]: number };
  mode: 'threads' | 'single';
  threads: number;
  /** Why there are no threads. */
  fallbackReason?: string;
  /** Most wasm memory in use at once during the call. */
  peakBytes: number;
}

/** With types of arrays: those that come from `readPointCloud` own plain memory, those for `writePly` may be any. */
export interface PointCloud<F extends Float32Array = Floats, B extends Uint8Array = Bytes> {
  count: number;
  /** Relative to `origin`: add it to get the file's coordinates. */
  positions: F;
  /** `[0, 0, 0]` unless the file's coordinates need more digits than single precision has. */
  origin: [number, number, number];
  normals?: F;
  /** Red, green, blue, alpha of each point. */
  colors?: B;
  intensity?: F;
  source: {
    format: string;
    properties: string[];
    comments: string[];
    /**
     * Where the scanner stood, in the file's coordinates: `view_px view_py view_pz` of its element `camera`, as MeshLab and PCL
     * write it. Less `origin` it is a viewpoint for `orient`.
     */
    viewpoint?: [number, number, number];
  };
}

/** Of reading. Another name, and what is not as described here, is an `input` error. */
export interface ReadOptions {
  /** Rejects the call with `signal.reason`, at once, and stops a download; the estimator stays usable. */
  signal?: AbortSignal;
  /** Hears a fraction that rises from 0 to exactly 1. What it throws stops the call, which rejects with it. */
  onProgress?: (progress: Progress) => void;
  /**
   * Refuses a file that declares more points, before memory is taken for them (`input`). A whole number of at least 0; default:
   * as many as fit.
   */
  maxPoints?: number;
}

/**
 * What a file gains: `normals` as nx ny nz, three numbers a point; `curvature` one number a point. Another number of numbers,
 * or another name, is an `input` error; but a whole `EstimateResult` may come, of which these are written.
 */
export interface Additions {
  normals?: Float32Array | undefined;
  curvature?: Float32Array | undefined;
}

/** Of writing. Another name, and what is not as described here, is an `input` error. */
export interface WriteOptions {
  /** Default `'binary_little_endian'`. Either keeps every number to its last digit. */
  format?: 'binary_little_endian' | 'ascii';
  /** As in `ReadOptions`. */
  signal?: AbortSignal;
  /** As in `ReadOptions`. */
  onProgress?: (progress: Progress) => void;
}

/** Another name, and what is not as described here, is an `input` error. */
export interface EstimatorOptions {
  /**
   * 1 to 256 for each of the two workers; 1 is the single-threaded build. Default `'auto'`: one for each processor, at most
   * 16.
   */
  threads?: number | 'auto';
  /**
   * A folder that holds `single.wasm` and `threads.wasm`, and for all but reading and the default options also
   * `single-full.wasm` and `threads-full.wasm` (this package exports them under these names), for those who host them
   * themselves. A relative address counts from the page; in Node, from the working directory. A query goes to each file.
   */
  wasmUrl?: string | URL;
  /** Most memory that either wasm module may take, 16 to 4096. Default 4096, or the most that the engine grants. */
  memoryMaxMiB?: number;
}

export interface Features {
  /** Whether calls run on threads; without, they do the same on one, to the same bit. */
  threads: boolean;
  /** Whether the engine has the vectors of WebAssembly. Without, every call but this rejects (`unsupported`). */
  simd: boolean;
  /** Whether memory may be shared between threads. Node needs no isolation for that: true there. */
  crossOriginIsolated: boolean;
  /** Why there are no threads, or no SIMD. */
  reason?: string;
}

/**
 * Calls wait for each other; each has its own progress and abort. What needs the full module (see `wasmUrl`) has a worker and
 * a queue of its own: such a call and one of the others may run at once.
 *
 * Every call rejects with a `BilinormalError`, or with `signal.reason`, or with what `onProgress` throws. Codes that all have:
 * `input`, the arguments, or the estimator was disposed; `limit`, memory does not suffice, or wasm broke for want of it: then the
 * next call starts with a new worker; `unsupported`, no SIMD, or the package's own files did not load.
 */
export interface Estimator {
  /**
   * One normal for each point, and what else the options ask for. Memory: at least 28 bytes a point, 40 if signs need
   * positions; it is refused beforehand if that is not to be had (`limit`).
   */
  estimateNormals(positions: Positions, options?: EstimateOptions): Promise<EstimateResult>;
  /** The points of a PLY file in any of its three formats; also `format`: the file is none, or broken (`line` or `byte`). */
  readPointCloud(source: Source, options?: ReadOptions): Promise<PointCloud>;
  /**
   * A PLY file: a file's, with everything kept but the normals, or a cloud's. Also `input`: arrays whose lengths do not fit the
   * points (three numbers a point; `colors` four, `intensity` and `curvature` one), another `count`, an `origin` that is not
   * three finite numbers; and `format`, as for reading.
   */
  writePly(cloud: PointCloud<Float32Array, Uint8Array> | Source, add: Additions, options?: WriteOptions): Promise<Blob>;
  /** What this engine and this page allow. Never rejects. */
  features(): Promise<Features>;
  /** Ends the workers, their threads and downloads; calls that wait or run, and later ones, reject (`input`). */
  dispose(): void;
}
