"""Commands that read a polygon mesh, change it and write a polygon mesh."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.cli import files
from curvify.cli.console import Console
from curvify.errors import FormatError, MeshError
from curvify.formats import write_mesh
from curvify.mesh import PolygonMesh

#: A changed mesh, and what there is to say about that.
Change = Callable[[PolygonMesh], tuple[PolygonMesh, list[str]]]


def change_file(
    change: Change,
    say: Callable[[str], None],
    console: Console,
    input: str,
    output: str,
    input_format: str | None,
    output_format: str | None,
    precision: str,
    ascii: bool,
    no_clobber: bool,
) -> tuple[PolygonMesh, PolygonMesh]:
    """Read IN, change it, ``say`` what was done, write OUT; the mesh before and after. Raises CurvifyError."""
    format = files.check_output(output, output_format, no_clobber)
    files.check_ascii(ascii, format)
    mesh, name = files.open_input(input, input_format)
    with files.naming(name, MeshError):
        if not mesh.face_count:
            raise MeshError("the mesh has no faces; give a mesh with polygons")
        changed, notes = change(mesh)
    for text in mesh.warnings:
        console.warn(f"{name}: {text}")
    for text in notes:
        say(f"{name}: {text}")
    kind = mesh.position_dtype if precision == "input" else np.dtype(precision)
    with files.naming(files.shown_name(output, "stdout"), FormatError):
        write_mesh(changed, output, format, ascii=ascii, dtype=kind)
    return mesh, changed
