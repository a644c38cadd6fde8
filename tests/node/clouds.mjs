// Clouds whose normals are known, the same at every run.

/** Numbers from 0 to 1. */
export function randomNumbers(seed = 1) {
  let state = seed;
  return () => (state = (state * 16807) % 2147483647) / 2147483647;
}

/** Points spread evenly over the unit sphere, in random order. */
export function sphere(count, Kind = Float32Array) {
  const random = randomNumbers();
  const positions = new Kind(3 * count);
  for (let i = 0; i < count; i++) {
    const z = 2 * random() - 1;
    const angle = 2 * Math.PI * random();
    const radius = Math.sqrt(1 - z * z);
    positions.set([radius * Math.cos(angle), radius * Math.sin(angle), z], 3 * i);
  }
  return positions;
}

/** How far normals are from those of the unit sphere, sign aside: mean length of the difference, largest angle in degrees. */
export function deviation(positions, normals) {
  let sum = 0;
  let least = 1;
  for (let at = 0; at < positions.length; at += 3) {
    const [x, y, z] = positions.subarray(at, at + 3);
    const [nx, ny, nz] = normals.subarray(at, at + 3);
    const cosine = Math.abs(x * nx + y * ny + z * nz) / Math.hypot(x, y, z) / Math.hypot(nx, ny, nz);
    sum += Math.sqrt(Math.max(0, 2 - 2 * cosine));
    least = Math.min(least, cosine);
  }
  return { mean: sum / (positions.length / 3), worst: (Math.acos(least) * 180) / Math.PI };
}

export const sameBits = (a, b) =>
  Buffer.from(a.buffer, a.byteOffset, a.byteLength).equals(Buffer.from(b.buffer, b.byteOffset, b.byteLength));
