"""What `render`, `view` and heat maps share: options of the look, meshes read, values of their vertices, files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.options import option
from curvify.cli.parameters import FILE, POSITIVE, Limits
from curvify.records import record

if TYPE_CHECKING:
    from curvify.cli.console import Console
    from curvify.gpu.scene import Layer, Settings
    from curvify.mesh import Floats, PolygonMesh

PICTURE, LOOK = "Picture", "Look"
#: Part of the curvatures at each end that the colors do not tell apart: a few vertices have extreme ones.
EXTREME = 0.01


def _some_meshes(context: click.Context, _: click.Parameter, inputs: tuple[str, ...]) -> tuple[str, ...]:
    """The INs; without any, the one name that was given is OUT's."""
    if not inputs and not context.resilient_parsing:
        raise click.UsageError("two names are needed at least: a mesh, and the file to make", context)
    return inputs


in_and_out = options.with_options(
    click.argument("inputs", metavar="IN...", nargs=-1, callback=_some_meshes, type=FILE),
    click.argument("output", metavar="OUT", type=FILE),
)

style = option(
    LOOK,
    "--style",
    type=click.Choice(["shaded", "zebra", "normals"]),
    default="shaded",
    show_default=True,
    help="Light and shade; the reflection of a striped room, which breaks where the surface has a kink; normals "
    "as colors.",
)
shading = option(
    LOOK,
    "--shading",
    type=click.Choice(["auto", "flat", "smooth"]),
    default="auto",
    show_default=True,
    help="Normals to shade with: the file's, or where it has none flat for coarse meshes and smooth for fine ones "
    "(auto); each face's own (flat); averages at the vertices (smooth).",
)
values = option(
    LOOK,
    "--values",
    type=click.Choice(["x", "y", "z", "bend", "curvature"]),
    help="Colors for values of the vertices, with a scale: a coordinate; the largest angle between the faces there, in "
    "degrees; the mean curvature.",
)
limits = option(
    LOOK,
    "--limits",
    type=Limits(),
    metavar="LOW,HIGH",
    help="Values of the first and the last color.  [default: those of the meshes; of curvatures, all but 1 % at each "
    "end]",
)
wire = option(LOOK, "--wire", is_flag=True, help="Draw the edges of the polygons.")
control = option(LOOK, "--control", metavar="FILE", help="Draw the edges and vertices of this mesh over each IN.")
stripes = option(
    LOOK,
    "--stripes",
    type=POSITIVE,
    default=10,
    show_default=True,
    metavar="N",
    help="Dark bands of a zebra's room, from floor to ceiling.",
)
color = option(
    LOOK,
    "--color",
    default="#99b3d1",
    show_default=True,
    metavar="COLOR",
    help="Color of a shaded surface: a name that HTML knows, or #rrggbb.",
)
view = option(
    PICTURE,
    "--view",
    default="oblique",
    show_default=True,
    metavar="VIEW",
    help="oblique, front, right, back, left, top, bottom, isometric, or AZIMUTH,ELEVATION in degrees.",
)
up = option(
    PICTURE,
    "--up",
    type=click.Choice(["z", "y"]),
    default="z",
    show_default=True,
    help="The axis that points up; the front is then seen from -y or +z.",
)


@record
class Subjects:
    """The meshes to show and the options of their look, as they were given."""

    inputs: tuple[str, ...]
    control: str | None
    input_format: str | None
    style: str
    shading: str
    values: str | None
    limits: tuple[float, float] | None
    wire: bool

    @classmethod
    def taken_from(cls, given: dict[str, Any]) -> Subjects:
        """Those among all options ``given``, which they are taken out of."""
        return cls(**{name: given.pop(name) for name in cls.__annotations__})

    @property
    def names(self) -> list[str]:
        """All files to read."""
        return [*self.inputs, *([] if self.control is None else [self.control])]

    def check(self) -> None:
        """Raise CurvifyError for names that cannot be read and options that do not go together."""
        from curvify.cli import files
        from curvify.errors import OptionError

        if self.names.count(files.STREAM) > 1:
            raise OptionError("standard input can be read only once")
        for name in self.names:
            if name != files.STREAM:
                files.check_input(name, files.format_of(name, self.input_format))
        if self.values is None and self.limits is not None:
            raise OptionError("--limits are those of --values; say which values")
        if self.values is not None and self.style != "shaded":
            raise OptionError(f"--values and --style {self.style} both color the surface; leave out one of them")

    def layers(self, settings: Settings, console: Console) -> tuple[list[Layer], Layer | None, Settings]:
        """A layer for each IN, one of the control mesh to draw over them, and the settings with a scale for all values.

        A file that is named twice is read once. Raises CurvifyError.
        """
        from curvify.gpu.scene import Layer, Stroke

        meshes = {name: read(name, self.input_format, console) for name in dict.fromkeys(self.names)}
        shown = {name: vertex_values(meshes[name], self.values) for name in dict.fromkeys(self.inputs)}
        style = self.style if self.values is None else "values"
        line = Stroke() if self.wire else None
        layers = [Layer(meshes[name], style, self.shading, wire=line, values=shown[name]) for name in self.inputs]
        over = None if self.control is None else control_layer(meshes[self.control])
        return layers, over, with_scale(settings, list(shown.values()), self.values, self.limits)


def check_output(output: str, suffix: str, rule: str, no_clobber: bool) -> None:
    """Raise CurvifyError for an OUT that cannot be written, so far as its name tells; it must have a suffix."""
    from curvify.cli import files

    files.check_suffix(output, suffix, rule)
    files.check_target(output, no_clobber)


def short_name(name: str) -> str:
    """What a file is called where it is shown."""
    from pathlib import Path

    from curvify.cli import files

    return files.shown_name(Path(name).name, "stdin")


def read(name: str, format: str | None, console: Console) -> PolygonMesh:
    """A mesh with faces; what its file warns of is told."""
    from curvify.cli import files
    from curvify.errors import MeshError

    mesh, shown = files.open_input(name, files.format_of(name, format))
    if not mesh.face_count:
        raise MeshError(f"{shown}: the mesh has no faces; there is nothing to show")
    for text in mesh.warnings:
        console.warn(f"{shown}: {text}")
    return mesh


def vertex_values(mesh: PolygonMesh, kind: str | None) -> Floats | None:
    """Values of a kind ``(V,)``; of curvatures, those of the normals that a smooth picture is shaded with."""
    if kind is None:
        return None
    from curvify.gpu.shading import shading_normals
    from curvify.vertex_values import vertex_values

    return vertex_values(mesh, kind, shading_normals(mesh, "smooth" if mesh.corner_normals is None else "auto"))


def with_scale(
    settings: Settings, values: Sequence[Floats | None], kind: str | None, limits: tuple[float, float] | None
) -> Settings:
    """The settings with a scale for values of a kind, if there are any. Raises OptionError."""
    if kind is None:
        return settings
    from dataclasses import replace

    from curvify.gpu.scale import Scale, scale_of
    from curvify.vertex_values import KINDS

    if limits is not None:
        return replace(settings, scale=Scale(*limits, KINDS[kind]))
    given = [part for part in values if part is not None]
    return replace(settings, scale=scale_of(given, KINDS[kind], EXTREME if kind == "curvature" else 0.0))


def control_layer(mesh: PolygonMesh) -> Layer:
    """Edges and vertices of a control mesh; where it lies behind itself they show faintly."""
    from curvify.gpu.scene import Layer, Stroke

    ink = (0.72, 0.17, 0.10)
    return Layer(mesh, "hidden", wire=Stroke(ink, 1.8, hidden=0.18), dots=Stroke(ink, 6.0, hidden=0.0))
