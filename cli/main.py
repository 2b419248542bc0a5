"""The entry point: exit codes, errors in one line, signals.

Click is imported when there is something to parse, numpy when a command needs it. Exit codes: 0 done, 1 the answer
of a check is no, 2 cannot, 130 interrupted, 128 + n stopped by signal n.
"""

from __future__ import annotations

import gc
import os
import sys
from contextlib import suppress
from typing import Any, NoReturn

from curvify import __version__

#: Our own threads do the work; a linear algebra library with threads of its own would only be in their way.
THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
#: Set to anything, it shows the traceback of an error as well.
TRACEBACK = "CURVIFY_TRACEBACK"


class Stopped(BaseException):
    """A signal asks the process to end."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def command() -> NoReturn:
    """The installed command: ``main``, and then an end at once.

    All files are closed by then. Taking the modules apart and freeing all memory would take a tenth of a short run.
    """
    try:
        main()
    except SystemExit as end:
        code = end.code
    if code is not None and not isinstance(code, int):
        sys.exit(code)
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code or 0)


def main() -> NoReturn:
    """Run the command line of the process and leave with its exit code."""
    gc.set_threshold(100_000)  # what imports make stays: looking through it for garbage is in vain
    if sys.stderr is None:  # print would send what is meant for it to standard output
        sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115
    args = sys.argv[1:]
    if args == ["--version"]:
        leave(_print_version())
    for name in THREAD_VARIABLES:
        os.environ[name] = "1"
    import warnings

    warnings.simplefilter("ignore")  # curvify has its own; those of libraries are for programmers
    leave(_run_with_signals(args))


def _print_version() -> int:
    try:
        print(f"curvify {__version__}", flush=True)
    except OSError as error:
        return explain(error)
    return 0


def leave(code: int) -> NoReturn:
    """End the process quietly, whatever has become of the reader of standard output."""
    if code >= 128:  # at once: a thread may still wait for a reader that has stopped reading
        with suppress(OSError):
            sys.stderr.flush()
        os._exit(code)
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except BrokenPipeError:
        _drop_stdout()
    except OSError as error:
        _drop_stdout()
        code = explain(error)
    sys.exit(code)


def _drop_stdout() -> None:
    """Let the interpreter flush what is left to nowhere as it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)


def _run_with_signals(args: list[str]) -> int:
    """``run``, with the signals that end a process turned into exceptions so that temporary files are removed."""
    import signal

    def stop(number: int, frame: object) -> None:
        raise Stopped(number)

    try:
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)
            # What the caller chose to ignore, as nohup does, stays ignored.
            if number is not None and signal.getsignal(number) == signal.SIG_DFL:
                signal.signal(number, stop)
        return run(args)
    except (Stopped, KeyboardInterrupt) as error:  # between the lines above
        return explain(error)


def run(args: list[str]) -> int:
    """Run one command line; its exit code. Errors are printed, not raised."""
    try:
        from click.exceptions import Exit

        from curvify.cli.group import curvify

        if "_CURVIFY_COMPLETE" in os.environ:  # a shell asks for completions
            curvify.main(args, prog_name="curvify")
        if not args:
            with curvify.make_context("curvify", [], resilient_parsing=True) as context:
                say(curvify.get_help(context))
            return 2
        try:
            with curvify.make_context("curvify", list(args)) as context:
                curvify.invoke(context)
        except Exit as end:
            return end.exit_code
    except SystemExit:
        raise
    except BaseException as error:
        return explain(error)
    return 0


def explain(error: BaseException) -> int:
    """Print an error as one line; the exit code."""
    if os.environ.get(TRACEBACK):
        import traceback

        traceback.print_exception(error)
    if isinstance(error, BrokenPipeError):
        return 0
    if isinstance(error, KeyboardInterrupt):
        say("curvify: interrupted")
        return 130
    if isinstance(error, Stopped):
        say("curvify: stopped by a signal")
        return 128 + error.number
    text, known = text_of(error)
    if known:
        say(f"curvify: error: {text}")
    else:
        say(f"curvify: internal error: {text}; please report it with what {TRACEBACK}=1 shows")
    return 2


def text_of(error: BaseException) -> tuple[str, bool]:
    """What to say about an error, and whether it is one that the user can mend."""
    from click import ClickException

    from curvify.errors import CurvifyError

    if isinstance(error, CurvifyError):
        return str(error), True
    if isinstance(error, ClickException):
        return _usage_text(error), True
    if isinstance(error, MemoryError):
        return "out of memory; choose a lower level", True
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        return where + (error.strerror or str(error) or type(error).__name__).lower(), True
    return f"{type(error).__name__}: {error}", False


def _usage_text(error: Any) -> str:
    """Click's message with a hint where to look."""
    message = error.format_message().strip().rstrip(".")
    if "unexpected extra argument" in message:
        message += "; names with blanks need quotes"
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else "curvify"
    return f"{message[:1].lower()}{message[1:]} (try '{path} --help')"


def say(text: str) -> None:
    """A message on standard error: one line unless it is a help page. A closed standard error is no reason to stop."""
    if text.startswith("curvify:"):
        text = " ".join(text.splitlines())
    with suppress(OSError, ValueError):
        print(text, file=sys.stderr, flush=True)
