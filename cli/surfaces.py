"""Commands that make refine's surface on the way to something else: its options, and the surface they ask for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click

from curvify.cli.group import Option
from curvify.records import record

if TYPE_CHECKING:
    from curvify.mesh import PolygonMesh
    from curvify.options import MeshOptions
    from curvify.prepare import Coarse
    from curvify.refinement import Surface


def refine_parameters(leave_out: Iterable[str] = (), headings: Iterable[str] | None = None) -> list[Option]:
    """Options of `refine`, those of some ``headings`` or all, without those named in ``leave_out``.

    They are read from the command itself, so that an option that refine gains is one of every such command.
    """
    from curvify.cli.refine import command

    options = [parameter for parameter in command.params if isinstance(parameter, Option)]
    names = set(leave_out)
    return [o for o in options if o.name not in names and (headings is None or o.heading in set(headings))]


def with_refine_options(
    leave_out: Iterable[str] = (), headings: Iterable[str] | None = None
) -> Callable[[click.Command], click.Command]:
    """Give a command options of `refine`, after its own."""

    def decorate(command: click.Command) -> click.Command:
        own = {parameter.name for parameter in command.params}
        command.params += [o for o in refine_parameters(leave_out, headings) if o.name not in own]
        return command

    return decorate


def refine_values(input: str, output: str, given: dict[str, Any]) -> dict[str, Any]:
    """What `refine` would be called with: ``given`` where that has a value for an option, its default elsewhere."""
    from curvify.cli.refine import command

    values = command.make_context("refine", ["IN", "OUT"]).params
    known = {name: value for name, value in given.items() if name in values}
    return {**values, **known, "input": input, "output": output}


@record
class Asked:
    """The surface that options of refine ask for: the ``scheme``, its ``options``, the ``level`` and ``max_faces``."""

    scheme: str
    options: dict[str, Any]
    level: int
    max_faces: int

    def mesh_options(self) -> MeshOptions:
        """What is done with the mesh before the surface is made. Raises OptionError for what does not fit."""
        from curvify.cli.run import scheme_options

        options: MeshOptions = scheme_options(self.scheme, self.options)
        return options

    def surface(self, mesh: PolygonMesh | Coarse) -> Surface:
        """The surface over a mesh, prepared with ``mesh_options`` or not. Raises CurvifyError."""
        from curvify.refinement import surface

        return surface(mesh, self.scheme, **self.options)


def asked_for(given: dict[str, Any]) -> Asked:
    """What the options of refine among ``given`` ask for. Raises FormatError for marks that cannot be read,
    OptionError for what does not fit.
    """
    from curvify.cli.run import Request, read_marks

    request = Request(**refine_values("-", "-", given))
    marks = None if request.marks is None else read_marks(request.marks)
    asked = Asked(request.scheme, {**request.scheme_options, "marks": marks}, request.level, request.max_faces)
    asked.mesh_options()
    return asked
