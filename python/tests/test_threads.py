"""The interpreter is free while work is done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from typing import Any

import antumbra
import numpy as np
import pytest
from conftest import points_on

# Points of surfaces are asked as points of space, too: answers are compared, whatever was meant.
pytestmark = pytest.mark.filterwarnings("ignore::antumbra.AntumbraWarning")


def busy(reference: antumbra.ShadowIndex, bumps: Any) -> Any:
    """Returns a call that takes some tenths of a second."""
    points = points_on(*bumps, 4000, seed=8)[0]
    return lambda: reference.occluded(points, [0, 1], threads=1)


def test_python_goes_on_meanwhile(reference: antumbra.ShadowIndex, bumps: Any) -> None:
    call = busy(reference, bumps)
    spans: list[tuple[float, float]] = []

    def work() -> None:
        begin = time.monotonic()
        call()
        spans.append((begin, time.monotonic()))

    worker = threading.Thread(target=work)
    ticks = []
    worker.start()
    while worker.is_alive():
        ticks.append(time.monotonic())
        time.sleep(0.001)
    worker.join()
    [(begin, end)] = spans
    margin = 0.1 * (end - begin)
    within = [tick for tick in ticks if begin + margin < tick < end - margin]
    assert len(within) >= 5, f"{len(within)} ticks in {end - begin:.3f} s"


def test_two_calls_overlap(reference: antumbra.ShadowIndex, bumps: Any) -> None:
    call = busy(reference, bumps)
    spans: list[tuple[float, float]] = []
    answers: list[Any] = []
    barrier = threading.Barrier(2)

    def work() -> None:
        barrier.wait()
        begin = time.monotonic()
        answers.append(call())
        spans.append((begin, time.monotonic()))

    workers = [threading.Thread(target=work) for _ in range(2)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    (first_begin, first_end), (second_begin, second_end) = spans
    overlap = min(first_end, second_end) - max(first_begin, second_begin)
    shorter = min(first_end - first_begin, second_end - second_begin)
    assert overlap > 0.5 * shorter, spans
    assert np.array_equal(answers[0], answers[1])


def test_a_lazy_index_is_asked_by_many_threads(scene: antumbra.Scene, reference: antumbra.ShadowIndex, bumps: Any) -> None:
    index = antumbra.ShadowIndex(scene, reference.lights, refine="asked", resolution=128)
    points, ids, _ = points_on(*bumps, 500, seed=9)
    expected = reference.occluded(points, [0, 1, 2], face_ids=ids)
    found: list[Any] = []
    workers = [
        threading.Thread(target=lambda: found.append(index.occluded(points, [0, 1, 2], face_ids=ids, threads=2)))
        for _ in range(4)
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    assert len(found) == 4 and all(np.array_equal(answers, expected) for answers in found)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
def test_a_forked_child_has_threads_of_its_own() -> None:
    """Threads do not survive a fork: a pool that was made before it would wait for ever."""
    code = """
import multiprocessing, warnings
import antumbra, numpy as np
warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 warns of forks with threads: the point here.
scene = antumbra.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
index = antumbra.ShadowIndex(scene, [antumbra.PointLight((5, 5, 5))])
def ask(_):
    return index.occluded(np.zeros((5000, 3)), threads=2).all()
assert ask(0)
with multiprocessing.get_context("fork").Pool(2) as pool:
    assert all(pool.map(ask, range(4)))
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
@pytest.mark.parametrize("work", ["index.occluded(points, threads=1)", "antumbra.render(scene, samples=65536, threads=1)"])
def test_ctrl_c_ends_long_work(work: str) -> None:
    code = f"""
import signal
import antumbra, numpy as np
# Who is started in the background ignores it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = antumbra.Scene.from_arrays(np.random.default_rng(1).normal(size=(60, 3)), np.arange(60).reshape(20, 3))
index = antumbra.ShadowIndex(scene, [antumbra.PointLight((5, 5, 5))], method="naive")
points = np.zeros((1 << 26, 3), np.float32)
print("ready", flush=True)
try:
    {work}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("done", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.5)
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        assert child.wait(timeout=60) == 0
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
