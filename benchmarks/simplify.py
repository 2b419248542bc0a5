"""Simplification beside quadric decimation at equal storage: how close, how well shaped, how long.

    python benchmarks/simplify.py MESH... --faces 300,1000

Runs in one process with curvify and fast-simplification installed, and pymeshlab where it is; without MESH it makes
its own dense meshes from sample_meshes/. Storage counts floats and indices alike: polygons 3 V + 2 S + sum of sides +
F (S sectors, each a normal of two numbers), triangles 3 V + 3 T. Distances are percent of the diagonal of the
bounding box, both ways, normals degrees (rms) between the dense mesh's faces and the nearest of the others.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

import curvify
from curvify.mesh import PolygonMesh
from curvify.nearest import nearest_points, places_on, spread
from curvify.normals import unit
from curvify.prepare import prepare_mesh
from curvify.simplify import Fit, Options, simplify_and_fit
from curvify.simplify.accuracy import Surface, flat_triangles, refined_triangles, two_way_distances
from curvify.simplify.folds import folded_corners
from curvify.simplify.polygons import shapes_of
from curvify.simplify.triangles import Triangles, face_components, prepare_triangles
from curvify.simplify.vsa import SWEEPS, Metric, cluster, exchange, region_errors

SAMPLES = Path(__file__).resolve().parent.parent / "sample_meshes"
OWN = ("pawn", "vase", "l_part", "torus")
COLUMNS = ("mesh", "what", "faces", "numbers", "CPU s", "rms %", "max %", "normals")


@dataclass
class Row:
    """One line of the table."""

    what: str
    faces: int
    numbers: int
    seconds: float
    rms: float
    largest: float
    normals: float

    def cells(self, mesh: str) -> list[str]:
        """The line's cells."""
        measured = [f"{self.seconds:.1f}", f"{100 * self.rms:.4f}", f"{100 * self.largest:.2f}", f"{self.normals:.1f}"]
        return [mesh, self.what, str(self.faces), str(self.numbers), *measured]


def normal_deviation(dense: Triangles, other: Surface, count: int = 20_000) -> float:
    """Root mean square angle in degrees between the dense faces' normals and those of the nearest other faces."""
    faces, weights = spread(dense.positions, dense.vertices, count)
    points = places_on(dense.positions, dense.vertices[faces], weights)
    a, b, c = (other[0][other[1][:, i]] for i in range(3))
    normals = unit(np.cross(b - a, c - a))[nearest_points(points, *other)[1]]
    cosine = np.clip(np.einsum("ni,ni->n", normals, dense.normals[faces]), -1, 1)
    return float(np.degrees(np.sqrt((np.arccos(cosine) ** 2).mean())))


def measured(what: str, dense: Triangles, surface: Surface, faces: int, numbers: int, seconds: float) -> Row:
    """A row for one surface."""
    found = two_way_distances(surface, (dense.positions, dense.vertices), dense.diagonal)
    return Row(what, faces, numbers, seconds, found.rms, found.max, normal_deviation(dense, surface))


def storage(mesh: PolygonMesh) -> int:
    """Numbers that a coarse mesh needs."""
    coarse = prepare_mesh(mesh)
    sectors = len(np.unique(coarse.sectors))
    return 3 * mesh.vertex_count + 2 * sectors + mesh.corner_count + mesh.face_count


def of_curvify(mesh: PolygonMesh, faces: int, compactness: float) -> tuple[list[Row], int, str]:
    """Polygons flat and refined, without and with a fit, the numbers that the fitted ones need, and what they are like.

    Normals fitted, and normals and vertices.
    """
    rows, chosen = [], Options(faces=faces, compactness=compactness)
    for mode, name in (("none", "refined"), ("normals", "normals fitted"), ("full", "fitted")):
        start = time.process_time()
        result = simplify_and_fit(mesh, chosen, Fit(mode))
        seconds = time.process_time() - start
        coarse, original = result.mesh, result.simplified.original
        surfaces = [(name, refined_triangles(coarse))]
        if mode == "none":
            surfaces.insert(0, ("flat", flat_triangles(coarse)))
        numbers = storage(coarse)
        rows += [measured(what, original, surface, coarse.face_count, numbers, seconds) for what, surface in surfaces]
    folds = folded_corners(coarse)
    shapes = shapes_of(coarse.positions, coarse.face_vertices, coarse.face_sizes)
    thin = np.degrees(np.arcsin(np.clip(shapes.least_sines, 0, 1))) < 10
    about = (
        f"{coarse.face_sizes.mean():.2f} sides, {100 * (coarse.face_sizes > 3).mean():.0f} % with more than 3, "
        f"{100 * thin.mean():.0f} % with an angle below 10 degrees, unevenness {np.median(shapes.unevenness):.3f}, "
        f"{100 * folds.polygons(folds.reversed).mean():.1f} % with a reversed corner"
    )
    return rows, numbers, about


def of_fast_simplification(dense: Triangles, count: int) -> Surface:
    """Quadric decimation by fast-simplification."""
    import fast_simplification

    points, faces = fast_simplification.simplify(
        dense.positions.astype(np.float32), dense.vertices.astype(np.int32), target_count=count
    )
    return points.astype(np.float64), faces.astype(np.int64)


def of_pymeshlab(dense: Triangles, count: int) -> Surface:
    """Quadric decimation by MeshLab."""
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(dense.positions, dense.vertices.astype(np.int32)))
    meshes.meshing_decimation_quadric_edge_collapse(targetfacenum=count, preservetopology=True)
    mesh = meshes.current_mesh()
    return mesh.vertex_matrix(), mesh.face_matrix().astype(np.int64)


def peers() -> dict[str, Callable[[Triangles, int], Surface]]:
    """The competitors that are installed."""
    known = {"fast_simplification": of_fast_simplification, "pymeshlab": of_pymeshlab}
    return {name: run for name, run in known.items() if find_spec(name)}


def rows_of(mesh: PolygonMesh, faces: int, compactness: float) -> tuple[list[Row], str]:
    """All competitors on one mesh, and what curvify's polygons are like."""
    rows, numbers, about = of_curvify(mesh, faces, compactness)
    dense = prepare_triangles(mesh)[0]
    for name, run in peers().items():
        start = time.process_time()
        surface = run(dense, max(int(numbers / 4.5), 4))
        seconds = time.process_time() - start
        used = len(np.unique(surface[1]))
        rows.append(measured(name, dense, surface, len(surface[1]), 3 * used + 3 * len(surface[1]), seconds))
    return rows, about


def energies(mesh: PolygonMesh, counts: list[int]) -> list[str]:
    """L2,1 energy without compactness for numbers of regions, and the time it takes."""
    dense = prepare_triangles(mesh)[0]
    metric, lines = Metric.of(dense), []
    for count in counts:
        start = time.process_time()
        labels = exchange(dense, metric, cluster(dense, metric, count, face_components(dense)), SWEEPS)
        took = time.process_time() - start
        lines.append(f"{count} regions: L2,1 energy {region_errors(metric, labels).sum():.5g}, {took:.1f} s CPU")
    return lines


def own_meshes() -> dict[str, PolygonMesh]:
    """Dense meshes refined from the samples."""
    return {name: dense_sample(SAMPLES / f"{name}.obj") for name in OWN}


def dense_sample(path: Path) -> PolygonMesh:
    """A sample refined far."""
    dense = curvify.refine(curvify.read(path), level=8)
    return PolygonMesh(dense.positions, 4 * np.arange(len(dense.faces) + 1), dense.faces.reshape(-1))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("meshes", nargs="*", type=Path)
    parser.add_argument("--faces", default="300,1000")
    parser.add_argument("--regions", default="200,1000")
    parser.add_argument("--compactness", type=float, default=4.0)
    args = parser.parse_args()
    meshes = {path.stem: curvify.read(path) for path in args.meshes} if args.meshes else own_meshes()
    print("| " + " | ".join(COLUMNS) + " |\n|" + " --- |" * len(COLUMNS), flush=True)
    notes = []
    for name, mesh in meshes.items():
        for faces in map(int, args.faces.split(",")):
            rows, about = rows_of(mesh, faces, args.compactness)
            notes.append(f"- {name}, {faces} faces: {about}")
            print("\n".join("| " + " | ".join(row.cells(name)) + " |" for row in rows), flush=True)
        notes += [f"- {name}, {line}" for line in energies(mesh, [int(k) for k in args.regions.split(",")])]
    print("\n" + "\n".join(notes))


if __name__ == "__main__":
    main()
