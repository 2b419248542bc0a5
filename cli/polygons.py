"""Commands that write a polygon mesh: where IN comes from, where OUT and a report go, and what they do on the way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from curvify.cli import files
from curvify.cli.console import Console
from curvify.errors import FormatError, MeshError, OptionError
from curvify.formats import write_mesh
from curvify.mesh import PolygonMesh
from curvify.records import record
from curvify.words import listed

#: A changed mesh, and what there is to say about that.
Change = Callable[[PolygonMesh], tuple[PolygonMesh, list[str]]]


@record
class Ends:
    """The files of a command: ``inputs`` by the names that its help has for them, the others as its options."""

    inputs: dict[str, str]
    output: str
    input_format: str | None
    output_format: str | None
    precision: str
    ascii: bool
    no_clobber: bool
    report: str | None = None

    @property
    def names(self) -> list[str]:
        """The inputs in messages."""
        return [files.shown_name(path, "stdin") for path in self.inputs.values()]

    @property
    def target(self) -> str:
        """OUT in messages."""
        return files.shown_name(self.output, "stdout")

    def format_of(self, path: str) -> str | None:
        """The format that was given for one of the inputs; where there are several, suffixes tell theirs."""
        return self.input_format if len(self.inputs) == 1 else files.format_of(path, self.input_format)

    def check(self) -> str:
        """The format of OUT. Raises CurvifyError for what can be seen to fail before any work is done."""
        format = files.check_output(self.output, self.output_format, self.no_clobber)
        files.check_ascii(self.ascii, format)
        if list(self.inputs.values()).count(files.STREAM) > 1:
            raise OptionError(f"{listed(list(self.inputs))} cannot both be standard input")
        for path in self.inputs.values():
            files.check_input(path, self.format_of(path))
        if self.report is not None:
            files.check_report(self.report, {"OUT": self.output, **self.inputs})
        return format

    def losses(self, format: str) -> list[str]:
        """What there is to say of a format that cannot hold what refining needs."""
        if format in files.WHOLE_FORMATS:
            return []
        kept = "" if format in files.POLYGON_FORMATS else "polygons, "
        able = " or ".join(files.WHOLE_FORMATS)
        return [f"{self.target}: {format} keeps no {kept}normals and creases as refining needs them; write {able}"]

    def read(self) -> list[PolygonMesh]:
        """The meshes of the inputs. Raises CurvifyError."""
        return [files.read_input(path, self.format_of(path)) for path in self.inputs.values()]

    def write(self, mesh: PolygonMesh, format: str, like: PolygonMesh) -> None:
        """Write OUT, with numbers of the type that was asked for or that another mesh has. Raises CurvifyError."""
        kind = like.position_dtype if self.precision == "input" else np.dtype(self.precision)
        with files.naming(self.target, FormatError):
            write_mesh(mesh, self.output, format, ascii=self.ascii, dtype=kind)


def change_file(
    change: Change, say: Callable[[str], None], console: Console, ends: Ends
) -> tuple[PolygonMesh, PolygonMesh]:
    """Read IN, change it, ``say`` what was done, write OUT; the mesh before and after. Raises CurvifyError."""
    format = ends.check()
    (mesh,), (name,) = ends.read(), ends.names
    with files.naming(name, MeshError):
        if not mesh.face_count:
            raise MeshError("the mesh has no faces; give a mesh with polygons")
        changed, notes = change(mesh)
    for text in mesh.warnings:
        console.warn(f"{name}: {text}")
    for text in notes:
        say(f"{name}: {text}")
    ends.write(changed, format, mesh)
    return mesh, changed
