"""`curvify backends`: what can evaluate surfaces here."""

from __future__ import annotations

from typing import Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command

EXAMPLES = (
    ("Is there a GPU, and would it be used?", "curvify backends"),
    ("The same for a program", "curvify backends --json"),
    ("The second of several devices (EGL)", "CURVIFY_GL=egl:1 curvify backends"),
)


@click.command(name="backends", cls=Command, examples=EXAMPLES, short_help=COMMANDS["backends"])
@options.option("Output", "--json", "as_json", is_flag=True, help="Print JSON.")
def command(as_json: bool) -> None:
    """List what can evaluate surfaces: the processor, and the GPU that was found.

    'refine --backend auto' takes the GPU when the work is large, unless it is only software that acts as one; that
    must be asked for with '--backend gpu'. The environment variable CURVIFY_GL chooses how OpenGL is opened: egl,
    egl:NUMBER for one of several devices, default for the platform's own way, none to do without.
    """
    found = describe()
    if as_json:
        import json

        click.echo(json.dumps(found, indent=2))
    else:
        click.echo(as_text(found))


def describe() -> dict[str, Any]:
    """Facts about all backends; ``auto`` is the one that large work would get."""
    from curvify.errors import DeviceError
    from curvify.gpu.device import open_device
    from curvify.threads import processors

    try:
        with open_device() as device:
            gpu = {"available": True} | device.facts()
    except DeviceError as error:
        gpu = {"available": False, "reason": str(error)}
    auto = "gpu" if gpu["available"] and gpu["hardware"] else "cpu"
    return {"auto": auto, "cpu": {"processors": processors()}, "gpu": gpu}


def as_text(found: dict[str, Any]) -> str:
    """A few lines about each."""
    from curvify.backends import LARGE
    from curvify.words import count_of

    gpu = found["gpu"]
    lines = [f"cpu: {count_of(found['cpu']['processors'], 'processor')}, double precision"]
    if not gpu["available"]:
        return "\n".join([*lines, f"gpu: none: {gpu['reason']}", "auto: cpu"])
    lines.append(f"gpu: {gpu['renderer']}, {'hardware' if gpu['hardware'] else 'software'}, single precision")
    rows = [
        ("vendor", gpu["vendor"]),
        ("version", f"OpenGL {gpu['version']}"),
        ("opened by", gpu["opened_by"]),
        ("programs", "compute shaders" if gpu["compute"] else "transform feedback"),
        *((name.removeprefix("GL_").lower(), _shown(limit)) for name, limit in gpu["limits"].items()),
    ]
    lines += [f"  {name:<38}{text}" for name, text in rows]
    from_ = f" from about {LARGE:,} samples on, cpu below" if found["auto"] == "gpu" else ""
    return "\n".join([*lines, f"auto: {found['auto']}{from_}"])


def _shown(limit: int | tuple[int, ...]) -> str:
    return " x ".join(f"{part:,}" for part in (limit if isinstance(limit, tuple) else (limit,)))
