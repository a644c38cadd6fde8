// Numbers and names as a person reads them.

const whole = new Intl.NumberFormat('en');

export const count = (value: number) => whole.format(value);

/** Three significant digits, without an exponent where that stays readable. */
export function measure(value: number): string {
  if (value === 0) return '0';
  const size = Math.abs(value);
  return size >= 1e-4 && size < 1e7 ? String(Number(value.toPrecision(3))) : value.toExponential(2);
}

export function duration(milliseconds: number): string {
  if (milliseconds < 10) return `${milliseconds.toFixed(1)} ms`;
  if (milliseconds < 1000) return `${Math.round(milliseconds)} ms`;
  return `${(milliseconds / 1000).toFixed(milliseconds < 10_000 ? 2 : 1)} s`;
}

/** "point" of one, else "points". */
export const plural = (value: number, noun: string) => (value === 1 ? noun : `${noun}s`);

/** "69.1%"; "100%" only of all. */
export function percent(part: number, whole: number): string {
  const share = (100 * part) / whole;
  return `${measure(part < whole ? Math.min(share, 99.9) : share)}%`;
}

const PHASES: Record<string, string> = {
  start: 'starting',
  load: 'loading the file',
  read: 'reading the points',
  write: 'writing the points',
  cellSize: 'size of the cubes',
  sort: 'sorting into cubes',
  vote: 'smooth places',
  detail: 'edges and details',
  tree: 'search tree',
};

/** A phase, as the report and the progress name it, in words. */
export const phaseName = (phase: string) => PHASES[phase] ?? phase;
