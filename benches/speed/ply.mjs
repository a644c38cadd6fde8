// PLY files of points, with colours that follow from their places.

const header = (format, count) =>
  `ply
format ${format} 1.0
element vertex ${count}
property float x
property float y
property float z
property uchar red
property uchar green
property uchar blue
end_header
`;

const shade = (coordinate) => Math.round(127.5 * (coordinate + 1)) & 255;

/** 15 bytes a point. */
export function binaryPly(positions) {
  const count = positions.length / 3;
  const head = new TextEncoder().encode(header('binary_little_endian', count));
  const bytes = new Uint8Array(head.length + 15 * count);
  const view = new DataView(bytes.buffer);
  bytes.set(head);
  for (let i = 0, at = head.length; i < 3 * count; i += 3, at += 15) {
    for (let axis = 0; axis < 3; axis++) {
      view.setFloat32(at + 4 * axis, positions[i + axis], true);
      bytes[at + 12 + axis] = shade(positions[i + axis]);
    }
  }
  return bytes;
}

/** Six digits after the point, as most programs write. */
export function asciiPly(positions) {
  const lines = [];
  for (let i = 0; i < positions.length; i += 3) {
    const point = [positions[i], positions[i + 1], positions[i + 2]];
    lines.push(`${point.map((c) => c.toFixed(6)).join(' ')} ${point.map(shade).join(' ')}`);
  }
  return new TextEncoder().encode(`${header('ascii', positions.length / 3)}${lines.join('\n')}\n`);
}
