// Shortens what wasm-bindgen writes. Its glue serves callers and engines that this package does not have: several ways
// to pass the module, old interfaces, engines without TextEncoder (all that have SIMD have it), callers that leave
// freeing to the garbage collector; and each import name has a hash, which does not compress. In all that is 1.7 of the
// 8 KiB of JavaScript that a page may load.

import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Failure, output, root } from './run.mjs';

/** Shortens the glue in a folder of dist/, and the names that it shares with the wasm module beside it. */
export function shortenGlue(folder) {
  const path = join(root, folder, 'bilinormal.js');
  writeFileSync(path, shortenNames(shortenCode(readFileSync(path, 'utf8')), join(root, folder, 'bilinormal_bg.wasm')));
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
  wasm.__wbindgen_start();
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
  edit(/if \(Symbol\.dispose\).*\n/g, '');
  // Properties that only the glue itself uses.
  edit(/__destroy_into_raw/g, 'raw');
  edit(/__wbg_ptr/g, 'at');
  edit(/__wrap/g, 'wrap');
  return glue;
}

/** wasm-opt gives short names to imports and exports, and prints which; the glue takes them over. */
function shortenNames(glue, wasm) {
  const printed = output('wasm-opt', [wasm, '--minify-imports-and-exports-and-modules', '-o', wasm]);
  if (!printed) throw new Failure(`wasm-opt could not shorten the names in ${wasm}`);
  const { imports, exports } = JSON.parse(printed);
  const imported = new Map(imports.map(([, name, short]) => [name, short]));
  const exported = new Map(exports);
  const shortOf = (names, name) => {
    if (!names.has(name)) throw new Failure(`${wasm} has no ${name}, which its glue uses`);
    return names.get(name);
  };
  return glue
    .replace(/(?<=\n {8})(\w+)(?=: (?:function|memory))/g, (name) => shortOf(imported, name))
    .replace('"./bilinormal_bg.js": import0', 'a: import0')
    .replace(/(?<=\bwasm\.)\w+/g, (name) => shortOf(exported, name));
}
