"""Parts of work on the workers of a Dask cluster.

In: a client, work, its parts. Out: answers, in whatever order they come. Invariant: a worker gets the work once, one that is
started later, too; a part whose worker ends is answered by another. Needs the package `distributed`.
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from typing import Any

try:
    from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
except ImportError as error:
    raise ImportError('workers need the package distributed: pip install "antumbra[dask]"') from error

from ._work import Work

AHEAD = 3
"""Parts that are handed out for each thread of the workers: one is answered, the others hide the way."""


class Study(WorkerPlugin):
    """Work on every worker of a cluster."""

    def __init__(self, work: Work) -> None:
        self._work = work

    def setup(self, worker: Any) -> None:
        """Begins on a worker. What answers need is made by the first part: a worker without one needs none."""
        self._lock = threading.Lock()
        self._made: Any = None

    def answer(self, part: Any, threads: int) -> Any:
        """Answers a part."""
        with self._lock:
            if self._made is None:
                self._made = self._work.begin(threads)
        return self._work.answer(self._made, part, threads)


def answer(name: str, part: Any, threads: int) -> Any:
    """Answers a part on the worker that runs this."""
    study = get_worker().plugins[name]
    assert isinstance(study, Study)
    return study.answer(part, threads)


@contextmanager
def local_client(workers: int) -> Generator[Any, None, None]:
    """Makes a cluster of processes of this machine, one thread each, and ends it."""
    make_cluster: Any = LocalCluster
    make_client: Any = Client
    options = {"n_workers": workers, "threads_per_worker": 1, "processes": True, "dashboard_address": ":0"}
    with make_cluster(**options) as cluster, make_client(cluster) as client:
        yield client


def answers(client: Any, work: Work, parts: Iterable[tuple[int, Any]], threads: int) -> Generator[tuple[int, Any], None, None]:
    """Returns parts' numbers and answers as they come.

    Args:
        client: A `distributed.Client`.
        work: What is done, sent once a worker.
        parts: Numbered parts; read while answers come.
        threads: Threads of each part.
    """
    name = f"antumbra-{uuid.uuid4().hex}"
    client.register_plugin(Study(work), name=name)
    numbers: dict[str, int] = {}
    waiting = iter(parts)
    done: Any = as_completed()  # type: ignore[no-untyped-call]

    def hand_out(count: int) -> None:
        for _, (number, part) in zip(range(count), waiting):
            future = client.submit(answer, name, part, threads, key=f"{name}-{number}", pure=False)
            numbers[future.key] = number
            futures[future.key] = future
            done.add(future)

    futures: dict[str, Any] = {}
    try:
        hand_out(max(AHEAD, AHEAD * sum(client.nthreads().values())))
        for future in done:
            found = future.result()
            futures.pop(future.key)
            number = numbers.pop(future.key)
            # The worker's memory is free before more is asked for.
            future.release()
            hand_out(1)
            yield number, found
    finally:
        if futures:
            client.cancel(list(futures.values()))
        client.unregister_worker_plugin(name)
