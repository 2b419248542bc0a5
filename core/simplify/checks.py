"""What must hold of the polygons before they are written: a refusal is better than a broken mesh."""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct
from curvify.errors import MeshError
from curvify.mesh import Ints
from curvify.simplify.polygons import Polygons, pillows, shapes_of
from curvify.simplify.triangles import Triangles
from curvify.topology import Topology, fans


def check_polygons(dense: Triangles, polygons: Polygons) -> None:
    """Raise MeshError unless the polygons are a manifold of the dense mesh's topology, without concave faces.

    No vertex twice in a face; every directed edge once; closed where the input is; one fan at every vertex; the
    input's Euler number; no two faces on one set of vertices; no face concave or without area, a triangle of the
    dense mesh excepted.
    """
    problems = find_problems(dense, polygons)
    if problems:
        raise MeshError(f"the simplified mesh is not valid ({'; '.join(problems)}); please report it")


def find_problems(dense: Triangles, polygons: Polygons) -> list[str]:
    """What is wrong with the polygons, in words."""
    topology = polygons.topology(dense.positions)
    problems = []

    def note(count: int, what: str) -> None:
        if count:
            problems.append(f"{count} {what}")

    tails, heads = polygons.vertices, polygons.vertices[topology.next]
    directed = np.sort(tails * np.int64(len(dense.positions)) + heads)
    note(int((directed[1:] == directed[:-1]).sum()), "edges run twice in one direction")
    note(int((topology.uses > 2).sum()), "edges with more than two faces")
    note(int((topology.uses == 1).any()) if dense.is_closed else 0, "open boundary in a closed mesh")
    note(int((topology.uses != 1).all()) if not dense.is_closed else 0, "lost boundary")
    used = len(distinct(polygons.vertices)[0])
    note(len(distinct(fans(topology))[0]) - used, "vertices with several fans")
    euler = used - len(topology.edges) + polygons.count
    note(int(euler != dense.euler_number), f"Euler number {euler} for {dense.euler_number}")
    note(len(pillows(polygons.vertices, polygons.sides)), "faces on the vertices of another")
    shapes = shapes_of(dense.positions, polygons.vertices, polygons.sides)
    kept = _is_triangle_of(dense, polygons, topology)
    note(int((~shapes.acceptable & ~kept).sum()), "concave or degenerate faces")
    return problems


def _is_triangle_of(dense: Triangles, polygons: Polygons, topology: Topology) -> Ints:
    """Whether each polygon is a single triangle of the dense mesh."""
    count = np.bincount(polygons.regions, minlength=1)
    single = count[polygons.regions] == 3
    whole = np.bincount(topology.faces, single & (polygons.sizes == 1), polygons.count)
    return (whole == 3) & (polygons.sides == 3)
