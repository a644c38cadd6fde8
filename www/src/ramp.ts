// Curvature as colour: viridis, whose steps look equal and whose lightness rises throughout (Smith and van der Walt 2015).
import { nth } from './spread';

/** Every eighth part of viridis, sRGB. */
const STOPS = [0x440154, 0x472d7b, 0x3b528b, 0x2c728e, 0x21918c, 0x28ae80, 0x5ec962, 0xaddc30, 0xfde725];
const STEPS = 256;
/** Points looked at for the quantile. */
const SAMPLE = 60_000;
/** The share of the points below the end of the ramp: an edge or two, or some strays, are not to leave the rest dark. */
const QUANTILE = 0.98;
/** No end is lower: what is left of a plane by rounding is not worth a colour. */
const LEAST = 1e-6;

/**
 * Colours (RGBA) of surface variations. They follow its square root, which grows as the curvature itself does, up to
 * the quantile.
 */
export function colorsOf(curvature: Float32Array): Uint8Array {
  const points = curvature.length;
  const length = Math.min(points, SAMPLE);
  const sample = Float32Array.from({ length }, (_, k) => curvature[nth(k, points, length)]!).sort();
  const end = Math.max(LEAST, sample[Math.floor(QUANTILE * (sample.length - 1))] ?? 0);
  const ramp = makeRamp();
  const colors = new Uint32Array(curvature.length);
  for (let i = 0; i < colors.length; i++) {
    colors[i] = ramp[Math.min(STEPS - 1, Math.floor(STEPS * Math.sqrt(curvature[i]! / end)))]!;
  }
  return new Uint8Array(colors.buffer);
}

/** The colours as they lie in memory: four bytes each. */
function makeRamp(): Uint32Array {
  const bytes = new Uint8Array(4 * STEPS).fill(255);
  for (let i = 0; i < STEPS; i++) {
    const place = (i / (STEPS - 1)) * (STOPS.length - 1);
    const stop = Math.min(Math.floor(place), STOPS.length - 2);
    for (let channel = 0; channel < 3; channel++) {
      const [low, high] = [STOPS[stop]!, STOPS[stop + 1]!].map((color) => (color >> (16 - 8 * channel)) & 255);
      bytes[4 * i + channel] = Math.round(low! + (high! - low!) * (place - stop));
    }
  }
  return new Uint32Array(bytes.buffer);
}
