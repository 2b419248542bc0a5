"""Which files a batch works on, and where each of them goes."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from curvify.cli.batch_job import Job
from curvify.errors import OptionError
from curvify.formats import READ_FORMATS, WRITE_FORMATS
from curvify.formats.files import remove_leftovers

#: Folder of the stamps in the output folder.
STAMPS = ".curvify"


def plan(
    patterns: Iterable[str], folder: str, suffix: str, skip_existing: bool, options: dict[str, Any]
) -> tuple[list[Job], list[str]]:
    """The jobs of a batch in the order of their names, and files that no format fits.

    A file keeps its place below the fixed part of its pattern: ``a/b/c.obj`` of ``a/**/*.obj`` goes to ``b/c.ply`` in
    the folder. Raises OptionError for patterns that fit nothing and for two files that would go to one place.
    """
    suffix = suffix if suffix.startswith(".") else f".{suffix}"
    if suffix[1:].lower() not in WRITE_FORMATS:
        raise OptionError(f"--suffix {suffix}: that is no format to write; choose from {', '.join(WRITE_FORMATS)}")
    if Path(folder).exists() and not Path(folder).is_dir():
        raise OptionError(f"--output-dir {folder}: that is a file; give a folder, which is made where there is none")
    found, unknown = find_inputs(patterns, folder)
    jobs: dict[str, Job] = {}
    inputs = {os.path.realpath(path) for path in found}
    for path, base in sorted(found.items()):
        inner = Path(os.path.relpath(path, base)).with_suffix(suffix)
        output = str(Path(folder) / inner)
        if output in jobs:
            raise OptionError(f"{jobs[output].name} and {path} would both go to {output}; batch them apart")
        if os.path.realpath(output) in inputs:
            raise OptionError(f"{output}: the output would replace an input; choose another --output-dir")
        stamp = str(Path(folder) / STAMPS / f"{inner}.json")
        jobs[output] = Job(path, {**options, "input": path, "output": output}, stamp, skip_existing)
    return list(jobs.values()), unknown


def find_inputs(patterns: Iterable[str], folder: str) -> tuple[dict[str, str], list[str]]:
    """Files that patterns fit, each with the folder that its place is told from, and those of unknown formats.

    What lies in the output folder is no input of a pattern.
    """
    found: dict[str, str] = {}
    unknown: list[str] = []
    own = os.path.realpath(folder) + os.sep
    plain = [pattern for pattern in patterns if not glob.has_magic(pattern)]
    if plain:
        base = os.path.commonpath([Path(path).absolute().parent for path in plain])
        found.update((path, base) for path in plain)
    for path in filter(os.path.isdir, plain):
        raise OptionError(f"{path} is a folder; give a pattern in quotes, such as '{path.rstrip(os.sep)}/**/*.obj'")
    for pattern in (pattern for pattern in patterns if glob.has_magic(pattern)):
        fitting = [path for path in glob.glob(pattern, recursive=True) if Path(path).is_file()]  # noqa: PTH207
        paths = [path for path in fitting if not os.path.realpath(path).startswith(own)]
        if not paths:
            where = f", except in {folder}, where the output goes" if fitting else ""
            raise OptionError(f"no file fits '{pattern}'{where}")
        for path in paths:
            if Path(path).suffix.lower().removeprefix(".") in READ_FORMATS:
                found.setdefault(path, fixed_part(pattern))
            else:
                unknown.append(path)
    if not found:
        raise OptionError(f"no file has a format that can be read, one of {', '.join(READ_FORMATS)}")
    return found, sorted(unknown)


def fixed_part(pattern: str) -> str:
    """The folders of a pattern before the first one that can vary."""
    fixed = []
    for part in Path(pattern).parent.parts:
        if glob.has_magic(part):
            break
        fixed.append(part)
    return str(Path(*fixed)) if fixed else "."


def clean_up(jobs: Iterable[Job]) -> int:
    """Remove what killed workers have left where the jobs write; how many files."""
    folders = {Path(path).parent for job in jobs for path in (job.output, job.stamp)}
    return sum(remove_leftovers(folder) for folder in folders if folder.is_dir())
