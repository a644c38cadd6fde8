/** The `i`th of `count` points spread evenly over the unit sphere, from pole to pole of z: a Fibonacci spiral. */
export function onSphere(i: number, count: number): [number, number, number] {
  const z = 1 - (2 * i + 1) / count;
  const ring = Math.sqrt(1 - z * z);
  const turn = i * Math.PI * (3 - Math.sqrt(5));
  return [ring * Math.cos(turn), ring * Math.sin(turn), z];
}
