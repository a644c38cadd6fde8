// The options form: what was chosen and typed, as options of `estimateNormals` or as the reason why it cannot be such.
import type { EstimateOptions } from 'bilinormal';
import type { Up } from './viewer';

export type CellKind = 'auto' | 'scale' | 'size';
export type Method = NonNullable<EstimateOptions['method']>;
export type Orient = NonNullable<EstimateOptions['orient']>;
/** Where the camera and the scanner are and which way is up: known when the normals are computed. */
export type OrientKind = 'none' | 'consistent' | 'outward' | 'camera' | 'scanner' | 'up';
type Place = [number, number, number];

/** The controls; numbers as typed. */
export interface OptionsForm {
  method: Method;
  /** Of 'bilinear'. */
  cellKind: CellKind;
  cellText: string;
  /** Of the other methods. */
  kText: string;
  orientKind: OrientKind;
}

/** How the methods are called, and the k they begin with. */
export const METHODS: Record<Method, { name: string; k: number }> = {
  bilinear: { name: 'bilinear', k: 0 },
  knn: { name: 'k nearest points', k: 16 },
  egg: { name: 'elliptic Gabriel graph', k: 8 },
};

const SCALE_RANGE = { least: 0.1, most: 100 };
const LEAST_K = 3;

export type Parsed = { options: Pick<EstimateOptions, 'method' | 'cell' | 'k'> } | { problem: string };

export function parseOptions({ method, cellKind, cellText, kText }: OptionsForm): Parsed {
  if (method !== 'bilinear') {
    const k = numberOf(kText);
    if (Number.isSafeInteger(k) && k >= LEAST_K) return { options: { method, k } };
    return { problem: `k is a whole number of at least ${LEAST_K}.` };
  }
  if (cellKind === 'auto') return { options: { cell: 'auto' } };
  const value = numberOf(cellText);
  if (cellKind === 'scale') {
    const { least, most } = SCALE_RANGE;
    if (value >= least && value <= most) return { options: { cell: { scale: value } } };
    return { problem: `A multiple of L is a number from ${least} to ${most}.` };
  }
  if (value > 0 && value < Infinity) return { options: { cell: { size: value } } };
  return { problem: 'An edge length is a number above 0, in the unit of the file.' };
}

/** The chosen orientation, for a cloud with this axis upwards that is seen from `eye` and was scanned from `scanner`. */
export function orientOf(kind: OrientKind, up: Up, eye: Place, scanner: Place | undefined): Orient {
  if (kind === 'camera') return { viewpoint: eye };
  if (kind === 'scanner') return scanner ? { viewpoint: scanner } : 'none';
  if (kind === 'up') return { up: up === 'z' ? [0, 0, 1] : [0, 1, 0] };
  return kind;
}

/** Whether the normals were given one sign for each surface. */
export const hasSurfaces = (orient: Orient | undefined) => orient === 'consistent' || orient === 'outward';

const numberOf = (text: string) => (text.trim() === '' ? NaN : Number(text.trim().replace(',', '.')));
