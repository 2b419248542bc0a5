"""Normals to shade a mesh with: the file's own, each face's, or averages that stop at sharp edges."""

from __future__ import annotations

import numpy as np

from curvify.errors import OptionError
from curvify.mesh import Floats, PolygonMesh
from curvify.normals import degrees_between, sector_normals, unit
from curvify.polygons import newell_normals
from curvify.topology import Topology, build_topology, clean_loops, components, corner_links, weld_vertices

SHADINGS = ("auto", "flat", "smooth")
#: Where the edges that are not sharp bend by more degrees than this, on average over their length, a mesh is coarse
#: and shows its faces.
COARSE = 10.0
#: Meshes with more faces than this are never coarse: what they bend by is detail.
FINE = 10_000
#: Edges at which the faces of a fine mesh without normals meet at more degrees than this stay sharp.
SHARP = 40.0


def shading_normals(mesh: PolygonMesh, shading: str = "auto") -> Floats:
    """Unit normals of the corners ``(C,3)`` to shade a mesh with; zero where there is none.

    ``flat``: each face's own. ``smooth``: the average at each vertex, weighted by angle, whatever the file says.
    ``auto``: the file's normals; without any, flat for a mesh that is coarse and else smooth between sharp edges.
    Raises OptionError for another word.
    """
    if shading not in SHADINGS:
        raise OptionError(f"shading must be one of {', '.join(SHADINGS)}, not {shading!r}")
    if shading == "smooth":
        return _averaged(mesh, 180.0)
    if shading == "auto" and mesh.corner_normals is not None:
        return unit(np.nan_to_num(mesh.corner_normals, posinf=0.0, neginf=0.0))
    if shading == "auto":
        return _averaged(mesh, None)
    area = newell_normals(mesh.positions, mesh.face_offsets, mesh.face_vertices)
    return np.repeat(unit(area), mesh.face_sizes, axis=0)


def _averaged(mesh: PolygonMesh, sharp: float | None) -> Floats:
    """Averages of the faces that meet at up to ``sharp`` degrees; None: ``SHARP``, or 0 for a coarse mesh."""
    stand_in = weld_vertices(mesh.positions, mesh.face_offsets, mesh.face_vertices, "auto")
    loops = clean_loops(mesh.face_offsets, stand_in[mesh.face_vertices])
    normals = np.zeros((mesh.corner_count, 3))
    if not len(loops.source_faces):
        return normals
    topology = build_topology(mesh.positions, loops.offsets, loops.vertices)
    area = newell_normals(mesh.positions, loops.offsets, loops.vertices)
    a, b = corner_links(topology)
    angles = degrees_between(area[topology.faces[a]], area[topology.faces[b]])
    if sharp is None:
        coarse = mesh.face_count <= FINE and _mean_bend(mesh.positions, topology, angles) > COARSE
        sharp = 0.0 if coarse else SHARP
    soft = angles <= sharp
    sectors = components(len(topology.vertices), a[soft], b[soft])
    normals[loops.source_corners] = sector_normals(mesh.positions, loops.offsets, loops.vertices, area, sectors)
    return normals


def _mean_bend(positions: Floats, topology: Topology, angles: Floats) -> float:
    """Mean over the length of the edges that are not sharp of the angles, each given at both ends of its edge."""
    one = np.flatnonzero(topology.twin > np.arange(len(topology.twin)))
    bends = angles[: len(one)]
    step = positions[topology.vertices[one]] - positions[topology.vertices[topology.next[one]]]
    length = np.linalg.norm(step, axis=1) * (bends <= SHARP)
    total = float(length.sum())
    return float((bends * length).sum()) / total if total else 0.0
