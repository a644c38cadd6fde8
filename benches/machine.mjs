// What a report says of where it was measured.

import { cpus } from 'node:os';

export const machine = () => ({
  model: cpus()[0].model.trim(),
  cores: cpus().length,
  node: process.versions.node,
  date: new Date().toLocaleDateString('en-GB', { day: 'numeric', month: 'long', year: 'numeric' }),
});
