// Shortens what wasm-bindgen writes. Its glue serves callers and engines that this package does not have: several ways
// to pass the module, old interfaces, engines without TextEncoder (all that have SIMD have it), callers that leave
// freeing to the garbage collector; and each import name has a hash, which does not compress. In all that is 1.7 of the
// 8 KiB of JavaScript that a page may load.

import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Failure, root } from './run.mjs';

/** Bytes of the stack of a thread: as many as the linker gives to the worker (scripts/*.toml). By default it is 2 MiB. */
const STACK = 1 << 18;

/** Shortens glue, and the names that it shares with the wasm modules in a folder of dist/. */
export function shortenGlue(glue, folder) {
  return shortenNames(shortenCode(glue), join(root, folder));
}

function shortenCode(glue) {
  const edit = (pattern, replacement) => {
    if (!pattern.test(glue))
      throw new Failure(`the glue of wasm-bindgen has changed: nothing in it matches ${pattern}`);
    glue = glue.replace(pattern, replacement);
  };
  edit(
    /let cachedTextDecoder = [^]*?(?=let WASM_VECTOR_LEN)/,
    `const cachedTextDecoder = new TextDecoder('utf-8', { ignoreBOM: true });
const cachedTextEncoder = new TextEncoder();
// Decoders refuse shared memory.
const decodeText = (bytes) => cachedTextDecoder.decode(bytes.slice());
`,
  );
  edit(
    /function passStringToWasm0\([^]*?\n}\n/,
    `function passStringToWasm0(text, malloc) {
  const bytes = cachedTextEncoder.encode(text);
  const ptr = malloc(bytes.length, 1) >>> 0;
  getUint8ArrayMemory0().set(bytes, ptr);
  WASM_VECTOR_LEN = bytes.length;
  return ptr;
}
`,
  );
  edit(
    /let wasmModule, [^]*$/,
    `let wasmModule, wasm;
async function init({ module_or_path: module, memory }) {
  const { exports } = await WebAssembly.instantiate(module, __wbg_get_imports(memory));
  wasmModule = module;
  wasm = exports;
  wasm.__wbindgen_start(${STACK});
  return { memory: wasm.memory };
}
export { init as default };
`,
  );
  // Whoever takes an object from wasm frees it, so nothing has to watch for the garbage collector.
  edit(/const \w+Finalization = [^;]*;\n/g, '');
  edit(/\w+Finalization\.(un)?register\(.*\);\n/g, '');
  // Nor does anything else call this border than serve.ts, whose types the compiler checks.
  edit(/ *_assertClass\(.*\);\n/g, '');
  edit(/function _assertClass[^]*?\n}\n/, '');
  edit(/ *try \{\n([^{}]*(?:\{[^{}]*\}[^{}]*)*)\} catch \(e\) \{\n(?: +if \(ptr.*\n)+ +throw e;\n +\}\n/g, '$1');
  edit(/if \(Symbol\.dispose\).*\n/g, '');
  // The memory is always handed in.
  edit(/memory \|\| new WebAssembly\.Memory\(.*\)/, 'memory');
  // A view costs less than the code that keeps it.
  edit(
    /let cached(\w+)Memory0 = null;\nfunction (\w+)\(\) \{[^]*?\n\}\n/g,
    'const $2 = () => new $1(wasm.memory.buffer);\n',
  );
  // Of the threads build: of the names of the global object the one that all engines with SIMD have is tried first.
  if (/typeof globalThis/.test(glue)) {
    edit(/const ret = typeof globalThis [^;]*;\n.*\n/, 'return addToExternrefTable0(globalThis);\n');
    edit(/const ret = typeof (global|self|window) [^;]*;\n.*\n/g, 'return 0;\n');
  }
  edit(/Object\.create\(\w+\.prototype\)/g, 'Object.create(this.prototype)');
  // Properties that only the glue itself uses.
  edit(/__destroy_into_raw/g, 'raw');
  edit(/__wbg_ptr/g, 'at');
  edit(/__wrap/g, 'wrap');
  return glue;
}

/**
 * Gives the imports and exports of all modules in a folder short names, the same in each, and the glue with them; what only
 * tools read goes out of the modules on the way.
 */
function shortenNames(glue, folder) {
  const shorts = new Map();
  const short = (name) => {
    if (!shorts.has(name)) shorts.set(name, letters(shorts.size));
    return shorts.get(name);
  };
  for (const file of readdirSync(folder).filter((file) => file.endsWith('.wasm'))) {
    const path = join(folder, file);
    writeFileSync(path, shortened(readFileSync(path), short));
  }
  const known = (name) => {
    if (!shorts.has(name)) throw new Failure(`no module in ${folder} has ${name}, which the glue uses`);
    return shorts.get(name);
  };
  return glue
    .replace(/(?<=\n {8})(\w+)(?=: (?:function|memory))/g, known)
    .replace(/: function(?=\()/g, '')
    .replace('"./bilinormal_bg.js": import0', `${known('./bilinormal_bg.js')}: import0`)
    .replace(/(?<=\bwasm\.)\w+/g, known);
}

/** The numbers as a, b, ... z, ba, bb ... */
const letters = (number) =>
  [...number.toString(26)].map((digit) => String.fromCharCode(97 + parseInt(digit, 26))).join('');

/**
 * A wasm module with other names of its imports and exports, and without custom sections, which only tools read: who made
 * it, which features it needs (https://webassembly.github.io/spec/core/binary/modules.html).
 */
function shortened(module, rename) {
  const CUSTOM = 0;
  const IMPORTS = 2;
  const EXPORTS = 7;
  let at = 8;
  const number = () => {
    for (let value = 0, shift = 0; ; shift += 7) {
      value += (module[at] & 0x7f) * 2 ** shift;
      if (module[at++] < 0x80) return value;
    }
  };
  const encoded = (value) => {
    const bytes = [];
    for (; value >= 0x80; value = Math.floor(value / 0x80)) bytes.push((value % 0x80) | 0x80);
    return Buffer.from([...bytes, value]);
  };
  const name = () => {
    const length = number();
    at += length;
    const renamed = Buffer.from(rename(module.toString('utf8', at - length, at)));
    return Buffer.concat([encoded(renamed.length), renamed]);
  };
  /** A table, memory, or both, has limits: flags, least, and most if the lowest flag is set. */
  const limits = () => {
    const hasMost = module[at++] & 1;
    number();
    if (hasMost) number();
  };
  const type = {
    0: number,
    1: () => ((at += 1), limits()),
    2: limits,
    3: () => (at += 2),
  };
  const part = (read) => {
    const start = at;
    read();
    return module.subarray(start, at);
  };
  const pieces = [module.subarray(0, at)];
  while (at < module.length) {
    const id = module[at++];
    const length = number();
    const start = at;
    let body = module.subarray(start, start + length);
    if (id === IMPORTS || id === EXPORTS) {
      const count = number();
      const entries = Array.from({ length: count }, () =>
        id === IMPORTS ? [name(), name(), part(() => type[module[at++]]())] : [name(), part(() => (at++, number()))],
      );
      body = Buffer.concat([encoded(count), ...entries.flat()]);
    }
    at = start + length;
    if (id !== CUSTOM) pieces.push(Buffer.from([id]), encoded(body.length), body);
  }
  return Buffer.concat(pieces);
}
