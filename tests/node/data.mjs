// Real and odd files, where they are there: in the folder that `BILINORMAL_DATA` names, or in `../shared/data` beside the
// project. (None of them is part of the project.)
import { resolve } from 'node:path';
import { root } from '../../scripts/run.mjs';

export const data = resolve(root, process.env.BILINORMAL_DATA ?? '../shared/data');
