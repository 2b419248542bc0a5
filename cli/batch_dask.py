"""The jobs of a batch as tasks of a Dask cluster, for more than one machine.

The workers need curvify, and the files under the same names as here. A task whose worker dies is given to another
one by Dask's scheduler; a task does the same again, so that nothing is lost and nothing is half done.
"""

from __future__ import annotations

import logging
from collections.abc import Generator, Sequence
from typing import Any

from curvify.cli.batch_job import FAILED, Job, Outcome, do
from curvify.errors import OptionError

#: Seconds to wait for the scheduler.
PATIENCE = "10s"


def outcomes(jobs: Sequence[Job], address: str, keep_going: bool) -> Generator[tuple[int, Outcome], None, None]:
    """Do jobs on a cluster: the number of each job and its outcome, as they come.

    Unless ``keep_going``, jobs that have not started when one fails are called off.
    Raises OptionError where there is no Dask here or no scheduler there.
    """
    client, as_completed = connect(address)
    with client:
        futures = client.map(do, [job.absolute() for job in jobs], pure=False)
        numbers = {future.key: index for index, future in enumerate(futures)}
        for future in as_completed(futures, loop=client.loop):
            outcome = outcome_of(future)
            if outcome is None:
                continue
            yield numbers[future.key], outcome
            if outcome.status == FAILED and not keep_going:
                client.cancel([other for other in futures if not other.done()])


def connect(address: str) -> tuple[Any, Any]:
    """A client of the scheduler at an address, and Dask's ``as_completed``."""
    try:
        from distributed import Client, as_completed
    except ImportError:
        raise OptionError("--dask needs Dask: pip install 'distributed>=2024.1'") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client: Any = Client
        return client(address, timeout=PATIENCE, set_as_default=False), as_completed
    except (OSError, ValueError) as error:
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise OptionError(f"no Dask scheduler at {address}: {text}") from None


def outcome_of(future: Any) -> Outcome | None:
    """What became of a task; None where it was called off."""
    if future.cancelled():
        return None
    error = future.exception()
    if error is not None:  # a task that several workers died on
        return Outcome(FAILED, error=" ".join(f"{type(error).__name__}: {error}".split()))
    outcome: Outcome = future.result()
    return outcome
