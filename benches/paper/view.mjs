// What takes the pictures: the page's own viewer, and nothing else on the screen. Runs in a browser (pictures.mjs).

import { boundsOf } from '../../www/src/bounds.ts';
import { guessUp } from '../../www/src/upright.ts';
import { createViewer } from '../../www/src/viewer.ts';

const viewer = createViewer(document.querySelector('canvas'), { edges: false });
const frame = () => new Promise(requestAnimationFrame);

async function numbers(file) {
  const response = await fetch(file);
  return new Float32Array(await response.arrayBuffer());
}

/** Shows a cloud, framed. */
window.showCloud = async ({ positions, normals, origin, up, shading, pointSize }) => {
  const cloud = { positions: await numbers(positions) };
  const bounds = boundsOf(cloud.positions);
  viewer.show(cloud, bounds, up ?? guessUp(cloud.positions, bounds, origin));
  viewer.setNormals(await numbers(normals));
  viewer.setShading(shading);
  viewer.setPointSize(pointSize);
  viewer.fit();
  await frame();
  await frame();
};
