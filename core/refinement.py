"""Mesh, scheme, level and backend to a dense mesh: in arrays, or block by block into a file.

The dense mesh is cut into jobs of fixed size, each of which knows where its blocks go (``jobs``, ``weld``). Threads
take jobs in order; a sink that can write anywhere takes blocks as they come, the others in order.
"""

from __future__ import annotations

import os
from contextlib import nullcontext
from typing import Any

import numpy as np

from curvify import evaluate
from curvify.arrays import cross
from curvify.backends import Backend, open_backend
from curvify.errors import LimitError, OptionError
from curvify.jobs import dense_jobs, dense_layout
from curvify.mesh import DenseMesh, Floats, Ints, PolygonMesh
from curvify.records import field, record, replaced
from curvify.schemes import load_scheme
from curvify.schemes.base import Patches
from curvify.sinks import ArraySink, DenseLayout, Sink
from curvify.threads import Progress, run_jobs
from curvify.weld import cell_sources, number_dense_mesh, predict_faces

#: Faces that a dense mesh may have unless the caller allows more.
MAX_FACES = 50_000_000


@record
class Surface:
    """A surface over a polygon mesh, ready to be evaluated anywhere or refined.

    ``patches`` hold one patch for each face, or several for a face that had to be split; patch ``p`` belongs to
    input face ``source_faces[p]`` and has ``sides[p]`` sides. Its domain is the regular polygon with sides of
    length 1 around (0, 0), first corner on the positive xi axis.
    """

    patches: Patches
    scheme: str
    warnings: list[str] = field(default_factory=list)

    @property
    def source_faces(self) -> Ints:
        """Input face of each patch ``(P,)``."""
        return self.patches.source_faces

    @property
    def sides(self) -> Ints:
        """Number of sides of each patch ``(P,)``."""
        return self.patches.topology.sizes

    def evaluate(self, patches: Ints, points: Floats) -> tuple[Floats, Floats]:
        """Positions and unit normals ``(m,3)`` of patches ``(m,)`` at domain points ``(m,2)`` of their own.

        Raises OptionError for a patch that does not exist or a point outside its domain.
        """
        ids = np.atleast_1d(np.asarray(patches, dtype=np.int64))
        places = np.asarray(points, dtype=np.float64).reshape(-1, 2)
        ids = np.broadcast_to(ids, (len(places),))
        if len(ids) and (ids.min() < 0 or ids.max() >= len(self.sides)):
            raise OptionError(f"patches are numbered 0 to {len(self.sides) - 1}")
        _check_inside(self.sides[ids], places)
        position, by_xi, by_eta = evaluate.evaluate_at(self.patches, ids, places)
        normal = cross(by_xi, by_eta)
        square = (normal**2).sum(axis=1)
        speeds = (by_xi**2).sum(axis=1) * (by_eta**2).sum(axis=1)
        parallel = square <= evaluate.PARALLEL * speeds
        normal /= np.sqrt(np.where(parallel, 1.0, square))[:, None]
        normal[parallel] = evaluate.blended_normals(self.patches, ids[parallel], places[parallel])
        return position, normal

    def weld_normals(self) -> Surface:
        """The same surface with one normal for every vertex of its dense mesh, also on creases."""
        from curvify.shading import weld_normals

        return replaced(self, patches=weld_normals(self.patches))

    def face_count(self, level: int) -> int:
        """Faces of the dense mesh at a level."""
        return predict_faces(self.patches, level)

    def refine(self, level: int = 5, dtype: object = np.float64, **run: Any) -> DenseMesh:
        """The dense mesh of level k as arrays; see ``stream`` for the other options."""
        sink = ArraySink()
        self.stream(sink, level, dtype, **run)
        dense = sink.dense_mesh()
        dense.source_patches, dense.source_parameters = cell_sources(self.patches, level)
        return dense

    def stream(
        self,
        sink: Sink,
        level: int = 5,
        dtype: object = np.float64,
        threads: int | None = None,
        max_faces: int = MAX_FACES,
        progress: Progress | None = None,
        backend: str | Backend = "cpu",
    ) -> DenseLayout:
        """Evaluate the dense mesh of level k into a sink, block by block.

        ``dtype`` float32 or float64 is the type of positions, normals and texture coordinates; ``threads`` (default:
        one per processor) does not change the result; ``progress(done, of)`` is told about samples; ``backend`` is an
        open one, or ``cpu``, ``gpu`` or ``auto``. Raises OptionError for a level below 1, LimitError for more faces
        than ``max_faces``, DeviceError for ``gpu`` where there is none.
        """
        if int(level) != level or level < 1:
            raise OptionError(f"the level must be a whole number from 1 on, not {level!r}")
        faces = self.face_count(int(level))
        if faces > max_faces:
            raise LimitError(
                f"level {level} gives {faces:,} faces, more than the limit of {max_faces:,}; "
                "choose a lower level or raise --max-faces"
            )
        numbering = number_dense_mesh(self.patches, int(level))
        layout = dense_layout(self.patches, numbering, np.dtype(dtype))  # type: ignore[call-overload]
        opened = open_backend(backend, layout.vertex_count) if isinstance(backend, str) else nullcontext(backend)
        with opened as evaluator:
            sink.begin(layout)
            run_jobs(dense_jobs(self.patches, numbering, layout, evaluator), sink, threads, progress)
            sink.end()
        return layout

    def write(
        self,
        path: str | os.PathLike[str],
        level: int = 5,
        dtype: object = np.float32,
        *,
        format: str | None = None,
        ascii: bool = False,
        triangulate: bool = False,
        **run: Any,
    ) -> DenseLayout:
        """Refine straight into a file, which is complete or not there; see ``stream`` for the options in ``run``.

        ``ascii`` is for PLY; ``triangulate`` cuts quads. Raises FormatError where the file cannot be written.
        """
        from curvify.formats.dense import dense_output

        with dense_output(path, format, ascii=ascii, triangulate=triangulate) as sink:
            return self.stream(sink, level, dtype, **run)


def surface(mesh: PolygonMesh, scheme: str = "gregory", **options: Any) -> Surface:
    """The surface of a scheme over a mesh; ``options`` are the scheme's. Raises CurvifyError."""
    module = load_scheme(scheme)
    try:
        chosen = module.Options(**options)
    except TypeError:
        known = ", ".join(sorted(module.Options.__dataclass_fields__))
        wrong = ", ".join(sorted(set(options) - set(module.Options.__dataclass_fields__)))
        raise OptionError(f"the scheme {scheme} has no option {wrong}; it has {known}") from None
    patches = module.prepare(mesh, chosen)
    return Surface(patches, scheme, list(patches.warnings))


def refine(
    mesh: PolygonMesh,
    scheme: str = "gregory",
    level: int = 5,
    dtype: object = np.float64,
    threads: int | None = None,
    max_faces: int = MAX_FACES,
    weld_normals: bool = False,
    backend: str | Backend = "cpu",
    **options: Any,
) -> DenseMesh:
    """Refine a polygon mesh: every edge becomes 2 ``level`` segments.

    ``weld_normals`` gives every vertex one normal, also on creases; ``options`` are the scheme's (see
    ``curvify.schemes``); the others as in ``Surface.stream``. Raises CurvifyError where the mesh or an option cannot
    be used.
    """
    made = surface(mesh, scheme, **options)
    if weld_normals:
        made = made.weld_normals()
    return made.refine(level, dtype, threads=threads, max_faces=max_faces, backend=backend)


def _check_inside(sides: Ints, points: Floats) -> None:
    angle = np.arctan2(points[:, 1], points[:, 0])
    wedge = 2 * np.pi / sides
    off = np.mod(angle, wedge) - wedge / 2
    reach = np.hypot(points[:, 0], points[:, 1]) * np.cos(off)
    outside = np.flatnonzero(~(reach <= 0.5 / np.tan(np.pi / sides) * (1 + 1e-9)))
    if len(outside):
        point, count = points[outside[0]], sides[outside[0]]
        raise OptionError(f"point {point} lies outside the domain of a patch with {count} sides")
