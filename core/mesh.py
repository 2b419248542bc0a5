"""The two mesh types: plain numpy arrays in, plain numpy arrays out.

A *corner* is a vertex in a face: corner ``c`` of a mesh is entry ``c`` of ``face_vertices``, and the
half-edge ``c`` runs from corner ``c`` to the next corner of the same face. A *wedge* is a vertex
together with one of its normals and texture coordinates (Hoppe 1996): most vertices have one wedge,
those on a crease or a texture seam have one for each side.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from curvify.errors import MeshError
from curvify.records import field, record, replaced

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.floating]
    Ints = NDArray[np.integer]
    Bools = NDArray[np.bool_]
else:  # numpy.typing takes a while to import
    Floats = Ints = Bools = np.ndarray


def _ints(*shape: int) -> Ints:
    return np.zeros(shape, dtype=np.int64)


def _floats(*shape: int) -> Floats:
    return np.zeros(shape, dtype=np.float64)


@record
class Marks:
    """Features and shape controls, by vertex and face ids of the mesh (0-based).

    ``crease_edges (M,2)`` with ``crease_sharpness (M,2)`` in 0..1 at either end: 1 is fully sharp, 0 smooth whatever
    weaker sources say. ``straight_edges (M,2)``; ``bent_edges (M,2)`` with ``edge_normals (M,3)``, the directions that
    these edges bend in; ``curled_edges (M,2)`` with ``kappas (M,)``, the crease height of ``png1``.
    ``corner_vertices (M,)`` with ``corner_sharpness (M,)`` in 0..1; ``flat_faces (M,)``; ``hole_faces (M,)``, which
    are left out; ``bulged_faces (M,)`` with ``bulges (M,)`` and ``full_faces (M,)`` with ``alphas (M,)``, how far
    these faces swell. What is marked twice has the later mark.
    """

    crease_edges: Ints = field(default_factory=lambda: _ints(0, 2))
    crease_sharpness: Floats = field(default_factory=lambda: _floats(0, 2))
    straight_edges: Ints = field(default_factory=lambda: _ints(0, 2))
    corner_vertices: Ints = field(default_factory=lambda: _ints(0))
    corner_sharpness: Floats = field(default_factory=lambda: _floats(0))
    flat_faces: Ints = field(default_factory=lambda: _ints(0))
    hole_faces: Ints = field(default_factory=lambda: _ints(0))
    bent_edges: Ints = field(default_factory=lambda: _ints(0, 2))
    edge_normals: Floats = field(default_factory=lambda: _floats(0, 3))
    curled_edges: Ints = field(default_factory=lambda: _ints(0, 2))
    kappas: Floats = field(default_factory=lambda: _floats(0))
    bulged_faces: Ints = field(default_factory=lambda: _ints(0))
    bulges: Floats = field(default_factory=lambda: _floats(0))
    full_faces: Ints = field(default_factory=lambda: _ints(0))
    alphas: Floats = field(default_factory=lambda: _floats(0))

    def counts(self) -> dict[str, int]:
        """How many marks there are of each kind, kinds without any left out."""
        kinds = {
            "crease": self.crease_edges,
            "straight": self.straight_edges,
            "edge normal": self.bent_edges,
            "kappa": self.curled_edges,
            "corner": self.corner_vertices,
            "flat": self.flat_faces,
            "hole": self.hole_faces,
            "bulge": self.bulged_faces,
            "alpha": self.full_faces,
        }
        return {name: len(items) for name, items in kinds.items() if len(items)}

    def validate(self, vertices: int, faces: int) -> None:
        """Raise MeshError unless all marks lie on the mesh's vertices and faces and have values in range."""
        for places, found, shape in (
            (self.crease_edges, self.crease_sharpness, (2,)),
            (self.bent_edges, self.edge_normals, (3,)),
            (self.curled_edges, self.kappas, ()),
            (self.corner_vertices, self.corner_sharpness, ()),
            (self.bulged_faces, self.bulges, ()),
            (self.full_faces, self.alphas, ()),
        ):
            if found.shape != (len(places), *shape):
                raise MeshError(f"{len(places)} marks need values of shape {(len(places), *shape)}, not {found.shape}")
        edges = (self.crease_edges, self.straight_edges, self.bent_edges, self.curled_edges)
        ends = np.concatenate([*(pairs.reshape(-1) for pairs in edges), self.corner_vertices])
        inner = np.concatenate([self.flat_faces, self.hole_faces, self.bulged_faces, self.full_faces])
        for what, ids, count in (("vertex", ends, vertices), ("face", inner, faces)):
            wrong = ids[(ids < 0) | (ids >= count)]
            if len(wrong):
                raise MeshError(f"a mark is on {what} {wrong[0]}, the mesh has {count} (counted from 0)")
        for what, values in (("crease", self.crease_sharpness), ("corner", self.corner_sharpness)):
            if not ((values >= 0) & (values <= 1)).all():
                raise MeshError(f"the sharpness of a {what} must be from 0 to 1")
        for what, values in (("edge normal", self.edge_normals), ("kappa", self.kappas), ("bulge", self.bulges)):
            if not np.isfinite(values).all():
                raise MeshError(f"the {what} of a mark must be finite")
        if not (np.isfinite(self.alphas) & (self.alphas > 0)).all():
            raise MeshError("the alpha of a face must be a positive number")


@record
class Looks:
    """What the materials of a glTF file look like, as its JSON says it (see ``formats.looks``).

    ``materials`` by name, ``textures`` and ``samplers`` as in the file; ``images`` with the bytes of each, None for
    those that cannot be found.
    """

    materials: dict[str, dict[str, Any]]
    textures: list[dict[str, Any]]
    samplers: list[dict[str, Any]]
    images: list[tuple[dict[str, Any], bytes | None]]


@record
class PolygonMesh:
    """A polygon mesh as files hold it.

    ``positions (V,3)`` float64. Faces are loops in compressed rows: face ``f`` has the vertices
    ``face_vertices[face_offsets[f]:face_offsets[f+1]]``, counter-clockwise seen from outside.
    Optional: ``corner_normals (C,3)`` and ``corner_uvs (C,2)`` float64, NaN rows where a corner has
    none; ``vertex_colors (V,3|4)`` as stored (uint8 or float); ``face_materials``,
    ``face_groups (F,)`` index into ``material_names``, ``group_names`` (-1: none);
    ``face_smoothing (F,)`` the smoothing group of each face (0: off), None where the file says nothing.
    ``looks`` is what the materials of a glTF file look like, for other glTF files. ``position_dtype`` is the type the
    file stored positions in, for ``--precision input``.
    """

    positions: Floats
    face_offsets: Ints
    face_vertices: Ints
    corner_normals: Floats | None = None
    corner_uvs: Floats | None = None
    vertex_colors: NDArray[np.generic] | None = None
    face_materials: Ints | None = None
    material_names: tuple[str, ...] = ()
    material_files: tuple[str, ...] = ()
    face_groups: Ints | None = None
    group_names: tuple[str, ...] = ()
    face_smoothing: Ints | None = None
    looks: Looks | None = None
    marks: Marks = field(default_factory=Marks)
    position_dtype: np.dtype[np.floating] = field(default_factory=lambda: np.dtype(np.float64))
    warnings: tuple[str, ...] = ()

    @classmethod
    def from_faces(cls, positions: object, faces: Sequence[Sequence[int]], **attributes: object) -> PolygonMesh:
        """Build a mesh from a list of polygons.

        ``positions`` (V,3), ``faces`` lists of vertex ids. Other fields by name.
        Raises MeshError where an index is out of range or a coordinate is not finite.
        """
        sizes = np.array([len(face) for face in faces], dtype=np.int64)
        offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        flat = np.array([v for face in faces for v in face], dtype=np.int64)
        mesh = cls(
            np.array(positions, dtype=np.float64).reshape(-1, 3), offsets, flat, **attributes  # type: ignore[arg-type]
        )
        mesh.validate()
        return mesh

    @property
    def vertex_count(self) -> int:
        return len(self.positions)

    @property
    def face_count(self) -> int:
        return len(self.face_offsets) - 1

    @property
    def corner_count(self) -> int:
        return len(self.face_vertices)

    @property
    def face_sizes(self) -> Ints:
        """Number of corners of each face ``(F,)``."""
        return np.diff(self.face_offsets)

    @property
    def corner_faces(self) -> Ints:
        """Face of each corner ``(C,)``."""
        return np.repeat(np.arange(self.face_count), self.face_sizes)

    def faces(self) -> list[list[int]]:
        """The faces as lists of vertex ids: for small meshes and tests."""
        if not self.face_count:
            return []
        return [part.tolist() for part in np.split(self.face_vertices, self.face_offsets[1:-1])]

    def with_(self, **changes: object) -> PolygonMesh:
        """A copy that differs in the named fields (arrays are shared)."""
        return replaced(self, **changes)

    def validate(self) -> None:
        """Raise MeshError unless shapes agree, indices are in range and coordinates are finite."""
        if self.positions.ndim != 2 or self.positions.shape[1] != 3:
            raise MeshError(f"positions must have shape (V,3), not {self.positions.shape}")
        bad = np.flatnonzero(~np.isfinite(self.positions).all(axis=1))
        if len(bad):
            raise MeshError(f"vertex {bad[0]} has a coordinate that is not a finite number; remove or mend it")
        if len(self.face_vertices):
            low, high = int(self.face_vertices.min()), int(self.face_vertices.max())
            if low < 0 or high >= self.vertex_count:
                wrong = low if low < 0 else high
                raise MeshError(f"a face refers to vertex {wrong}, the mesh has {self.vertex_count} (counted from 0)")
        if len(self.face_offsets) == 0 or self.face_offsets[0] != 0 or self.face_offsets[-1] != self.corner_count:
            raise MeshError("face_offsets must start at 0 and end at the number of corners")
        if np.any(np.diff(self.face_offsets) < 0):
            raise MeshError("face_offsets must not decrease")


@record
class DenseMesh:
    """A refined mesh, welded: every point of the surface is one vertex.

    ``positions (P,3)``; ``faces (Q,s)`` vertex ids, s = 3 or 4, counter-clockwise from outside.
    Wedge ``w < P`` belongs to vertex ``w``; wedge ``P + r`` repeats vertex ``repeats[r]`` with another
    normal or uv. ``normals (P+R,3)`` unit (zero where a vertex is in no face), ``uvs (P+R,2)`` or None;
    ``face_wedges (Q,s)`` is ``faces`` itself where nothing repeats. ``colors (P,c)`` or None.
    ``source_faces (Q,)`` is the input face of each cell, ``source_parameters (Q,2)`` the cell's center in
    the domain of its patch (specs of the scheme), ``source_patches (Q,)`` the patch itself.
    """

    positions: Floats
    faces: Ints
    normals: Floats
    repeats: Ints
    face_wedges: Ints
    uvs: Floats | None = None
    colors: NDArray[np.generic] | None = None
    source_faces: Ints | None = None
    source_patches: Ints | None = None
    source_parameters: Floats | None = None
    face_materials: Ints | None = None
    material_names: tuple[str, ...] = ()
    material_files: tuple[str, ...] = ()
    looks: Looks | None = None
    face_groups: Ints | None = None
    group_names: tuple[str, ...] = ()

    @property
    def vertex_count(self) -> int:
        return len(self.positions)

    @property
    def face_count(self) -> int:
        return len(self.faces)

    @property
    def wedge_vertices(self) -> Ints:
        """Vertex of every wedge ``(P+R,)``."""
        return np.concatenate([np.arange(self.vertex_count), self.repeats])
