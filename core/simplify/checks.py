"""What must hold of the polygons before they are written: a refusal is better than a broken mesh."""

from __future__ import annotations

import numpy as np

from curvify.arrays import distinct
from curvify.errors import MeshError
from curvify.mesh import Ints, PolygonMesh
from curvify.nearest import nearest_points
from curvify.polygons import newell_normals
from curvify.simplify.polygons import Polygons, pillows, shapes_of
from curvify.simplify.triangles import Triangles
from curvify.topology import Topology, build_topology, fans

#: Mean distance, as a share of the smaller diagonal, from which on a mesh does not lie near another.
APART = 0.5


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


def check_near(mesh: PolygonMesh, dense: Triangles) -> None:
    """Raise MeshError unless the faces of a coarse mesh have an area and lie somewhere near the dense one."""
    if mesh.face_count and not newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices).any():
        raise MeshError("no face of the mesh has an area; there is nothing to fit")
    places = mesh.positions[distinct(mesh.face_vertices)[0]]
    if not len(places):
        return  # of that the fit has more to say
    away = float(nearest_points(places, dense.positions, dense.vertices)[0].mean())
    size = min(float(np.linalg.norm(np.ptp(places, axis=0))), dense.diagonal)
    if away > APART * size:
        raise MeshError(
            f"it does not lie near the dense mesh: the mean distance of its vertices is {away:.3g}, and the smaller of "
            f"the two meshes is {size:.3g} large; both must have the same units and place"
        )


def check_mesh_like(start: PolygonMesh, mesh: PolygonMesh) -> None:
    """Raise MeshError unless a mesh has the topology of the one that it was made from."""
    problems = differences(start, mesh)
    if problems:
        raise MeshError(f"the fitted mesh is not valid ({'; '.join(problems)}); please report it, and use --fit none")


def differences(start: PolygonMesh, mesh: PolygonMesh) -> list[str]:
    """What makes a mesh another surface than the one that it was made from, in words."""
    one, other = (build_topology(m.positions, m.face_offsets, m.face_vertices) for m in (start, mesh))
    problems = []
    tails, heads = other.vertices, other.vertices[other.next]
    directed = np.sort(tails * np.int64(other.vertex_count) + heads)
    if (directed[1:] == directed[:-1]).any() or other.nonmanifold.any():
        problems.append("edges with more than two faces")
    if (other.uses == 1).any() != (one.uses == 1).any():
        problems.append("other boundaries")
    if _euler(other) != _euler(one):
        problems.append(f"Euler number {_euler(other)} for {_euler(one)}")
    if len(distinct(fans(other))[0]) != len(distinct(other.vertices)[0]):
        problems.append("vertices with several fans")
    return problems


def _euler(topology: Topology) -> int:
    return len(distinct(topology.vertices)[0]) - len(topology.edges) + len(topology.offsets) - 1
