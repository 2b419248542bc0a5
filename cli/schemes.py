"""`curvify schemes`: what surfaces there are."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    ("What is there to choose from?", "curvify schemes"),
    ("The same for a program", "curvify schemes --json"),
)


@click.command(name="schemes", cls=Command, examples=EXAMPLES, short_help=COMMANDS["schemes"])
@options.option("Output", "--json", "as_json", is_flag=True, help="Print JSON.")
def command(as_json: bool) -> None:
    """List the surface schemes and their options.

    For each scheme: the faces it takes, what of the mesh it keeps, how smoothly the surface continues across their
    edges, the normals it offers, its options with their defaults, and the paper that it comes from. What they measure
    side by side is in docs/choosing-a-scheme.md.
    """
    schemes = [describe(name) for name in scheme_names()]
    if as_json:
        import json

        click.echo(json.dumps(schemes, indent=2))
    else:
        click.echo("\n\n".join(as_text(scheme) for scheme in schemes))


def scheme_names() -> tuple[str, ...]:
    """All schemes, the default first."""
    from curvify.schemes import NAMES

    return NAMES


def describe(name: str) -> dict[str, Any]:
    """What a scheme's module says about it."""
    from dataclasses import fields

    from curvify.options import MeshOptions
    from curvify.schemes import load_scheme

    module = load_scheme(name)
    shared = {field.name: field.default for field in fields(MeshOptions)}
    own = {field.name: field.default for field in fields(module.Options) if field.name not in shared}
    return {
        "name": module.name,
        "summary": module.summary,
        "faces": module.faces,
        "keeps": module.keeps,
        "continuity": module.continuity,
        "normals": list(module.normals),
        "options": {**own, **{name: value for name, value in shared.items() if value is not None}},
        "source": module.source,
    }


def as_text(scheme: dict[str, Any]) -> str:
    """A few lines about a scheme."""
    choices = [f"--{name.replace('_', '-')} {value}" for name, value in scheme["options"].items()]
    rows = [
        ("faces", scheme["faces"]),
        ("keeps", scheme["keeps"]),
        ("continuity", scheme["continuity"]),
        ("normals", ", ".join(scheme["normals"])),
        ("options", ("\n" + " " * 14).join(choices)),
        ("source", scheme["source"]),
    ]
    return "\n".join([f"{scheme['name']}: {scheme['summary']}", *(f"  {name:<12}{text}" for name, text in rows)])
