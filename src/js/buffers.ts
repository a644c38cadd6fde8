/** The buffers of an object's arrays, to be handed over with it. */
export const buffersOf = (object: object): ArrayBuffer[] =>
  Object.values(object).flatMap((value) => (ArrayBuffer.isView(value) ? [value.buffer as ArrayBuffer] : []));
