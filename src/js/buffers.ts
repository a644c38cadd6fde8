/** The buffers of a message's arrays, or of those of its result, to be handed over with it. */
export const buffersOf = (message: any): any[] =>
  Object.values(message.result ?? message).flatMap((value) => (ArrayBuffer.isView(value) ? [value.buffer] : []));
