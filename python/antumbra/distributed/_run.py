"""Who answers parts of work: this process, processes of this machine, or a cluster.

In: work, parts, what the caller said about workers. Out: answers, in whatever order they come.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Any

from .._arrays import whole
from ._work import Work, answers_here


def check_workers(client: Any, workers: Any) -> int | None:
    """Checks who shall answer, and returns the number of processes of this machine to start."""
    if workers is None:
        return None
    if client is not None:
        raise ValueError("workers: a client has its own; give one of both")
    return whole("workers", workers, 1, 1024)


@contextmanager
def answers_of(
    work: Work, parts: Iterator[tuple[int, Any]], count: int, client: Any, workers: int | None, threads: int
) -> Iterator[Iterator[tuple[int, Any]]]:
    """Yields numbers of parts and their answers; whatever was started for them ends with the context.

    Args:
        work: The work.
        parts: Numbered parts; read while answers come.
        count: How many parts there are.
        client: A `distributed.Client`, or `None`.
        workers: Processes of this machine to start, or `None`.
        threads: Threads of a part; 0 for one a processor in this process, and one on a worker.

    Raises:
        ImportError: Dask is needed and not installed.
    """
    with ExitStack() as stack:
        if not count:
            yield iter(())
        elif client is None and workers is None:
            yield stack.enter_context(closing(answers_here(work, parts, threads)))
        else:
            from . import _dask

            if client is None:
                assert workers is not None
                client = stack.enter_context(_dask.local_client(min(workers, count)))
            yield stack.enter_context(closing(_dask.answers(client, work, parts, threads or 1)))
