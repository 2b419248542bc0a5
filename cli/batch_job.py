"""One file of a batch: what it is made from, whether that is done already, and doing it.

A stamp beside the output remembers what the output was made from: the hash of all that its bytes depend on, and the
hash of the output itself. A job is done already where both still hold, so a killed run, an edited input, another
option, another version or an output that someone changed all make it run again.
"""

from __future__ import annotations

import json
import time
from hashlib import blake2b
from pathlib import Path
from typing import Any

from curvify import __version__
from curvify.cli.main import text_of
from curvify.cli.surfaces import refine_parameters
from curvify.formats.files import atomic_file
from curvify.formats.references import referenced_files
from curvify.records import record, replaced

#: Options that change how a file is made but not one byte of it.
WITHOUT_EFFECT = ("input", "output", "threads", "max_faces", "quiet", "verbose", "dry_run", "no_clobber", "report")
DONE, SKIPPED, FAILED, NOT_RUN = "done", "skipped", "failed", "not run"


@record
class Job:
    """A file to refine: ``values`` are the arguments of refine, ``stamp`` the path of the output's stamp."""

    name: str
    values: dict[str, Any]
    stamp: str
    skip_existing: bool

    @property
    def output(self) -> str:
        """Where the dense mesh goes."""
        return str(self.values["output"])

    def absolute(self) -> Job:
        """The same job for a process in another folder."""
        files = {name: str(Path(path).resolve()) for name, path in named_files(self.values).items()}
        ends = {name: str(Path(self.values[name]).resolve()) for name in ("input", "output")}
        return replaced(self, values={**self.values, **files, **ends}, stamp=str(Path(self.stamp).resolve()))


@record
class Outcome:
    """What became of a job. ``faces`` and ``bytes`` are of the output; ``seconds`` those of the whole job."""

    status: str
    seconds: float = 0.0
    faces: int | None = None
    bytes: int | None = None
    warnings: tuple[str, ...] = ()
    error: str = ""


def do(job: Job) -> Outcome:
    """Do a job; whatever goes wrong is told in the outcome."""
    start = time.perf_counter()
    try:
        outcome = _do(job)
    except Exception as error:
        outcome = Outcome(FAILED, error=" ".join(text_of(error)[0].split()))
    return replaced(outcome, seconds=time.perf_counter() - start)


def _do(job: Job) -> Outcome:
    from curvify.cli.refine import command

    key = job_key(job)
    if job.skip_existing and is_done(job, key):
        return Outcome(SKIPPED)
    assert command.callback is not None
    Path(job.output).parent.mkdir(parents=True, exist_ok=True)
    run = command.callback(**job.values)
    write_stamp(job, key)
    return Outcome(DONE, faces=run.faces, bytes=run.bytes, warnings=tuple(run.warnings))


def job_key(job: Job) -> str:
    """Hash of all that the bytes of the output depend on: the input and what it refers to, options, version."""
    options = {name: value for name, value in sorted(job.values.items()) if name not in WITHOUT_EFFECT}
    form = Path(job.output).suffix.lower()
    told = json.dumps([__version__, form, options], sort_keys=True, default=str)
    hasher = blake2b(told.encode(), digest_size=20)
    source = str(job.values["input"])
    for path in (source, *referenced_files(source), *named_files(job.values).values()):
        hasher.update(file_hash(path).encode())
    return hasher.hexdigest()


def named_files(values: dict[str, Any]) -> dict[str, str]:
    """Files that options name, by option: they are read too."""
    names = [str(option.name) for option in refine_parameters(WITHOUT_EFFECT) if option.metavar == "FILE"]
    return {name: str(values[name]) for name in names if values.get(name)}


def file_hash(path: str) -> str:
    """Hash of a file's content; of nothing where there is no such file, which the job itself will tell."""
    hasher = blake2b(digest_size=20)
    try:
        with Path(path).open("rb") as file:
            while block := file.read(1 << 20):
                hasher.update(block)
    except OSError:
        return "none"
    return hasher.hexdigest()


def is_done(job: Job, key: str) -> bool:
    """Whether the output is there, as made from the same."""
    try:
        stamp = json.loads(Path(job.stamp).read_text(encoding="utf-8"))
        return bool(stamp["key"] == key and stamp["output"] == file_hash(job.output) != "none")
    except (OSError, ValueError, KeyError, TypeError):
        return False


def write_stamp(job: Job, key: str) -> None:
    """Remember what the output was made from. The output is in place by now: a stamp is never early."""
    stamp = {"schema": 1, "curvify": __version__, "input": job.name, "key": key, "output": file_hash(job.output)}
    Path(job.stamp).parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(job.stamp) as out:
        out.write((json.dumps(stamp, indent=2) + "\n").encode())
