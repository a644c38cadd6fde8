// Where a scan was taken from, if its file says so: for the command line and the page. No function of the package, which
// leaves comments to its callers.
import type { PointCloud } from './types.js';

/** Relative to the cloud's origin, as its positions are. */
export function scannerOf({ source, origin }: PointCloud): [number, number, number] | undefined {
  const place = source.viewpoint ?? source.comments.map(placeIn).find((found) => found !== undefined);
  return place && [place[0] - origin[0], place[1] - origin[1], place[2] - origin[2]];
}

/** The numbers of a comment such as `scanner position: 1.5, 0, 2`; with more or fewer it means something else. */
function placeIn(comment: string): [number, number, number] | undefined {
  // A whole word, for there are reviews.
  const named = /(scanner|sensor|camera)[\W_]*(position|origin|location)|(?<![a-z])view[\W_]?point(?![a-z])/i;
  if (!named.test(comment)) return undefined;
  const [x, y, z, ...more] = (comment.match(/[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?/gi) ?? []).map(Number);
  if (x === undefined || y === undefined || z === undefined || more.length > 0) return undefined;
  return Number.isFinite(x + y + z) ? [x, y, z] : undefined;
}
