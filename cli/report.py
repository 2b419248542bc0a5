"""The report of a run: what was made, how good it is, how long it took; measured while the mesh passes by."""

from __future__ import annotations

import math
import sys
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from curvify.cli.answers import stamped
from curvify.mesh import Floats, Ints
from curvify.polygons import newell_normals
from curvify.quality import edge_angles
from curvify.refinement import Refinable, Surface
from curvify.schemes.base import Patches
from curvify.sinks import DenseLayout, Sink
from curvify.topology import is_closed, signed_volume

if TYPE_CHECKING:
    from curvify.cli.run import Run
    from curvify.mesh import PolygonMesh
    from curvify.simplify import Fitted
    from curvify.simplify.triangles import Triangles

#: Edges at which the angle between the faces is measured.
MOST_EDGES = 20_000


class Recorder:
    """Hands blocks on to a sink and measures them: how far the input's vertices are off, and the volume.

    The volume needs the positions, which are kept (only) where the mesh is closed. Faces that come before the last
    position wait for the end.
    """

    def __init__(self, surface: Refinable) -> None:
        self.coarse = surface
        self.closed = is_closed(surface.topology)
        self.center = surface.positions.mean(axis=0)
        self.deviation = 0.0
        self._missing = 0
        self._waiting: list[tuple[int, Ints]] = []
        self._volumes: dict[int, float] = {}
        self._lock = threading.Lock()

    def into(self, sink: Sink) -> Recorder:
        """Itself, in front of a sink."""
        self.sink, self.anywhere = sink, sink.anywhere
        return self

    def begin(self, layout: DenseLayout) -> None:
        """Take the memory for the positions."""
        self.sink.begin(layout)
        kind = layout.vertex_type["position"].base
        self._expected = self.coarse.positions.astype(kind)
        if self.closed:
            self._missing = layout.wedge_count
            self._positions = np.empty((layout.wedge_count, 3), dtype=kind)

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        """Compare those of the input, keep the positions."""
        self.sink.vertices(start, records)
        positions = records["position"]
        expected = self._expected[start : start + len(records)]
        off = _distance(positions[: len(expected)], expected)
        if self.closed:
            self._positions[start : start + len(records)] = positions
        with self._lock:
            self.deviation = max(self.deviation, off)
            self._missing -= len(records)

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        """Add up the volume under the faces."""
        self.sink.faces(start, wedges, source_faces)
        if not self.closed:
            return
        with self._lock:
            early = self._missing > 0
            if early:
                self._waiting.append((start, wedges))
        if not early:
            self._measure(start, wedges)

    def _measure(self, start: int, wedges: Ints) -> None:
        """Volume between the faces, each a fan about its mean, and the center."""
        points = self._positions[wedges].astype(np.float64) - self.center
        area = np.cross(points, np.roll(points, -1, axis=1)).sum(axis=1)
        volume = float(np.einsum("qi,qi->", points.mean(axis=1), area)) / 6
        with self._lock:
            self._volumes[start] = volume

    def end(self) -> None:
        """Measure the faces that had to wait."""
        self.sink.end()
        for start, wedges in self._waiting:
            self._measure(start, wedges)

    @property
    def rounding(self) -> float:
        """Largest distance that rounding to the output's type moves a vertex of the input."""
        return _distance(self.coarse.positions, self._expected)

    @property
    def volume_ratio(self) -> float | None:
        """Volume of the dense mesh over that of the coarse one; None where that is open or empty."""
        if not self.closed:
            return None
        topology = self.coarse.topology
        area = newell_normals(self.coarse.positions, topology.offsets, topology.vertices)
        coarse = signed_volume(self.coarse.positions, topology.offsets, topology.vertices, area)
        # In the order of the faces, so that threads do not change the last digit.
        return math.fsum(self._volumes[start] for start in sorted(self._volumes)) / coarse if coarse else None


def _distance(a: Floats, b: Floats) -> float:
    """Largest distance between points ``(n,3)``."""
    return float(np.linalg.norm(a.astype(np.float64) - b.astype(np.float64), axis=1).max(initial=0.0))


def refine_report(run: Run, layout: DenseLayout, recorder: Recorder) -> dict[str, Any]:
    """The report of `refine`.

    ``timings`` are seconds. ``g1`` is measured from each face's own derivatives, in degrees; null for a recursive
    scheme. ``vertex_deviation`` is the largest distance between a vertex of the input, rounded to the output's type,
    and the same vertex as written: 0 where the surface interpolates. ``vertex_rounding`` is how far that rounding moved
    a vertex at most. ``gpu`` tells what went there and back and where control vectors were built, null without one.
    ``volume_ratio`` is null for a mesh that is not closed or was trimmed, ``wedges`` after trimming,
    ``bytes`` for an output that is not a file or a pipe.
    """
    request, surface = run.request, run.surface
    about = {
        "input": request.input,
        "output": request.output,
        "scheme": request.scheme,
        "options": run.all_options,
        "level": request.level,
        "backend": run.backend | {"threads": run.threads},
        "counts": {
            "input": surface.counts,
            "output": {
                "vertices": layout.vertex_count if run.trimmed is None else run.trimmed[0],
                "wedges": layout.wedge_count if run.trimmed is None else None,
                "faces": run.faces,
                "bytes": run.bytes,
            },
        },
        "timings": run.seconds,
        "bytes_sent_to_gpu": run.bytes_sent,
        "gpu": run.traffic or None,
        "g1": continuity(surface.patches) if isinstance(surface, Surface) else None,
        "vertex_deviation": _number(recorder.deviation),
        "vertex_rounding": _number(recorder.rounding),
        "volume_ratio": _number(recorder.volume_ratio if run.trimmed is None else None),
        "marks": surface.marks,
        "warnings": run.warnings,
    }
    return stamped("refine", about)


def write_fit_report(
    path: str,
    command: str,
    about: dict[str, Any],
    start: PolygonMesh,
    fitted: Fitted,
    dense: Triangles,
    seconds: dict[str, float],
    warnings: list[str],
) -> None:
    """Measure a mesh before and after its fit and write that down: distances in shares of the diagonal."""
    from curvify.cli.run import timed
    from curvify.simplify.accuracy import accuracy

    with timed(seconds, "measure"):
        found = {"distances": accuracy(fitted.mesh, dense)}
        if fitted.history:
            found["distances_before_fit"] = accuracy(start, dense)
    answer = {
        **about,
        "timings": seconds,
        **{key: {name: vars(part) for name, part in parts.items()} for key, parts in found.items()},
        "fit": {"residuals": fitted.history, "max_error": fitted.largest} if fitted.history else None,
        "warnings": warnings,
    }
    write_report(path, stamped(command, answer))


def continuity(patches: Patches) -> dict[str, Any]:
    """Angles in degrees between the faces on either side of edges that should be smooth."""
    measured = edge_angles(patches, most=MOST_EDGES)
    angles = measured.angles[measured.smooth]
    return {
        "max_degrees": _number(angles.max()) if angles.size else None,
        "mean_degrees": _number(angles.mean()) if angles.size else None,
        "edges_measured": len(measured.edges),
        "edges_smooth": int(measured.smooth.sum()),
    }


def _number(value: float | None) -> float | None:
    """A number that JSON can hold."""
    return float(value) if value is not None and np.isfinite(value) else None


def write_report(path: str, report: dict[str, Any]) -> None:
    """Write a report to a file, completely or not at all, or to standard output for ``-``."""
    import json

    text = json.dumps(report, indent=2, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
        return
    from curvify.formats import atomic_file

    with atomic_file(path) as out:
        out.write(text.encode())
