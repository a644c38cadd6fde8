// The cell control: what was typed, as the option of `estimateNormals` or as the reason why it cannot be one.
import type { EstimateOptions } from 'bilinormal';
import type { CellKind } from './state';

export const SCALE_RANGE = { least: 0.1, most: 100 };

type Cell = NonNullable<EstimateOptions['cell']>;

export function parseCell(kind: CellKind, text: string): { cell: Cell } | { problem: string } {
  if (kind === 'auto') return { cell: 'auto' };
  const value = text.trim() === '' ? NaN : Number(text.trim().replace(',', '.'));
  if (kind === 'scale') {
    const { least, most } = SCALE_RANGE;
    if (value >= least && value <= most) return { cell: { scale: value } };
    return { problem: `A multiple of L is a number from ${least} to ${most}.` };
  }
  if (value > 0 && value < Infinity) return { cell: { size: value } };
  return { problem: 'An edge length is a number above 0, in the unit of the file.' };
}
