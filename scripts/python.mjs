// A Python of the project's own, for the libraries that the benches compare with: nothing else needs it.

import { existsSync } from 'node:fs';
import { join } from 'node:path';
import { Failure, output, root, run, tell, tools } from './run.mjs';

const folder = join(tools, 'python');
/** What pip does not bring. */
const OF_THE_SYSTEM = 'libegl1, libgl1, libusb-1.0-0 and libx11-6';
/** What the benches import. */
const MODULES = 'meshlib.mrmeshpy, open3d, small_gicp, CGAL.CGAL_Point_set_processing_3, vtkmodules.vtkFiltersPoints';
const inFolder = (name) =>
  process.platform === 'win32' ? join(folder, 'Scripts', `${name}.exe`) : join(folder, 'bin', name);

/** The path of a Python with the packages of benches/peers/requirements.txt. */
export function setupPython() {
  const python = inFolder('python');
  if (!existsSync(python)) {
    const system = ['python3', 'python'].find((name) => output(name, ['--version'])?.startsWith('Python 3'));
    if (!system) throw new Failure('no Python 3 on the PATH; the peers that are compared with need one, with venv');
    tell('set-up: a Python environment in .tools, for the peers');
    run(system, ['-m', 'venv', folder]);
  }
  const wanted = join(root, 'benches', 'peers', 'requirements.txt');
  run(python, ['-m', 'pip', 'install', '--quiet', '--disable-pip-version-check', '--requirement', wanted]);
  // Otherwise a peer that can't be loaded would look like one that fails at every cloud.
  try {
    run(python, ['-c', `import ${MODULES}`], { quiet: true });
  } catch {
    throw new Failure(`a peer can't be loaded, see above; Open3D needs ${OF_THE_SYSTEM} (names in Debian)`);
  }
  return python;
}
