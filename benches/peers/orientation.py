"""Signs by Open3D, MeshLib, CGAL and VTK on one cloud of the orientation bench, for its --peers.

    python benches/peers/orientation.py CLOUD

CLOUD is a PLY file with true normals. One line for each method, in JSON: the share of right signs up to one flip of all, and
the seconds on one thread, with the normals. Open3D estimates from 30 neighbours and orients along the tangent planes of 15
or 30 (Hoppe 1992); MeshLib does both within the radius that holds 48 or 150 points; CGAL does from 18 or 30 neighbours, and
along a spanning tree of these; VTK from 16 or 30, and from point to point among them. What takes longer than LIMIT, or fails,
has no share.
"""

import json
import multiprocessing
import os
import sys
import time

os.environ["OMP_NUM_THREADS"] = "1"
LIMIT = 30


def open3d_normals(positions, neighbours):
    import open3d

    cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(positions))
    start = time.perf_counter()
    cloud.estimate_normals(open3d.geometry.KDTreeSearchParamKNN(30))
    cloud.orient_normals_consistent_tangent_plane(neighbours)
    seconds = time.perf_counter() - start
    return cloud.normals, seconds


def meshlib_normals(positions, points):
    from meshlib import mrmeshnumpy, mrmeshpy
    import numpy

    cloud = mrmeshnumpy.pointCloudFromPoints(positions, numpy.zeros((0, 3)))
    start = time.perf_counter()
    normals = mrmeshpy.makeOrientedNormals(cloud, mrmeshpy.findAvgPointsRadius(cloud, points))
    seconds = time.perf_counter() - start
    return [(normal.x, normal.y, normal.z) for normal in normals.vec], seconds


def cgal_normals(positions, neighbours):
    from CGAL.CGAL_Kernel import Point_3
    from CGAL.CGAL_Point_set_3 import Point_set_3
    from CGAL.CGAL_Point_set_processing_3 import mst_orient_normals, pca_estimate_normals
    import numpy

    cloud = Point_set_3()
    cloud.add_normal_map()
    for position in positions.tolist():
        cloud.insert(Point_3(*position))
    start = time.perf_counter()
    pca_estimate_normals(cloud, neighbours)
    mst_orient_normals(cloud, neighbours)
    seconds = time.perf_counter() - start
    normals = numpy.zeros_like(positions)
    # Points that the tree does not reach are marked as removed, with the sign that they had.
    for index in range(len(positions)):
        normal = cloud.normal(index)
        normals[index] = normal.x(), normal.y(), normal.z()
    return normals, seconds


def vtk_normals(positions, neighbours):
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkFiltersPoints import vtkPCANormalEstimation

    points, cloud, estimation = vtkPoints(), vtkPolyData(), vtkPCANormalEstimation()
    points.SetData(numpy_to_vtk(positions))
    cloud.SetPoints(points)
    estimation.SetInputData(cloud)
    estimation.SetSampleSize(neighbours)
    estimation.SetNormalOrientationToGraphTraversal()
    start = time.perf_counter()
    estimation.Update()
    seconds = time.perf_counter() - start
    return vtk_to_numpy(estimation.GetOutput().GetPointData().GetNormals()), seconds


METHODS = {
    "Open3D, 15": (open3d_normals, 15),
    "Open3D, 30": (open3d_normals, 30),
    "MeshLib, 48": (meshlib_normals, 48),
    "MeshLib, 150": (meshlib_normals, 150),
    "CGAL, 18": (cgal_normals, 18),
    "CGAL, 30": (cgal_normals, 30),
    "VTK, 16": (vtk_normals, 16),
    "VTK, 30": (vtk_normals, 30),
}


def read(path):
    """Positions and true normals: little endian, x y z nx ny nz as floats."""
    import numpy

    with open(path, "rb") as file:
        header, body = file.read().split(b"end_header\n", 1)
    properties = [line.split() for line in header.decode().splitlines() if line.startswith("property")]
    if [words[1:] for words in properties] != [["float", name] for name in ("x", "y", "z", "nx", "ny", "nz")]:
        raise SystemExit(f"{path}: wanted x y z nx ny nz as floats")
    values = numpy.frombuffer(body, "<f4").reshape(-1, 6).astype(float)
    return values[:, :3].copy(), values[:, 3:].copy()


def judge(path, method, pipe):
    import numpy

    positions, truth = read(path)
    choose, size = METHODS[method]
    normals, seconds = choose(positions, size)
    known = numpy.abs(truth).sum(1) > 0
    along = (numpy.asarray(normals) * truth).sum(1)[known]
    pipe.send((max((along > 0).mean(), (along < 0).mean()), seconds))


def run(path, method):
    """In a process of its own: any of them can take for ever, or more memory than there is."""
    ours, theirs = multiprocessing.Pipe(False)
    process = multiprocessing.Process(target=judge, args=(path, method, theirs))
    process.start()
    theirs.close()
    try:
        if not ours.poll(LIMIT):
            return {"failure": f"more than {LIMIT} s"}
        share, seconds = ours.recv()
        return {"share": float(share), "seconds": seconds}
    except EOFError:
        return {"failure": "failed"}
    finally:
        process.terminate()
        process.join()


def main():
    if len(sys.argv) != 2:
        raise SystemExit("usage: orientation.py CLOUD")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    for method in METHODS:
        print(json.dumps({"method": method, **run(sys.argv[1], method)}), flush=True)


if __name__ == "__main__":
    main()
