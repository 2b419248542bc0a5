"""How far surfaces are apart: nearest points, samples spread over a mesh, the sampled Hausdorff distance.

Nearest points come from libigl: on 190,000 triangles and 50,000 points it took 0.7 s where pymeshlab took 0.8 s (in
float32, 280 MB installed) and trimesh with rtree 5.3 s. Distances are in units of the file, angles in degrees.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np

from curvify.arrays import cross
from curvify.errors import MeshError
from curvify.mesh import Floats, Ints, PolygonMesh
from curvify.nearest import Nearest, corners_of, double_areas, places_on, spread
from curvify.normals import degrees_between
from curvify.palette import to_shown, value_colors
from curvify.triangulation import triangle_corners

SAMPLES = 100_000


@dataclass(eq=False)
class Triangles:
    """A mesh cut into triangles: ``positions (V,3)``, ``corners (T,3)`` of the mesh and their ``vertices (T,3)``."""

    mesh: PolygonMesh
    positions: Floats
    corners: Ints
    vertices: Ints

    def normals(self, triangles: Ints, weights: Floats, smooth: bool) -> Floats:
        """Normals ``(n,3)`` at barycentric ``weights (n,3)`` of triangles: of the file (``smooth``) or of the plane."""
        if smooth and self.mesh.corner_normals is not None:
            return np.einsum("nk,nki->ni", weights, self.mesh.corner_normals[self.corners[triangles]])
        a, b, c = corners_of(self.positions, self.vertices[triangles])
        return cross(b - a, c - a)

    @cached_property
    def nearest(self) -> Nearest:
        """What finds the nearest points on it."""
        return Nearest.of(self.positions, self.vertices)

    @property
    def has_normals(self) -> bool:
        """Whether the file gives every corner a normal."""
        return self.mesh.corner_normals is not None and not np.isnan(self.mesh.corner_normals).any()


def as_triangles(mesh: PolygonMesh) -> Triangles:
    """The triangles of a mesh that have an area. Raises MeshError where there are none."""
    corners = triangle_corners(mesh)
    vertices = mesh.face_vertices[corners]
    sized = double_areas(mesh.positions, vertices) > 0
    if not sized.any():
        raise MeshError("the mesh has no face with an area; there is no surface to measure from")
    return Triangles(mesh, mesh.positions, corners[sized], vertices[sized])


@dataclass(frozen=True)
class Apart:
    """How far surface A is from surface B, sampled.

    ``hausdorff`` the largest distance, either way, ``share`` that in parts of the diagonal of A's bounds, ``at`` where
    on A or B it is; ``rms`` and ``mean`` over the area of both; ``normal_most`` the angle that 99 of 100 samples keep,
    ``normal_mean`` the mean one. Samples at creases can find the wrong side, and one in a hundred allows for them.
    ``samples`` how many points were measured.
    """

    hausdorff: float
    share: float
    at: tuple[float, float, float]
    rms: float
    mean: float
    normal_most: float
    normal_mean: float
    samples: int

    def as_dict(self) -> dict[str, object]:
        """Plain data for JSON."""
        return asdict(self)


def surfaces_apart(a: PolygonMesh, b: PolygonMesh, samples: int = SAMPLES) -> Apart:
    """Measure from A to B and from B to A at ``samples`` points spread by area and as many vertices at most.

    Normals are those of the files where both have them for every corner, else those of the triangles.
    Raises MeshError for a mesh without a face that has an area.
    """
    one, other = as_triangles(a), as_triangles(b)
    smooth = one.has_normals and other.has_normals
    distances, angles, tops = [], [], []
    for source, target in ((one, other), (other, one)):
        triangles, weights = spread(source.positions, source.vertices, samples)
        points = places_on(source.positions, source.vertices[triangles], weights)
        far, hit, place = target.nearest(points)
        here = source.normals(triangles, weights, smooth)
        there = target.normals(hit, _weights(target, hit, place), smooth)
        vertices = _some(source.vertices.reshape(-1), samples)
        corner_far = target.nearest(source.positions[vertices])[0]
        all_far = np.concatenate([far, corner_far])
        worst = int(all_far.argmax())
        spot = points[worst] if worst < len(points) else source.positions[vertices[worst - len(points)]]
        tops.append((float(all_far[worst]), spot, len(all_far)))
        distances.append(far)
        angles.append(degrees_between(here, there))
    top = max(tops, key=lambda found: found[0])
    far, angle = np.concatenate(distances), np.concatenate(angles)
    return Apart(
        hausdorff=top[0],
        share=top[0] / float(np.linalg.norm(np.ptp(a.positions, axis=0))),
        at=tuple(float(x) for x in top[1]),  # type: ignore[arg-type]
        rms=float(np.sqrt(np.mean(far**2))),
        mean=float(far.mean()),
        normal_most=float(np.quantile(angle, 0.99)),
        normal_mean=float(angle.mean()),
        samples=sum(found[2] for found in tops),
    )


def _some(vertices: Ints, most: int) -> Ints:
    """Distinct vertices, ``most`` of them at equal steps where there are more."""
    used = np.flatnonzero(np.bincount(vertices))
    return used if len(used) <= most else used[np.linspace(0, len(used) - 1, most).astype(np.int64)]


def _weights(surface: Triangles, triangles: Ints, places: Floats) -> Floats:
    """Barycentric weights ``(n,3)`` of places in triangles."""
    a, b, c = corners_of(surface.positions, surface.vertices[triangles])
    normal = cross(b - a, c - a)
    square = np.einsum("ni,ni->n", normal, normal)
    v = np.einsum("ni,ni->n", cross(places - a, c - a), normal) / square
    w = np.einsum("ni,ni->n", cross(b - a, places - a), normal) / square
    return np.stack([1 - v - w, v, w], axis=1)


def same_topology(a: PolygonMesh, b: PolygonMesh) -> bool:
    """Whether two meshes have the same faces on as many vertices."""
    return (
        a.vertex_count == b.vertex_count
        and np.array_equal(a.face_offsets, b.face_offsets)
        and np.array_equal(a.face_vertices, b.face_vertices)
    )


def deviations(mesh: PolygonMesh, reference: PolygonMesh, surface: bool = False) -> Floats:
    """How far each vertex ``(V,)`` of a mesh is from the reference.

    From the same vertex where both have the same topology, unless ``surface``; else from the reference's surface.
    Raises MeshError for a reference without a face that has an area.
    """
    if same_topology(mesh, reference) and not surface:
        return np.linalg.norm(mesh.positions - reference.positions, axis=1)
    return as_triangles(reference).nearest(mesh.positions)[0]


def heat_map(mesh: PolygonMesh, values: Floats, most: float) -> PolygonMesh:
    """The mesh with vertex colors that show ``values (V,)``, from 0 to ``most``; larger ones have the last color."""
    shares = values / most if most > 0 else np.zeros_like(values)
    return mesh.with_(vertex_colors=np.rint(255 * to_shown(value_colors(shares))).astype(np.uint8))
