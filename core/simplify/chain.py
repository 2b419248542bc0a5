"""From a dense mesh to a coarse one with normals and marks: the steps in order."""

from __future__ import annotations

from dataclasses import dataclass

from curvify.mesh import Bools, Ints, PolygonMesh
from curvify.simplify.attempts import Attempt, Options, as_they_are
from curvify.simplify.checks import check_polygons
from curvify.simplify.crossings import crosses_itself, crossing_polygons
from curvify.simplify.decimate import lightened
from curvify.simplify.polygons import Polygons
from curvify.simplify.search import Progress, find_polygons
from curvify.simplify.triangles import Triangles, prepare_triangles
from curvify.simplify.vsa import Metric
from curvify.words import count_of


@dataclass(eq=False)
class Simplified:
    """A coarse mesh and what it was made from.

    ``mesh`` with corner normals and marks; ``original`` the triangles of the input; ``dense`` those that were worked
    on, the same unless the input is very large; ``polygons`` in vertices of ``dense``, ``labels (F,)`` the region of
    each of its triangles, ``creases (C,)`` half-edges; ``counts``; ``warnings``, of which the first ones, ``lasting``,
    hold whatever is done to the polygons later.
    """

    mesh: PolygonMesh
    original: Triangles
    dense: Triangles
    polygons: Polygons
    labels: Ints
    creases: Bools
    counts: dict[str, int]
    warnings: list[str]
    lasting: int


def simplify(mesh: PolygonMesh, options: Options, progress: Progress | None = None) -> Simplified:
    """Few convex polygons for a dense mesh. Raises MeshError where there is nothing to simplify.

    ``progress(stage, share)`` is told what is being done and the share of all work that is behind.
    """
    tell = progress or (lambda stage, share: None)
    tell("cleaning", 0.0)
    original, notes = prepare_triangles(mesh, options.weld)
    dense = lightened(original, options.faces or options.proxies or 1, notes)
    metric = Metric.of(dense)
    lasting = len(mesh.warnings) + len(notes)
    if options.faces is not None and options.faces >= dense.face_count:
        notes.append(f"the mesh has only {count_of(dense.face_count, 'triangle')}; more faces would add nothing")
        attempt = as_they_are(dense, metric, options)
    else:
        attempt = find_polygons(dense, metric, options, notes, tell)
    tell("normals", 0.95)
    check_polygons(dense, attempt.drawn.polygons)
    counts = {"input_faces": mesh.face_count, "triangles": original.face_count}
    counts["crossings"] = len(crossing_polygons(attempt.drawn.mesh))
    notes += crossing_notes(counts["crossings"], original)
    return _result(mesh, original, dense, attempt, counts, [*mesh.warnings, *notes], lasting)


def crossing_notes(crossings: int, original: Triangles) -> list[str]:
    """What there is to say of polygons that cross in so many places."""
    if not crossings:
        return []
    places = count_of(crossings, "place")
    return [f"polygons cross each other in {places}" + ", and so does the input" * crosses_itself(original)]


def _result(
    mesh: PolygonMesh,
    original: Triangles,
    dense: Triangles,
    attempt: Attempt,
    counts: dict[str, int],
    warnings: list[str],
    lasting: int,
) -> Simplified:
    """The mesh as the input's file would hold it, and what there is to say about it."""
    drawn = attempt.drawn
    coarse = drawn.mesh.with_(position_dtype=mesh.position_dtype)
    counts |= {
        "regions": int(attempt.labels.max()) + 1,
        "faces": coarse.face_count,
        "fold_cuts": attempt.extra,
        "vertices": coarse.vertex_count,
        "crease_edges": len(coarse.marks.crease_edges),
        "flat_faces": len(coarse.marks.flat_faces),
    }
    return Simplified(coarse, original, dense, drawn.polygons, attempt.labels, drawn.creases, counts, warnings, lasting)
