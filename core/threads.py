"""Running the jobs of a dense mesh on threads, with the same result for any number of them."""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from curvify.mesh import Ints
from curvify.sinks import DenseLayout, Sink

Job = Callable[[Sink], None]
Progress = Callable[[int, int], None]


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_jobs(
    jobs: list[tuple[int, Job]], sink: Sink, threads: int | None = None, progress: Progress | None = None
) -> None:
    """Run all jobs into a sink on some threads; the first error stops the others and is raised here."""
    count = min(threads or processors(), len(jobs))
    total = sum(size for size, _ in jobs)
    state = _Run(sink, total, progress)
    if count <= 1:
        for index in range(len(jobs)):
            state.run(jobs, index)
        return
    numbers = itertools.count()

    def work() -> None:
        while (index := next(numbers)) < len(jobs) and state.error is None:
            try:
                state.run(jobs, index)
            except BaseException as error:
                state.fail(error)

    workers = [threading.Thread(target=work, daemon=True) for _ in range(count)]
    try:
        for worker in workers:
            worker.start()
        for worker in workers:
            while worker.is_alive():
                worker.join(0.1)
    except BaseException as error:
        state.fail(error)
        for worker in workers:  # one may hang in a pipe that nobody reads
            if worker.ident is not None:
                worker.join(None if sink.anywhere else 1.0)
        raise
    if state.error is not None:
        raise state.error


class _Run:
    """What the threads of one run share: the turn of an ordered sink, progress, the first error."""

    def __init__(self, sink: Sink, total: int, progress: Progress | None) -> None:
        self.sink, self.total, self.progress = sink, total, progress
        self.error: BaseException | None = None
        self._turn = threading.Condition()
        self._next = 0
        self._done = 0

    def run(self, jobs: list[tuple[int, Job]], index: int) -> None:
        size, job = jobs[index]
        if self.sink.anywhere:
            job(self.sink)
        else:
            held = _Held()
            job(held)
            with self._turn:
                self._turn.wait_for(lambda: self._next == index or self.error is not None)
                if self.error is not None:
                    return
            held.release(self.sink)
            with self._turn:
                self._next += 1
                self._turn.notify_all()
        with self._turn:
            self._done += size
            if self.progress is not None:
                self.progress(self._done, self.total)

    def fail(self, error: BaseException) -> None:
        with self._turn:
            self.error = self.error or error
            self._turn.notify_all()


class _Held:
    """Keeps the blocks of a job until its turn comes."""

    anywhere = False

    def __init__(self) -> None:
        self._calls: list[Callable[[Sink], None]] = []

    def begin(self, layout: DenseLayout) -> None:
        raise AssertionError("jobs do not begin sinks")

    def end(self) -> None:
        raise AssertionError("jobs do not end sinks")

    def vertices(self, start: int, records: np.ndarray[Any, Any]) -> None:
        self._calls.append(lambda sink: sink.vertices(start, records))

    def faces(self, start: int, wedges: Ints, source_faces: Ints) -> None:
        self._calls.append(lambda sink: sink.faces(start, wedges, source_faces))

    def release(self, sink: Sink) -> None:
        for call in self._calls:
            call(sink)
