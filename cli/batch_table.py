"""What became of the files of a batch: the table, the summary, the report."""

from __future__ import annotations

from typing import Any

from curvify.cli.answers import stamped
from curvify.cli.batch_job import DONE, FAILED, NOT_RUN, SKIPPED, Job, Outcome
from curvify.cli.console import size
from curvify.cli.report import write_report

HEADINGS = ("file", "", "faces", "size", "seconds", "")


def as_table(jobs: list[Job], made: list[Outcome]) -> str:
    """A row for each file; numbers are right-aligned."""
    rows = [HEADINGS, *(_row(job, outcome) for job, outcome in zip(jobs, made, strict=True))]
    widths = [max(len(row[column]) for row in rows) for column in range(len(HEADINGS))]
    numbers = (2, 3, 4)

    def line(row: tuple[str, ...]) -> str:
        cells = [cell.rjust(w) if k in numbers else cell.ljust(w) for k, (cell, w) in enumerate(zip(row, widths))]  # noqa: B905
        return "  ".join(cells).rstrip()

    return "\n".join(map(line, rows))


def _row(job: Job, outcome: Outcome) -> tuple[str, ...]:
    notes = outcome.error.removeprefix(f"{job.name}: ")
    if outcome.warnings:
        notes = f"{len(outcome.warnings)} warning{'s' if len(outcome.warnings) > 1 else ''}"
    faces = "" if outcome.faces is None else f"{outcome.faces:,}"
    room = "" if outcome.bytes is None else size(outcome.bytes)
    seconds = f"{outcome.seconds:.2f}" if outcome.status in (DONE, FAILED) else ""
    return job.name, outcome.status, faces, room, seconds, notes


def summary(made: list[Outcome]) -> str:
    """``48 done, 1 failed``."""
    counts = {status: sum(outcome.status == status for outcome in made) for status in (DONE, SKIPPED, FAILED, NOT_RUN)}
    return ", ".join(f"{count:,} {status}" for status, count in counts.items() if count)


def write_batch_report(path: str, jobs: list[Job], made: list[Outcome]) -> None:
    """What became of each file, as JSON; what is the same for all comes once."""
    files: list[dict[str, Any]] = [
        {"input": job.name, "output": job.output, **vars(outcome)} for job, outcome in zip(jobs, made, strict=True)
    ]
    options = {name: value for name, value in jobs[0].values.items() if name not in ("input", "output")}
    write_report(path, stamped("batch", {"options": options, "files": files}))
