// How many signs are right.

/** A normal further off the true direction, either way, is that of another face: its sign says little. Cosine of 60 degrees. */
const CLEAR = 0.5;

/**
 * The share of the points whose normals point to the same side as the true ones, among those for which `counts` answers
 * true and that have a true normal; one without a normal is not right. `eitherWay`: of all signs as they are and all
 * turned, the larger share. `clear`: both for the points alone whose sign is clear.
 */
export function rightSigns(normals, truth, counts = () => true) {
  const [all, clear] = [tally(), tally()];
  for (let i = 0, at = 0; at < truth.length; i++, at += 3) {
    const [x, y, z] = [truth[at], truth[at + 1], truth[at + 2]];
    if ((x === 0 && y === 0 && z === 0) || !counts(i)) continue;
    const cosine = x * normals[at] + y * normals[at + 1] + z * normals[at + 2];
    all.add(cosine);
    if (Math.abs(cosine) >= CLEAR) clear.add(cosine);
  }
  return { ...all.result(), clear: clear.result() };
}

function tally() {
  let [points, right, wrong] = [0, 0, 0];
  return {
    add(cosine) {
      points++;
      if (cosine > 0) right++;
      if (cosine < 0) wrong++;
    },
    result: () => ({ points, share: right / points, eitherWay: Math.max(right, wrong) / points }),
  };
}

/** Seconds for a million points that orientation may take, on one thread. */
export const MOST_SECONDS = 0.15;

/** What is asked of each kind of row. `part`: of which of its points; `modes`: of which modes, if not of all. */
const ASKED = {
  'clean shapes': { least: 1 },
  'noisy shapes': { least: 0.995 },
  'clean meshes': { least: 0.999 },
  'meshes with noise 0.6 %, thick': { part: 'thick', least: 0.995 },
  'meshes with noise 0.6 %, thin': { part: 'thin', least: 0.97 },
  'meshes, other noise and density': { least: 0.97 },
  'range scans': { least: 0.999 },
  // By 'outward' rooms and hollows face away from the scanner.
  scenes: { modes: ['consistent'], least: 0.995 },
  'single views': { modes: ['consistent'], least: 0.995 },
};

function kindsOf({ kind, variant, sides }) {
  if (!sides) return [];
  if (kind === 'ranges') return ['range scans'];
  if (kind === 'scene') return ['scenes'];
  if (kind === 'view') return ['single views'];
  if (kind === 'shape') return [variant === 'clean' ? 'clean shapes' : 'noisy shapes'];
  if (variant === 'clean') return ['clean meshes'];
  if (variant === 'noise0.6') return ['meshes with noise 0.6 %, thick', 'meshes with noise 0.6 %, thin'];
  return ['meshes, other noise and density'];
}

/** What counts of signs as `rightSigns` gives them: those of open surfaces up to one flip. */
export const counted = ({ open }, { share, eitherWay }) => (open ? eitherWay : share);

/**
 * A row against what is asked of it, `[{ kind, part, least, mode, share, met, clear }]`; `clear`: whether the points whose sign
 * is clear meet it.
 */
export function verdicts(row) {
  return kindsOf(row).flatMap((kind) => {
    const { part = 'all', modes = Object.keys(row.modes), least } = ASKED[kind];
    return modes.flatMap((mode) => {
      const { signs } = row.modes[mode];
      if (!(signs[part].points > 0)) return [];
      const share = counted(row, signs[part]);
      const clear = counted(row, signs[part].clear) >= least;
      return [{ kind, part, least, mode, share, met: share >= least, clear }];
    });
  });
}
