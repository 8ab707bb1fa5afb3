"""Chunks on the workers of a Dask cluster.

In: a client, a scene, a question, chunks of sensors. Out: answers, in whatever order they come. Invariant: a worker gets the
scene once, one that is started later, too; a chunk whose worker ends is answered by another. Needs the package `distributed`.
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy.typing as npt

try:
    from distributed import Client, LocalCluster, WorkerPlugin, as_completed, get_worker
except ImportError as error:
    raise ImportError('workers need the package distributed: pip install "antumbra[dask]"') from error

from ..index import ShadowIndex
from ..scene import Scene
from ..sun._sensors import Sensors
from ._questions import Question, answer_chunk

AHEAD = 3
"""Chunks that are handed out for each thread of the workers: one is answered, the others hide the way."""


class Study(WorkerPlugin):
    """A scene and a question on every worker of a cluster."""

    def __init__(self, scene: Scene, question: Question) -> None:
        self._scene = scene
        self._question = question

    def setup(self, worker: Any) -> None:
        """Begins on a worker. Its index is made by the first chunk: a worker without one needs none."""
        self._lock = threading.Lock()
        self._index: ShadowIndex | None = None

    def answer(self, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        """Answers a chunk."""
        with self._lock:
            if self._index is None:
                self._index = ShadowIndex(self._scene, [], threads=threads)
        return answer_chunk(self._question, self._index, sensors.aligned(), begin, threads)


def answer(name: str, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
    """Answers a chunk on the worker that runs this."""
    study = get_worker().plugins[name]
    assert isinstance(study, Study)
    return study.answer(sensors, begin, threads)


@contextmanager
def local_client(workers: int) -> Iterator[Any]:
    """Makes a cluster of processes of this machine, one thread each, and ends it."""
    make_cluster: Any = LocalCluster
    make_client: Any = Client
    options = {"n_workers": workers, "threads_per_worker": 1, "processes": True, "dashboard_address": ":0"}
    with make_cluster(**options) as cluster, make_client(cluster) as client:
        yield client


def answers(
    client: Any, scene: Scene, question: Question, parts: Iterable[tuple[int, int, Sensors]], threads: int
) -> Iterator[tuple[int, npt.NDArray[Any]]]:
    """Returns chunks' numbers and answers as they come.

    Args:
        client: A `distributed.Client`.
        scene: The surfaces, sent once a worker.
        question: What is asked.
        parts: Numbers, first sensors and sensors of chunks; read while answers come.
        threads: Threads of each chunk.
    """
    name = f"antumbra-{uuid.uuid4().hex}"
    client.register_plugin(Study(scene, question), name=name)
    numbers: dict[str, int] = {}
    waiting = iter(parts)
    done: Any = as_completed()  # type: ignore[no-untyped-call]

    def hand_out(count: int) -> None:
        for _, (number, begin, sensors) in zip(range(count), waiting):
            future = client.submit(answer, name, sensors, begin, threads, key=f"{name}-{number}", pure=False)
            numbers[future.key] = number
            futures[future.key] = future
            done.add(future)

    futures: dict[str, Any] = {}
    try:
        hand_out(max(AHEAD, AHEAD * sum(client.nthreads().values())))
        for future in done:
            rows = future.result()
            futures.pop(future.key)
            number = numbers.pop(future.key)
            # The worker's memory is free before more is asked for.
            future.release()
            hand_out(1)
            yield number, rows
    finally:
        if futures:
            client.cancel(list(futures.values()))
        client.unregister_worker_plugin(name)
