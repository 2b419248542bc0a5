"""Conditions that a mesh can be held to, each with a reason and the places where it fails.

``check_mesh(mesh, {"watertight": True, "planar": 1.0})`` answers for each condition named. What is measured is in
``inspection``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from curvify import inspection
from curvify.errors import OptionError
from curvify.findings import MOST_PLACES, Finding, first_ids, worst_first
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.options import MeshOptions
from curvify.prepare import Coarse, prepare_mesh
from curvify.words import count_of


def check_mesh(mesh: PolygonMesh, conditions: Mapping[str, float | bool], weld: str = "auto") -> list[Finding]:
    """Findings for the conditions named, in the order of ``CONDITIONS``.

    Values are limits (degrees, counts), True for conditions without one. The mesh is welded first, as ``weld`` says
    (see ``options.MeshOptions``). Raises OptionError for an unknown condition, MeshError for a mesh without faces.
    """
    unknown = sorted(set(conditions) - set(CONDITIONS))
    if unknown:
        raise OptionError(f"no condition {', '.join(unknown)}; there are {', '.join(CONDITIONS)}")
    coarse = prepare_mesh(mesh, MeshOptions(weld=weld))
    return [CONDITIONS[name](coarse, float(conditions[name])) for name in CONDITIONS if name in conditions]


# --- findings of one kind -----------------------------------------------------------------------------------------


def _edges(coarse: Coarse, name: str, kinds: list[tuple[Ints, str]]) -> Finding:
    """Fails where any of the kinds of edges occurs: ``(edges, what they are)``."""
    found = [(edges, text) for edges, text in kinds if len(edges)]
    places = np.concatenate([inspection.edge_ends(coarse, edges) for edges, _ in kinds])
    reason = ", ".join(f"{count_of(len(edges), 'edge')} {text}" for edges, text in found)
    where = tuple((int(a), int(b)) for a, b in places[:MOST_PLACES])
    return Finding(name, not found, reason, count=len(places), kind="edge", where=where)


def _ids(name: str, kind: str, ids: Ints, one: str, many: str) -> Finding:
    """Fails where there are any faces or vertices of a bad kind."""
    reason = count_of(len(ids), one, many) if len(ids) else ""
    return Finding(name, not len(ids), reason, count=len(ids), kind=kind, where=first_ids(ids))


def _largest(name: str, kind: str, values: Floats, places: Any, limit: float, unit: str) -> Finding:
    """Fails where any of the ``values`` exceeds the limit; ``places`` names each value."""
    worst = worst_first(values, values > limit)
    largest = float(values.max(initial=0.0))
    many = f" in {count_of(len(worst), kind)}" if len(worst) else ""
    reason = f"up to {largest:.3g} {unit}{many}"
    where = tuple(places(worst[:MOST_PLACES]))
    return Finding(name, not len(worst), reason, limit, largest, len(worst), kind, where)


def _at_most(name: str, number: int, limit: float, what: str) -> Finding:
    return Finding(name, number <= limit, count_of(number, what), limit, number)


# --- the conditions -----------------------------------------------------------------------------------------------


def _watertight(coarse: Coarse, _: float) -> Finding:
    kinds = [
        (inspection.open_edges(coarse), "of one face only"),
        (inspection.crowded_edges(coarse), "of more than two faces"),
        (inspection.reversed_edges(coarse), "whose faces run the same way"),
    ]
    return _edges(coarse, "watertight", kinds)


def _manifold(coarse: Coarse, _: float) -> Finding:
    crowded = inspection.crowded_edges(coarse)
    edges = _edges(coarse, "manifold", [(crowded, "of more than two faces")])
    if not edges.passed:
        return edges
    pinched = inspection.pinched_vertices(coarse)
    one, many = "vertex joins surfaces that share no edge there", "vertices join surfaces that share no edge there"
    return _ids("manifold", "vertex", pinched, one, many)


def _oriented(coarse: Coarse, _: float) -> Finding:
    return _edges(coarse, "oriented", [(inspection.reversed_edges(coarse), "whose faces run the same way")])


def _positive_volume(coarse: Coarse, _: float) -> Finding:
    volume = inspection.volume(coarse)
    if volume is None:
        return Finding("positive_volume", False, "the mesh is not closed, so it has no volume")
    return Finding("positive_volume", volume > 0, f"the volume is {volume:.6g}", 0.0, volume)


def _no_degenerate(coarse: Coarse, _: float) -> Finding:
    faces = inspection.degenerate_faces(coarse)
    return _ids("no_degenerate", "face", faces, "face without area", "faces without area")


def _no_duplicates(coarse: Coarse, _: float) -> Finding:
    faces = coarse.loops.source_faces[inspection.repeated_loops(coarse.loops)]
    one, many = "face has the vertices of an earlier one", "faces have the vertices of an earlier one"
    return _ids("no_duplicates", "face", faces, one, many)


def _no_unused(coarse: Coarse, _: float) -> Finding:
    vertices = inspection.unused_vertices(coarse.mesh)
    return _ids("no_unused", "vertex", vertices, "vertex in no face", "vertices in no face")


def _convex(coarse: Coarse, _: float) -> Finding:
    faces = inspection.concave_faces(coarse)
    return _ids("convex", "face", faces, "face is concave or touches itself", "faces are concave or touch themselves")


def _planar(coarse: Coarse, limit: float) -> Finding:
    source = coarse.loops.source_faces
    return _largest("planar", "face", inspection.tilts(coarse), lambda rows: first_ids(source[rows]), limit, "degrees")


def _g1(coarse: Coarse, limit: float) -> Finding:
    edges, angles = inspection.bends(coarse, inspection.sharp_edges(coarse))

    def places(rows: Ints) -> list[tuple[int, int]]:
        return [(int(a), int(b)) for a, b in inspection.edge_ends(coarse, edges[rows])]

    return _largest("g1", "edge", angles, places, limit, "degrees")


def _max_sides(coarse: Coarse, limit: float) -> Finding:
    sizes = coarse.mesh.face_sizes
    return _largest("max_sides", "face", sizes.astype(np.float64), first_ids, limit, "sides")


def _max_faces(coarse: Coarse, limit: float) -> Finding:
    return _at_most("max_faces", coarse.mesh.face_count, limit, "face")


def _max_pieces(coarse: Coarse, limit: float) -> Finding:
    return _at_most("max_pieces", inspection.pieces(coarse).count, limit, "piece")


#: Every condition by its name; those with a limit are in ``LIMITS``.
CONDITIONS: dict[str, Callable[[Coarse, float], Finding]] = {
    "watertight": _watertight,
    "manifold": _manifold,
    "oriented": _oriented,
    "positive_volume": _positive_volume,
    "no_degenerate": _no_degenerate,
    "no_duplicates": _no_duplicates,
    "no_unused": _no_unused,
    "convex": _convex,
    "planar": _planar,
    "g1": _g1,
    "max_sides": _max_sides,
    "max_faces": _max_faces,
    "max_pieces": _max_pieces,
}
LIMITS = ("planar", "g1", "max_sides", "max_faces", "max_pieces")
