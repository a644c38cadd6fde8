// The numbers of the paper, as it prints them. Times in milliseconds, points as counts.

/** "Intel Core i5, 2.67 GHz CPU and 4 GB memory, running windows 7 (64 bit)" */
export const MACHINE = 'i5 at 2.67 GHz';

/** Figure 6: points of the spheres. It prints no times for them, only a curve. */
export const SPHERES = [187_500, 375_000, 750_000, 1_500_000, 3_000_000];

/** Section 3: the mean deviation on spheres is below this. */
export const DEVIATION = 0.0065;

/** Section 3: share and mean error of the points interpolated from so many nodes. */
export const CLASSES = [
  { nodes: 4, share: 0.75, error: 0.005 },
  { nodes: 3, share: 0.14, error: 0.008 },
  { nodes: 2, share: 0.11, error: 0.0102 },
];

/** Section 3, on Figure 7: how many times faster than EGG. */
export const FASTER_THAN_EGG = [3, 4];

/** Section 3, on Figure 8, in multiples of L: the time hardly changes from here on, ... */
export const TIME_SETTLES = 2.0;
/** ... the error grows greatly from here on, ... */
export const ERROR_GROWS = 3.0;
/** ... and this is the advice. */
export const ADVICE = 1.5;

/** Figure 4. */
export const FREE_FORM = {
  points: 712_000,
  grid: [376, 314, 93],
  cells: 134_832,
  milliseconds: 1014,
  interpolation: 202,
  enn: 3762,
};

/** Table 1. */
export const TABLE = [
  { name: 'Famer Statue', points: 121_000, nodes: 38_000, grid: [156, 102, 121], one: 234, three: 101, egg: 924 },
  { name: 'Blade', points: 178_000, nodes: 78_000, grid: [101, 143, 383], one: 266, three: 139, egg: 1253 },
  { name: 'Mother Statue', points: 516_000, nodes: 114_000, grid: [297, 200, 134], one: 828, three: 353, egg: 2742 },
  { name: 'Engine Cover', points: 1_272_000, nodes: 248_000, grid: [444, 267, 162], one: 2259, three: 846, egg: 6759 },
  { name: 'Engine', points: 2_875_000, nodes: 450_000, grid: [621, 314, 191], one: 5023, three: 1802, egg: 16_130 },
];

/**
 * The edge of the cubes in multiples of L that the printed number of cubes amounts to: by Eq. 1 a box holds as many
 * cubes of edge L as there are points.
 */
export const scaleOf = ({ points, grid: [x, y, z] }) => Math.cbrt(points / (x * y * z));
