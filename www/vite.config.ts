import { fileURLToPath } from 'node:url';
import { defineConfig } from 'vite';

const here = (path: string) => fileURLToPath(new URL(path, import.meta.url));

export default defineConfig({
  root: here('.'),
  // Relative addresses, so that the page runs from any folder of any file server.
  base: './',
  resolve: {
    alias: [
      { find: /^bilinormal$/, replacement: here('../dist/index.js') },
      { find: /^bilinormal\/three$/, replacement: here('../dist/three.js') },
    ],
  },
  worker: { format: 'es' },
  build: {
    outDir: here('dist'),
    emptyOutDir: true,
    target: 'es2022',
    // The Content-Security-Policy allows nothing inline: no asset becomes a data: URL, no script is injected.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    // three.js alone is above the default limit.
    chunkSizeWarningLimit: 900,
  },
});
