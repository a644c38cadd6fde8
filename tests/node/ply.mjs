// A PLY reader for the tests, written apart from the one under test: slow, strict, and all in doubles.

const types = {
  char: ['getInt8', 1],
  uchar: ['getUint8', 1],
  short: ['getInt16', 2],
  ushort: ['getUint16', 2],
  int: ['getInt32', 4],
  uint: ['getUint32', 4],
  float: ['getFloat32', 4],
  double: ['getFloat64', 8],
};
const aliases = {
  int8: 'char',
  uint8: 'uchar',
  int16: 'short',
  uint16: 'ushort',
  int32: 'int',
  uint32: 'uint',
  float32: 'float',
  float64: 'double',
};
const plain = (type) => aliases[type] ?? type;

/** `elements`: name, count, and properties with their values in order; those of lists lie one after the other. */
export function parsePly(bytes) {
  const end = /\r?\nend_header[^\n\r]*(\r\n|\n|\r)/.exec(bytes.subarray(0, 65536).toString('latin1'));
  const header = bytes
    .subarray(0, end.index)
    .toString('latin1')
    .split(/\r\n|\n|\r/);
  const elements = [];
  const remarks = [];
  let format;
  for (const line of header) {
    const [keyword, ...words] = line.trim().split(/\s+/);
    if (keyword === 'format') format = words[0];
    if (keyword === 'comment' || keyword === 'obj_info') remarks.push(line.trim());
    if (keyword === 'element') elements.push({ name: words[0], count: Number(words[1]), properties: [] });
    if (keyword !== 'property') continue;
    const property =
      words[0] === 'list'
        ? { name: words[3], lengths: plain(words[1]), type: plain(words[2]), values: [] }
        : { name: words[1], type: plain(words[0]), values: [] };
    elements.at(-1).properties.push(property);
  }
  const body = bytes.subarray(end.index + end[0].length);
  const next = format === 'ascii' ? words(body) : numbers(body, format === 'binary_little_endian');
  for (const { count, properties } of elements) {
    for (let row = 0; row < count; row++) {
      for (const { lengths, type, values } of properties) {
        let length = 1;
        if (lengths) values.push((length = next(lengths)));
        for (let i = 0; i < length; i++) values.push(next(type));
      }
    }
  }
  return { format, elements, remarks };
}

function numbers(body, little) {
  const view = new DataView(body.buffer, body.byteOffset, body.byteLength);
  let at = 0;
  return (type) => {
    const [get, size] = types[type];
    at += size;
    return view[get](at - size, little);
  };
}

function words(body) {
  const words = body.toString('latin1').split(/\s+/).filter(Boolean);
  let at = 0;
  return (type) => {
    const value = Number(words[at++].replace(/^([+-]?)inf(inity)?$/i, '$1Infinity'));
    return type === 'float' ? Math.fround(value) : value;
  };
}

/** The property of an element, by both names. */
export function propertyOf({ elements }, element, name) {
  return elements.find((one) => one.name === element)?.properties.find((one) => one.name === name);
}

/** All but the normals of the vertices, for comparison. */
export function withoutNormals({ elements, remarks }) {
  const kept = elements.map(({ name, count, properties }) => ({
    name,
    count,
    properties: properties.filter((property) => name !== 'vertex' || !/^n[xyz]$/.test(property.name)),
  }));
  return { elements: kept, remarks };
}
