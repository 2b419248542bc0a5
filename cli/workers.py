"""Doing jobs in processes of their own, so that one that dies takes nothing with it but its job.

Processes are spawned: each starts afresh and shares nothing. ``multiprocessing``'s pool waits forever for a worker
that was killed, and ``concurrent.futures`` gives up on all jobs; here the job of a dead worker fails and a new worker
takes the next one.
"""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import wait
from typing import Any

from curvify.cli.batch_job import FAILED, Job, Outcome, do
from curvify.cli.main import Stopped

#: Seconds that a worker has to clean up after itself when the batch is stopped.
GRACE = 10.0


def outcomes(jobs: Sequence[Job], count: int, keep_going: bool) -> Generator[tuple[int, Outcome], None, None]:
    """Do jobs in ``count`` processes: the number of each job and its outcome, as they come.

    Unless ``keep_going``, no job starts after one has failed. Closing the iterator stops the workers.
    """
    waiting = deque(range(len(jobs)))
    idle: list[Worker] = []
    busy: dict[Any, tuple[Worker, int]] = {}
    try:
        while waiting or busy:
            while waiting and len(busy) < count:
                worker = idle.pop() if idle else Worker()
                if worker.give(jobs[waiting[0]]):
                    busy[worker.pipe] = worker, waiting.popleft()
            for pipe in wait(list(busy)):
                worker, index = busy.pop(pipe)
                outcome = worker.take()
                if worker.alive:
                    idle.append(worker)
                if outcome.status == FAILED and not keep_going:
                    waiting.clear()
                yield index, outcome
    finally:
        for worker, _ in busy.values():
            worker.process.terminate()
        for worker in [*idle, *(worker for worker, _ in busy.values())]:
            worker.end()


class Worker:
    """A process that does jobs one after the other."""

    def __init__(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.process = context.Process(target=serve, args=(theirs,), daemon=True)
        with _interrupts_ignored():  # and so they are in the new process
            self.process.start()
        theirs.close()
        self.alive = True

    def give(self, job: Job) -> bool:
        """Hand over a job; False where the worker has died meanwhile."""
        try:
            self.pipe.send(job)
        except OSError:
            self.end()
            return False
        return True

    def take(self) -> Outcome:
        """The outcome of its job, which waits to be read, or word of its end."""
        try:
            outcome: Outcome = self.pipe.recv()
            return outcome
        except (EOFError, OSError):
            self.end()
            return Outcome(FAILED, error=f"the process that worked on it {_end_of(self.process.exitcode)}")

    def end(self) -> None:
        """Let the process end, and wait for that."""
        self.alive = False
        self.pipe.close()
        self.process.join(GRACE)
        if self.process.exitcode is None:
            self.process.kill()
            self.process.join()


def _end_of(code: int | None) -> str:
    if code is not None and code < 0:
        with suppress(ValueError):
            return f"was killed ({signal.Signals(-code).name}): by someone, or by the system for want of memory"
    return f"ended without an answer (exit code {code})"


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """A Ctrl-C at the terminal reaches all processes; the batch alone acts on it, and stops its workers."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def serve(pipe: Any) -> None:
    """Do the jobs that come through a pipe until it closes. A request to stop removes unfinished files."""

    def stop(number: int, _: object) -> None:
        raise Stopped(number)

    import warnings

    warnings.simplefilter("ignore")
    signal.signal(signal.SIGTERM, stop)
    try:
        while True:
            pipe.send(do(pipe.recv()))
    except (EOFError, OSError):
        pass
    except Stopped as error:
        sys.exit(128 + error.number)
