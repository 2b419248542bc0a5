"""From a dense mesh to a coarse one with normals and marks: the steps in order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from curvify.mesh import Bools, Ints, Marks, PolygonMesh
from curvify.simplify.checks import check_polygons
from curvify.simplify.decimate import lightened
from curvify.simplify.features import flat_polygons, sector_normals
from curvify.simplify.polygons import Polygons
from curvify.simplify.search import Attempt, Options, Progress, as_they_are, find_polygons
from curvify.simplify.triangles import Triangles, prepare_triangles
from curvify.simplify.vsa import Metric
from curvify.words import count_of


@dataclass(eq=False)
class Simplified:
    """A coarse mesh and what it was made from.

    ``mesh`` with corner normals and marks; ``original`` the triangles of the input; ``dense`` those that were worked
    on, the same unless the input is very large; ``polygons`` in vertices of ``dense``, ``labels (F,)`` the region of
    each of its triangles, ``creases (C,)`` half-edges; ``counts``; ``warnings``.
    """

    mesh: PolygonMesh
    original: Triangles
    dense: Triangles
    polygons: Polygons
    labels: Ints
    creases: Bools
    counts: dict[str, int]
    warnings: list[str]


def simplify(mesh: PolygonMesh, options: Options, progress: Progress | None = None) -> Simplified:
    """Few convex polygons for a dense mesh. Raises MeshError where there is nothing to simplify.

    ``progress(stage, share)`` is told what is being done and the share of all work that is behind.
    """
    tell = progress or (lambda stage, share: None)
    tell("cleaning", 0.0)
    original, notes = prepare_triangles(mesh, options.weld)
    dense = lightened(original, options.faces or options.proxies or 1, notes)
    metric = Metric.of(dense)
    if options.faces is not None and options.faces >= dense.face_count:
        notes.append(f"the mesh has only {count_of(dense.face_count, 'triangle')}; they are kept as they are")
        attempt = as_they_are(dense, metric, options)
    else:
        attempt = find_polygons(dense, metric, options, notes, tell)
    tell("normals", 0.95)
    check_polygons(dense, attempt.polygons)
    counts = {"input_faces": mesh.face_count, "triangles": original.face_count}
    return _result(mesh, original, dense, attempt, counts, [*mesh.warnings, *notes])


def _result(
    mesh: PolygonMesh,
    original: Triangles,
    dense: Triangles,
    attempt: Attempt,
    counts: dict[str, int],
    warnings: list[str],
) -> Simplified:
    """The polygons as a mesh of their own, with normals and marks."""
    polygons, creases = attempt.polygons, attempt.creases
    normals = sector_normals(dense, attempt.labels, polygons, creases)
    used = np.zeros(len(dense.positions), dtype=bool)
    used[polygons.vertices] = True
    number = np.cumsum(used) - 1
    coarse = PolygonMesh(
        positions=dense.positions[used],
        face_offsets=polygons.offsets,
        face_vertices=number[polygons.vertices],
        corner_normals=normals,
        marks=_marks(dense, attempt, number),
        position_dtype=mesh.position_dtype,
    )
    counts |= {
        "regions": int(attempt.labels.max()) + 1,
        "faces": polygons.count,
        "vertices": coarse.vertex_count,
        "crease_edges": len(coarse.marks.crease_edges),
        "flat_faces": len(coarse.marks.flat_faces),
    }
    return Simplified(coarse, original, dense, polygons, attempt.labels, creases, counts, warnings)


def _marks(dense: Triangles, attempt: Attempt, number: Ints) -> Marks:
    """Crease edges, and flat faces that only creases or their like in one plane surround."""
    polygons, creases = attempt.polygons, attempt.creases
    topology = polygons.topology(dense.positions)
    once = np.flatnonzero(creases & (topology.twin > np.arange(len(creases))))
    edges = number[np.stack([polygons.vertices[once], polygons.vertices[topology.next[once]]], axis=1)]
    flat = flat_polygons(dense, attempt.labels, polygons)
    return Marks(
        crease_edges=edges,
        crease_sharpness=np.ones((len(edges), 2)),
        flat_faces=np.flatnonzero(flat & _set_apart(topology.faces, topology.twin, creases, flat)),
    )


def _set_apart(faces: Ints, twin: Ints, creases: Bools, flat: Bools) -> Bools:
    """Faces ``(P,)`` each side of which is a crease, a boundary or shared with a flat face."""
    beside = (twin >= 0) & flat[faces[np.maximum(twin, 0)]]
    open_ = np.bincount(faces, ~(creases | beside), len(flat))
    return open_ == 0
