// Normals by pcl.js (PCL in WebAssembly, one thread) of one cloud, for npm run bench:peers: node pcl.cjs FOLDER CLOUD.
// FOLDER is where pcl.js is installed; CLOUD holds x y z of each point as 32-bit numbers. One line of JSON: the seconds of each
// run, with the search tree and without the way in, by a PCD file, and out. It runs as CommonJS only.

const { readFileSync } = require('node:fs');

const NEIGHBOURS = 30;
const RUNS = 3;
/** Seconds after which no more runs are begun. */
const ENOUGH = 15;

async function main(folder, path) {
  const pcl = require(require.resolve('pcl.js', { paths: [folder] }));
  await pcl.init();
  const points = readFileSync(path);
  const count = points.length / 12;
  const header = `# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH ${count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${count}\nDATA binary\n`;
  const cloud = pcl.loadPCDData(new Uint8Array(Buffer.concat([Buffer.from(header), points])).buffer, pcl.PointXYZ);
  const seconds = [];
  while (seconds.length < RUNS && seconds.reduce((sum, more) => sum + more, 0) < ENOUGH) {
    const estimation = new pcl.NormalEstimation();
    estimation.setInputCloud(cloud);
    estimation.setSearchMethod(new pcl.SearchKdTree());
    estimation.setKSearch(NEIGHBOURS);
    const normals = new pcl.PointCloud(pcl.Normal);
    const start = performance.now();
    estimation.compute(normals);
    seconds.push((performance.now() - start) / 1_000);
    if (normals.size !== count && normals.points.size !== count) throw new Error(`normals of ${count} points expected`);
  }
  console.log(JSON.stringify({ method: 'pcl.js', seconds }));
}

main(process.argv[2], process.argv[3]);
