"""What commands tell as JSON."""

from __future__ import annotations

from typing import Any

import click

from curvify import __version__

#: Version of what is told as JSON.
SCHEMA = 1


def stamped(command: str, answer: dict[str, Any]) -> dict[str, Any]:
    """What a command tells as JSON, with what made it and a version of its form."""
    return {"schema": SCHEMA, "curvify": __version__, "command": command, **answer}


def print_json(command: str, answer: dict[str, Any]) -> None:
    """Print what a command found as JSON."""
    import json

    click.echo(json.dumps(stamped(command, answer), indent=2))
