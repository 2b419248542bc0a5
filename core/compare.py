"""Do two meshes agree? Number by number where they have the same topology, as surfaces where they need not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from curvify.deviation import SAMPLES, Apart, same_topology, surfaces_apart
from curvify.findings import MOST_PLACES, Finding, first_ids, worst_first
from curvify.mesh import Bools, Floats, Ints, PolygonMesh
from curvify.normals import SAME_NORMAL, degrees_between
from curvify.words import count_of


def compare_meshes(
    a: PolygonMesh, b: PolygonMesh, tolerance: float = 0.0, normal_tolerance: float | None = None
) -> list[Finding]:
    """Compare mesh B with mesh A, vertex by vertex: one finding for the topology and each attribute.

    ``tolerance`` is a length; ``normal_tolerance`` degrees, by default 0 if the tolerance is 0 and 0.1 otherwise. With
    a tolerance, texture coordinates may differ by the same share of their own extent and bytes of colors by 1. Where
    the topology differs there is nothing else to compare, and its finding is the only one.
    """
    topology = _topology(a, b)
    if not topology.passed:
        return [topology]
    if normal_tolerance is None:
        normal_tolerance = SAME_NORMAL if tolerance else 0.0
    share = tolerance / (_extent(a.positions) or 1.0)
    positions = _values("positions", a.positions, b.positions, tolerance, np.arange(a.vertex_count))
    return [topology, positions, *_attributes(a, b, share, normal_tolerance), *_labels(a, b)]


def compare_surfaces(
    a: PolygonMesh,
    b: PolygonMesh,
    tolerance: float | None,
    normal_tolerance: float | None = None,
    samples: int = SAMPLES,
) -> tuple[list[Finding], Apart]:
    """Compare two surfaces whatever their topology: findings for the tolerances that are given, and the measurements.

    Raises MeshError for a mesh without a face that has an area.
    """
    apart = surfaces_apart(a, b, samples)
    findings = []
    if tolerance is not None:
        at = ", ".join(f"{x:.6g}" for x in apart.at)
        reason = f"up to {apart.hausdorff:.4g} ({100 * apart.share:.3g} %) apart, at ({at}), rms {apart.rms:.4g}"
        findings.append(Finding("surface", apart.hausdorff <= tolerance, reason, tolerance, apart.hausdorff))
    if normal_tolerance is not None:
        reason = f"{apart.normal_most:.4g} degrees apart in 99 of 100 places, {apart.normal_mean:.4g} in the mean"
        findings.append(
            Finding("normals", apart.normal_most <= normal_tolerance, reason, normal_tolerance, apart.normal_most)
        )
    return findings, apart


def _extent(points: Floats) -> float:
    """Diagonal of the bounds of points ``(n,c)``."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def _topology(a: PolygonMesh, b: PolygonMesh) -> Finding:
    if same_topology(a, b):
        return Finding("topology", True, _size(a))
    if (a.vertex_count, a.face_count) != (b.vertex_count, b.face_count):
        return Finding("topology", False, f"A has {_size(a)}, B has {_size(b)}")
    other = a.face_sizes != b.face_sizes
    if not other.any():
        moved = a.corner_faces[a.face_vertices != b.face_vertices]
        other[moved] = True
    faces = np.flatnonzero(other)
    reason = f"{count_of(len(faces), 'face has', 'faces have')} other vertices"
    return Finding("topology", False, reason, count=len(faces), kind="face", where=first_ids(faces))


def _size(mesh: PolygonMesh) -> str:
    return f"{count_of(mesh.vertex_count, 'vertex', 'vertices')} and {count_of(mesh.face_count, 'face')}"


def _attributes(a: PolygonMesh, b: PolygonMesh, share: float, normal_tolerance: float) -> Iterator[Finding]:
    """Findings for what corners and vertices carry; attributes that neither mesh has are passed over."""
    vertices = a.face_vertices
    carried: list[tuple[str, Any, Any]] = [
        ("normals", a.corner_normals, b.corner_normals),
        ("texture coordinates", a.corner_uvs, b.corner_uvs),
        ("colors", a.vertex_colors, b.vertex_colors),
    ]
    for name, one, other in carried:
        if one is None and other is None:
            continue
        if one is None or other is None:
            yield Finding(name, False, f"only {'A' if other is None else 'B'} has them")
        elif one.shape != other.shape:
            yield Finding(name, False, f"A has {one.shape[1]} for each, B has {other.shape[1]}")
        elif name == "normals":
            yield _values(name, one, other, normal_tolerance, vertices, degrees_between, " degrees")
        elif name == "colors":
            step = (1.0 if one.dtype.kind != "f" else 1 / 255) if share else 0.0
            one, other = one.astype(np.float64), other.astype(np.float64)
            yield _values(name, one, other, step, np.arange(a.vertex_count), _largest_step)
        else:
            yield _values(name, one, other, share * _extent(one[~np.isnan(one).any(axis=1)]), vertices)


def _distance(a: Floats, b: Floats) -> Floats:
    """Distance between rows."""
    return np.linalg.norm(a - b, axis=1)


def _largest_step(a: Floats, b: Floats) -> Floats:
    """Largest difference in each of the rows."""
    return np.abs(a - b).max(axis=1)


def _values(
    name: str,
    a: Floats,
    b: Floats,
    tolerance: float,
    owners: Ints,
    measure: Callable[[Floats, Floats], Floats] = _distance,
    unit: str = "",
) -> Finding:
    """Rows of numbers that belong to the vertices ``owners``: how far they are apart, and the worst."""
    differ: Bools = ((a != b) & ~(np.isnan(a) & np.isnan(b))).any(axis=1)
    if not differ.any():
        return Finding(name, True, "equal", tolerance, 0.0)
    rows = np.flatnonzero(differ)
    off = np.zeros(len(a))
    off[rows] = measure(a[rows], b[rows])
    off[np.isnan(off)] = np.inf
    failing = off > tolerance if tolerance else differ
    worst = worst_first(off, failing)
    at = int(worst[0]) if len(worst) else int(off.argmax())
    vertex = int(owners[at])
    reason = f"up to {off[at]:.4g}{unit} apart, at vertex {vertex}: {_row(a[at])} in A, {_row(b[at])} in B"
    vertices = list(dict.fromkeys(owners[worst].tolist()))
    measured = float(off.max()) if np.isfinite(off).all() else None
    where = tuple(vertices[:MOST_PLACES])
    return Finding(name, not len(worst), reason, tolerance, measured, len(vertices), "vertex", where)


def _row(values: Floats) -> str:
    return "(" + ", ".join(f"{x:.9g}" for x in values) + ")"


def _labels(a: PolygonMesh, b: PolygonMesh) -> Iterator[Finding]:
    """Findings for what faces are called: materials and groups by name."""
    kinds = {"materials": ("face_materials", "material_names"), "groups": ("face_groups", "group_names")}
    for name, fields in kinds.items():
        one, other = (_names(mesh, *fields) for mesh in (a, b))
        faces = np.flatnonzero(one != other)
        if len(faces):
            first = f"face {faces[0]} is in '{one[faces[0]]}' in A, in '{other[faces[0]]}' in B"
            reason = f"{count_of(len(faces), 'face differs', 'faces differ')}: {first}"
            yield Finding(name, False, reason, count=len(faces), kind="face", where=first_ids(faces))
        elif one.any():
            yield Finding(name, True, "equal")


def _names(mesh: PolygonMesh, labels: str, names: str) -> Any:
    """Name of the label of each face, empty where it has none."""
    numbers = getattr(mesh, labels)
    if numbers is None:
        return np.full(mesh.face_count, "", dtype=object)
    return np.array([*getattr(mesh, names), ""], dtype=object)[numbers]
