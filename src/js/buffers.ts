/** The buffers of the arrays in a message's data, to be handed over with it. */
export const buffersOf = ({ data = {} }: any): any[] =>
  Object.values(data).flatMap((value) => (ArrayBuffer.isView(value) ? [value.buffer] : []));
