// The options form: what was chosen and typed, as options of `estimateNormals` or as the reason why it cannot be such.
import type { EstimateOptions } from 'bilinormal';
import { count } from './format';
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
/** The most is far beyond what is of use. */
const K_RANGE = { least: 3, most: 1_000_000 };

export type Parsed = { options: Pick<EstimateOptions, 'method' | 'cell' | 'k'> } | { problem: string };

export function parseOptions({ method, cellKind, cellText, kText }: OptionsForm): Parsed {
  if (method === 'bilinear' && cellKind === 'auto') return { options: { cell: 'auto' } };
  const text = (method === 'bilinear' ? cellText : kText).trim();
  // "1,000" is a thousand to some and one to others.
  const ambiguous = /^[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/;
  if (ambiguous.test(text)) return { problem: `${text} can be read in two ways: write it without a comma.` };
  const value = text === '' ? NaN : Number(text.replace(',', '.'));
  if (method !== 'bilinear') {
    const { least, most } = K_RANGE;
    if (Number.isInteger(value) && value >= least && value <= most) return { options: { method, k: value } };
    return { problem: `k is a whole number from ${count(least)} to ${count(most)}.` };
  }
  if (cellKind === 'scale') {
    const { least, most } = SCALE_RANGE;
    if (value >= least && value <= most) return { options: { cell: { scale: value } } };
    return { problem: `A multiple of L is a number from ${least} to ${most}.` };
  }
  if (value > 0 && value < Infinity) return { options: { cell: { size: value } } };
  return { problem: 'An edge length is a number above 0, in the unit of the file.' };
}

const UPWARDS: Record<Up, Place> = {
  x: [1, 0, 0],
  '-x': [-1, 0, 0],
  y: [0, 1, 0],
  '-y': [0, -1, 0],
  z: [0, 0, 1],
  '-z': [0, 0, -1],
};

/** The chosen orientation, for a cloud with this axis upwards that is seen from `eye` and was scanned from `scanner`. */
export function orientOf(kind: OrientKind, up: Up, eye: Place, scanner: Place | undefined): Orient {
  if (kind === 'camera') return { viewpoint: eye };
  if (kind === 'scanner') return scanner ? { viewpoint: scanner } : 'none';
  if (kind === 'up') return { up: UPWARDS[up] };
  return kind;
}

/** What of the form, and of the axis, changes the normals, as a text to compare; where the camera is does not count. */
export const askedBy = (form: OptionsForm, up: Up): string =>
  JSON.stringify([parseOptions(form), form.orientKind, form.orientKind === 'up' ? up : '']);

/** Whether the normals were given one sign for each surface. */
export const hasSurfaces = (orient: Orient | undefined) => orient === 'consistent' || orient === 'outward';
