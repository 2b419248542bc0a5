"""`curvify batch`: many meshes, in parallel."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import closing
from typing import TYPE_CHECKING, Any

import click

from curvify.cli import options
from curvify.cli.group import COMMANDS, Command
from curvify.cli.parameters import POSITIVE
from curvify.cli.surfaces import with_refine_options

if TYPE_CHECKING:
    from curvify.cli.batch_job import Job, Outcome

EXAMPLES = (
    ("Every OBJ file below assets, to the same places in out", "curvify batch 'assets/**/*.obj' --output-dir out"),
    (
        "Again after a change, only what has changed, whatever fails",
        "curvify batch 'assets/**/*.obj' --output-dir out --skip-existing --keep-going --level 3",
    ),
)
#: Options of refine that batch decides itself.
NOT_FORWARDED = ("input_format", "output_format", "no_clobber", "report", "dry_run", "quiet", "verbose")


@with_refine_options(leave_out=NOT_FORWARDED)
@click.command(name="batch", cls=Command, examples=EXAMPLES, short_help=COMMANDS["batch"])
@click.argument("patterns", metavar="PATTERN...", nargs=-1, required=True)
@options.with_options(
    options.option("Batch", "--output-dir", required=True, metavar="DIR", help="Where the dense meshes go."),
    options.option(
        "Batch", "--suffix", default=".ply", show_default=True, help="Suffix of the dense meshes: their format."
    ),
    options.option(
        "Batch",
        "-j",
        "--jobs",
        type=POSITIVE,
        metavar="N",
        help="Files to work on at a time, each in a process of its own.  [default: one per processor]",
    ),
    options.option("Batch", "--keep-going", is_flag=True, help="Go on with the other files when one fails."),
    options.option(
        "Batch",
        "--skip-existing",
        is_flag=True,
        help="Leave out files whose output is there, made by this version from the same bytes with the same options.",
    ),
    options.option(
        "Batch",
        "--dask",
        metavar="ADDRESS",
        help="Work on a Dask cluster: the address of its scheduler, tcp://host:8786. Needs curvify with its extra dask "
        "there too, and the files under the same names.",
    ),
    options.option("Batch", "--report", metavar="FILE", help="Write what became of each file as JSON; '-' for stdout."),
    options.messages,
)
def command(**given: Any) -> None:
    """Refine many meshes in parallel.

    A PATTERN is a file or, in quotes, a pattern with *, ? and ** for any folders. Files keep their places below the
    fixed part of their pattern. Each output appears complete or not at all; a folder .curvify in DIR remembers what
    each was made from, for --skip-existing. A table at the end tells what became of each file. The exit code is 2 if
    any file failed. All options of refine that follow apply to every file; --threads is for each process.
    """
    batch_files(**given)


def batch_files(
    patterns: tuple[str, ...],
    output_dir: str,
    suffix: str,
    jobs: int | None,
    keep_going: bool,
    skip_existing: bool,
    dask: str | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
    **refine_options: Any,
) -> None:
    """Plan, clean up, work, tell. Raises CurvifyError, at the end where a file failed."""
    from curvify.cli import files
    from curvify.cli.batch_plan import clean_up, plan
    from curvify.cli.console import Console
    from curvify.cli.surfaces import refine_values
    from curvify.errors import OptionError
    from curvify.words import count_of

    console = Console(quiet, verbose)
    if dask is not None and jobs is not None:
        raise OptionError("--jobs is for this machine; a Dask cluster decides itself how much it does at a time")
    if report not in (None, files.STREAM):
        files.check_folder(str(report))
    values = refine_values("", "", {**refine_options, "quiet": True})
    planned, unknown = plan(patterns, output_dir, suffix, skip_existing, values)
    if unknown:
        console.warn(f"{count_of(len(unknown), 'file')} of unknown formats left out, first: {unknown[0]}")
    cleaned = clean_up(planned)
    if cleaned:
        console.explain(f"{count_of(cleaned, 'unfinished file')} of an earlier run removed")
    made = work(planned, jobs, dask, keep_going, console)
    tell(planned, made, report, console)


def work(
    jobs: list[Job], count: int | None, dask: str | None, keep_going: bool, console: Any
) -> list[Outcome]:
    """Do the jobs; the outcome of each, in their order."""
    from curvify.cli.batch_job import NOT_RUN, Outcome
    from curvify.cli.batch_plan import clean_up

    made = [Outcome(NOT_RUN) for _ in jobs]
    done = 0
    try:
        with console.progress("batch") as progress, closing(start(jobs, count, dask, keep_going)) as results:
            for index, outcome in results:
                made[index] = outcome
                done += 1
                progress(done, len(jobs))
    finally:
        clean_up(jobs)  # what killed workers have left
    return made


def start(
    jobs: list[Job], count: int | None, dask: str | None, keep_going: bool
) -> Generator[tuple[int, Outcome], None, None]:
    """Outcomes from processes of this machine or from a cluster, with the threads that each job may use."""
    from curvify.records import replaced
    from curvify.threads import processors

    def with_threads(number: int) -> list[Job]:
        given = jobs[0].values["threads"]
        return [replaced(job, values={**job.values, "threads": given or number}) for job in jobs]

    if dask is not None:
        from curvify.cli import batch_dask

        return batch_dask.outcomes(with_threads(1), dask, keep_going)
    from curvify.cli import workers

    count = min(count or processors(), len(jobs))
    return workers.outcomes(with_threads(max(processors() // count, 1)), count, keep_going)


def tell(jobs: list[Job], made: list[Outcome], report: str | None, console: Any) -> None:
    """Warnings, the table, the report. Raises CurvifyError where a file failed."""
    from curvify.cli.batch_job import FAILED
    from curvify.cli.batch_table import as_table, summary, write_batch_report
    from curvify.cli.main import say
    from curvify.errors import CurvifyError

    for outcome in made:
        for text in outcome.warnings:
            console.warn(text)
    if not console.quiet:
        say(as_table(jobs, made))
    if report is not None:
        write_batch_report(report, jobs, made)
    failed = [(job, outcome) for job, outcome in zip(jobs, made, strict=True) if outcome.status == FAILED]
    if not failed:
        console.tell(summary(made))
        return
    named = [(job.name, outcome.error) for job, outcome in failed]
    texts = [error if error.startswith(name) else f"{name}: {error}" for name, error in named]
    if console.quiet:  # and there was no table
        for text in texts[1:]:
            say(f"curvify: error: {text}")
    raise CurvifyError(f"{summary(made)}; {texts[0]}")
