"""Trimming on the way into OUT: the dense mesh is collected, cut along the image, and written as polygons."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, BinaryIO

from curvify.cli import files
from curvify.errors import MeshError, OptionError
from curvify.formats import write_mesh
from curvify.refinement import Surface
from curvify.sinks import ArraySink, Sink

if TYPE_CHECKING:
    from curvify.cli.run import Request, Run
    from curvify.mask import Mask


def check_trim(request: Request) -> None:
    """Raise OptionError for options of trimming without an image, and for schemes that do not make quads."""
    if request.trim is None:
        for name, value in (
            ("--trim-map", request.trim_map),
            ("--trim-mode", request.trim_mode),
            ("--trim-invert", request.trim_invert),
        ):
            if value:
                raise OptionError(f"{name} says how to trim by an image; give one with --trim FILE")
    elif request.scheme not in ("gregory", "blend"):
        raise OptionError(f"--trim needs a surface of quads: --scheme gregory or blend, not {request.scheme}")


def load_mask(request: Request) -> Mask | None:
    """The image of --trim. Raises FormatError."""
    if request.trim is None:
        return None
    from curvify.mask import read_mask

    mask = read_mask(request.trim)
    return mask.inverted() if request.trim_invert else mask


@contextmanager
def trimmed_output(run: Run, mask: Mask, stdout: BinaryIO) -> Iterator[Sink]:
    """A sink that trims the mesh and writes it when it is complete. Raises CurvifyError."""
    from curvify.trim import trim
    from curvify.trimmed import fan_triangles

    request = run.request
    assert isinstance(run.surface, Surface)  # check_trim has seen to it
    collected = ArraySink()
    yield collected
    with files.naming(request.source, MeshError):
        mesh = trim(
            run.surface.patches,
            collected.dense_mesh(),
            request.level,
            mask,
            request.trim_map or "face",
            request.trim_mode or "clip",
        )
    if run.triangulate:
        mesh = fan_triangles(mesh)
    run.trimmed = mesh.vertex_count, mesh.face_count
    write_mesh(mesh, request.output, run.format, ascii=request.ascii, dtype=run.dtype.type, stdout=stdout)
