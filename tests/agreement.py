"""How far the surfaces of the two backends are apart. No test lives here."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import curvify
from curvify.gpu.evaluate import GpuBackend
from curvify.mesh import PolygonMesh
from surfaces import cube, degrees, diagonal

SAMPLES = sorted((Path(__file__).parents[1] / "sample_meshes").glob("*.obj"))
#: Every scheme that has a program, with what its programs depend on.
SCHEMES = [
    ("gregory", {}),
    ("gregory", {"bulge": 0.2}),
    ("gregory", {"cross_tangent": "smooth", "bulge": 0.1}),
    ("gregory", {"cross_tangent": "linear"}),
    ("gregory", {"cross_tangent": "quadratic", "alpha": 1.3}),
    ("gregory", {"normals": "paper"}),
    ("gregory", {"cross_tangent": "quadratic", "normals": "paper"}),
    ("pn", {}),
    ("phong", {"alpha": 0.6}),
    ("png1", {}),
    ("png1", {"normals": "smooth"}),
    ("png1", {"kappa": 0.1, "crease_units": "edge"}),
    ("png1", {"kappa": 0.1, "normals": "smooth"}),
]
IDS = [" ".join([name, *map(str, options.values())]) for name, options in SCHEMES]
#: What is asked for; and what single precision gives for well-shaped patches.
POSITION, ANGLE = 1e-5, 0.05
USUAL_POSITION, USUAL_ANGLE = 1e-6, 2e-3


def gaps(surface: curvify.Surface, level: int, gpu: GpuBackend, dtype: type = np.float64) -> tuple[float, float]:
    """Largest distance over the diagonal and largest angle between the dense meshes of the two backends."""
    wanted = surface.refine(level, dtype)
    found = surface.refine(level, dtype, backend=gpu)
    assert found.positions.dtype == wanted.positions.dtype == dtype
    for name in ("faces", "face_wedges", "repeats", "source_faces"):
        assert np.array_equal(getattr(found, name), getattr(wanted, name))
    apart = np.linalg.norm(found.positions.astype(float) - wanted.positions.astype(float), axis=1)
    angle = degrees(found.normals.astype(float), wanted.normals.astype(float))
    return float(apart.max()) / diagonal(surface.patches.positions), float(angle.max())


def check_close(found: tuple[float, float], most: tuple[float, float] = (USUAL_POSITION, USUAL_ANGLE)) -> None:
    """Both gaps are small enough."""
    assert found[0] <= most[0]
    assert found[1] <= most[1]


def creased() -> PolygonMesh:
    """A cube with the normals of its faces: sharp at every edge."""
    mesh = cube()
    corners = [face.tolist() for face in np.split(mesh.face_vertices, mesh.face_offsets[1:-1])]
    points = mesh.positions[mesh.face_vertices].reshape(-1, 4, 3)
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 1])
    sharp = PolygonMesh.from_faces(mesh.positions, corners)
    sharp.corner_normals = np.repeat(normals / np.linalg.norm(normals, axis=1, keepdims=True), 4, axis=0)
    return sharp
