/** The middle of some numbers, or the mean of the middle two. */
export function median(values) {
  const ascending = [...values].sort((a, b) => a - b);
  return (ascending[(values.length - 1) >> 1] + ascending[values.length >> 1]) / 2;
}
