"""Mesh, scheme, level and backend to a dense mesh: in arrays, or block by block into a file.

The dense mesh is cut into jobs of fixed size, each of which knows where its blocks go (``jobs``, ``weld``). Threads
take jobs in order; a sink that can write anywhere takes blocks as they come, the others in order.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from curvify import evaluate
from curvify.backends import Backend, open_backend
from curvify.errors import LimitError, OptionError
from curvify.jobs import dense_jobs, dense_layout
from curvify.mesh import DenseMesh, Floats, Ints, PolygonMesh
from curvify.records import field, record, replaced
from curvify.schemes import load_scheme
from curvify.schemes.base import Patches
from curvify.sinks import ArraySink, DenseLayout, Sink
from curvify.threads import Job, Progress, run_jobs
from curvify.topology import Topology
from curvify.weld import cell_sources, number_dense_mesh, predict_faces

if TYPE_CHECKING:
    from curvify.mask import Mask
    from curvify.prepare import Coarse

#: Faces that a dense mesh may have unless the caller allows more.
MAX_FACES = 50_000_000

#: The jobs of a dense mesh for a backend, in order, each with its number of samples.
JobsFor = Callable[[Backend], list[tuple[int, Job]]]


class Refinable(ABC):
    """What a scheme makes of a polygon mesh: it can be refined into arrays, a sink or a file.

    ``positions (V,3)`` of the input's vertices, ``topology``, ``counts`` and the number of ``marks`` by source and kind
    tell of the mesh, ``cell_size`` of the dense faces' corners.
    """

    warnings: list[str]

    @property
    @abstractmethod
    def positions(self) -> Floats: ...

    @property
    @abstractmethod
    def topology(self) -> Topology: ...

    @property
    @abstractmethod
    def counts(self) -> dict[str, int]: ...

    @property
    @abstractmethod
    def marks(self) -> dict[str, dict[str, int]]: ...

    @property
    @abstractmethod
    def cell_size(self) -> int: ...

    @abstractmethod
    def face_count(self, level: int, enough: int | None = None) -> int:
        """Faces of the dense mesh at a level; some number above ``enough`` if there are more than that."""

    @abstractmethod
    def amount(self, level: int) -> str:
        """The level in words."""

    @abstractmethod
    def _work(self, level: int, dtype: np.dtype[Any]) -> tuple[DenseLayout, JobsFor]:
        """Layout of the dense mesh, and its jobs for a backend."""

    def open_backend(self, name: str, samples: int) -> AbstractContextManager[Backend]:
        """The backend of a name that can evaluate this, for about so many samples; see ``backends``."""
        return open_backend(name, samples)

    def weld_normals(self) -> Refinable:
        """The same with one normal for every vertex of the dense mesh, also on creases.

        Raises OptionError for a scheme whose normals shape its next pass.
        """
        raise OptionError("--weld-normals is for schemes that make a surface; overveld needs its normals")

    def layout(self, level: int, dtype: np.dtype[Any]) -> DenseLayout:
        """The shape of the dense mesh."""
        return self._work(level, dtype)[0]

    def refine(self, level: int = 5, dtype: object = np.float64, **run: Any) -> DenseMesh:
        """The dense mesh of level k as arrays; see ``stream`` for the other options."""
        sink = ArraySink()
        self.stream(sink, level, dtype, **run)
        return sink.dense_mesh()

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
        faces = self.face_count(int(level), max_faces)
        if faces > max_faces:
            raise LimitError(
                f"{self.amount(int(level))} gives {faces:,} faces, more than the limit of {max_faces:,}; "
                "choose less or raise --max-faces"
            )
        layout, jobs_for = self._work(int(level), np.dtype(dtype))  # type: ignore[call-overload]
        opened = self.open_backend(backend, layout.vertex_count) if isinstance(backend, str) else nullcontext(backend)
        with opened as evaluator:
            jobs = jobs_for(evaluator)
            sink.begin(layout)
            run_jobs(jobs, sink, threads, progress)
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


@record
class Surface(Refinable):
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
        return evaluate.surface_at(self.patches, ids, places)

    def weld_normals(self) -> Surface:
        """The same surface with one normal for every vertex of its dense mesh, also on creases."""
        from curvify.shading import weld_normals

        return replaced(self, patches=weld_normals(self.patches))

    @property
    def positions(self) -> Floats:
        """Positions ``(V,3)`` of the input's vertices."""
        return self.patches.positions

    @property
    def topology(self) -> Topology:
        """Topology of the patches."""
        return self.patches.topology

    @property
    def counts(self) -> dict[str, int]:
        """Counts for the report."""
        return self.patches.counts

    @property
    def marks(self) -> dict[str, dict[str, int]]:
        """Number of marks by source and kind."""
        return self.patches.marks

    @property
    def cell_size(self) -> int:
        """Corners of the dense mesh's faces."""
        return int(self.patches.sampling(self.patches.classes[0].sides, 1).cells.shape[1])

    def amount(self, level: int) -> str:
        """The level in words."""
        return f"level {level}"

    def face_count(self, level: int, enough: int | None = None) -> int:
        """Faces of the dense mesh at a level."""
        return predict_faces(self.patches, level)

    def refine(self, level: int = 5, dtype: object = np.float64, **run: Any) -> DenseMesh:
        """The dense mesh of level k as arrays, its faces with their places on the patches; see ``stream``."""
        dense = super().refine(level, dtype, **run)
        dense.source_patches, dense.source_parameters = cell_sources(self.patches, level)
        return dense

    def trim(
        self,
        mask: Mask,
        level: int = 5,
        dtype: object = np.float64,
        *,
        mapping: str = "face",
        mode: str = "clip",
        **run: Any,
    ) -> PolygonMesh:
        """What an image keeps of the dense mesh of level k: polygons with normals at their corners; see ``trim.trim``.

        ``run`` as in ``stream``; the limit of faces holds for the whole mesh. Raises CurvifyError.
        """
        from curvify.trim import trim

        return trim(self.patches, self.refine(level, dtype, **run), int(level), mask, mapping, mode)

    def _work(self, level: int, dtype: np.dtype[Any]) -> tuple[DenseLayout, JobsFor]:
        """Layout of the dense mesh, and its jobs for a backend."""
        numbering = number_dense_mesh(self.patches, level)
        layout = dense_layout(self.patches, numbering, dtype)
        return layout, partial(dense_jobs, self.patches, numbering, layout)


def surface(mesh: PolygonMesh | Coarse, scheme: str = "gregory", **options: Any) -> Surface:
    """The surface of a scheme over a mesh; ``options`` are the scheme's.

    Raises OptionError for a recursive scheme, which has no surface, other CurvifyErrors as ``refinable``.
    """
    made = refinable(mesh, scheme, **options)
    if not isinstance(made, Surface):
        raise OptionError(f"the scheme {scheme} makes meshes, not a surface; use curvify.refine")
    return made


def refinable(mesh: PolygonMesh | Coarse, scheme: str = "gregory", **options: Any) -> Refinable:
    """What a scheme makes of a mesh, prepared or not; ``options`` are the scheme's, and were those of the preparation.

    Raises CurvifyError.
    """
    module = load_scheme(scheme)
    try:
        chosen = module.Options(**options)
    except TypeError:
        known = ", ".join(sorted(module.Options.__dataclass_fields__))
        wrong = ", ".join(sorted(set(options) - set(module.Options.__dataclass_fields__)))
        raise OptionError(f"the scheme {scheme} has no option {wrong}; it has {known}") from None
    made = module.prepare(mesh, chosen)
    if isinstance(made, Patches):
        return Surface(made, scheme, list(made.warnings))
    from curvify.subdivision import Subdivision

    return Subdivision(made, scheme)


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
    made = refinable(mesh, scheme, **options)
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
