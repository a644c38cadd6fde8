"""Normals by MeshLib, small_gicp and Open3D of one cloud, for npm run bench:peers.

    python benches/peers/normals.py CLOUD THREADS

CLOUD holds x y z of each point as 32-bit numbers, little endian. One line for each method, in JSON: the seconds of each run, all
on so many processors, with the search structure and without the copies from and to Python. All look at 30 points, MeshLib at
those within the radius that holds 30 on average; finding that radius is not counted.
"""

import json
import multiprocessing
import os
import sys
import time

NEIGHBOURS = 30
RUNS = 5
# Seconds after which no more runs are begun.
ENOUGH = 15


def meshlib(positions, _threads, oriented):
    from meshlib import mrmeshnumpy, mrmeshpy
    import numpy

    cloud = mrmeshnumpy.pointCloudFromPoints(positions, numpy.zeros((0, 3)))
    radius = mrmeshpy.findAvgPointsRadius(cloud, NEIGHBOURS)
    make = mrmeshpy.makeOrientedNormals if oriented else mrmeshpy.makeUnorientedNormals

    def run():
        # A cloud keeps its search tree.
        cloud.invalidateCaches()
        make(cloud, radius)

    return run


def gicp(positions, threads, _oriented):
    import small_gicp

    def run():
        cloud = small_gicp.PointCloud(positions)
        small_gicp.estimate_normals(cloud, None, NEIGHBOURS, threads)

    return run


def open3d(positions, _threads, _oriented):
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(positions))
    return lambda: cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))


METHODS = {
    "MeshLib": (meshlib, False),
    "MeshLib, oriented": (meshlib, True),
    "small_gicp": (gicp, False),
    "Open3D": (open3d, False),
}


def measure(path, threads, method, pipe):
    import numpy

    positions = numpy.fromfile(path, "<f4").reshape(-1, 3).astype(float)
    prepare, oriented = METHODS[method]
    run = prepare(positions, threads, oriented)
    seconds = []
    while len(seconds) < RUNS and sum(seconds) < ENOUGH:
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    pipe.send(seconds)


def main():
    if len(sys.argv) != 3:
        raise SystemExit("usage: normals.py CLOUD THREADS")
    path, threads = sys.argv[1], int(sys.argv[2])
    # Thread pools look at this when they are made.
    os.environ["OMP_NUM_THREADS"] = str(threads)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
    for method in METHODS:
        ours, theirs = multiprocessing.Pipe(False)
        process = multiprocessing.Process(target=measure, args=(path, threads, method, theirs))
        process.start()
        theirs.close()
        try:
            result = {"seconds": ours.recv()}
        except EOFError:
            result = {"failure": "failed"}
        print(json.dumps({"method": method, **result}), flush=True)
        process.join()


if __name__ == "__main__":
    main()
