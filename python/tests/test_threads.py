"""The interpreter is free while work is done."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
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
    index = antumbra.ShadowIndex(scene, reference.lights, refine="queried", resolution=128)
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


PROMISED = 2.0
"""Seconds from Ctrl-C to its exception. One is promised; as much again is for machines that do much else."""

LONG = {
    "points": "naive.occluded(points, threads=1)",
    "lights": "many.occluded(points[:1_000_000], range(400))",
    "lights as bits": "many.occluded(points[:1_000_000], range(400), packed=True)",
    "nearest surfaces": "naive.occluded(vertices[faces[numbers, 0]], on_surface=True)",
    "segments": "naive.occluded_segments(points, points + 1)",
    "rays": "naive.occluded_rays(points, points + 1)",
    "nearest hits": "all(antumbra._antumbra.nearest_hits(naive._native, points, points + 1, None, 0) for _ in range(100))",
    "all hits": "all(antumbra._antumbra.all_hits(naive._native, points, points + 1, None, 0) for _ in range(100))",
    "picture": "antumbra.render(scene, samples=65536, threads=1)",
    "eager": "antumbra.ShadowIndex(scene, lights[:50], refine='eager')",
    "eager picture": "antumbra.render(scene, lights=lights[:50], refine='eager')",
    "voxel-1990": "antumbra.ShadowIndex(scene, lights[:100], method='voxel-1990', grid=256)",
}


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
@pytest.mark.parametrize("work", LONG)
def test_ctrl_c_ends_long_work_within_a_second(work: str) -> None:
    code = f"""
import signal, sys, time
sys.path.insert(0, {os.path.dirname(__file__)!r})
import antumbra, numpy as np
from conftest import bumpy_sphere
# Who is started in the background ignores it.
signal.signal(signal.SIGINT, signal.default_int_handler)
vertices, faces = bumpy_sphere(100)
scene = antumbra.Scene.from_arrays(vertices, faces)
lights = [antumbra.PointLight(3 * x) for x in np.random.default_rng(1).normal(size=(400, 3))]
naive = antumbra.ShadowIndex(scene, lights[:1], method="naive")
many = antumbra.ShadowIndex(scene, lights)
points = np.random.default_rng(2).uniform(-2, 2, size=(1 << 21, 3))
numbers = np.random.default_rng(3).integers(len(faces), size=1 << 21)
small, some = points[:50], [0, 1, 2]
print("ready", flush=True)
try:
    {LONG[work]}
except KeyboardInterrupt:
    print("interrupted", flush=True)
else:
    print("done", flush=True)
# What was stopped can be asked again.
expected = antumbra.ShadowIndex(scene, lights[:3], method="naive").occluded(small, some)
assert np.array_equal(many.occluded(small, some), expected)
assert np.array_equal(naive.occluded(small), expected[:, 0])
print("right", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(1.0)
        begin = time.monotonic()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        assert time.monotonic() - begin < PROMISED
        assert child.stdout.readline() == "right\n"
        assert child.wait(timeout=60) == 0
    finally:
        child.kill()
        child.wait()
        child.stdout.close()


@pytest.mark.skipif(sys.platform == "win32", reason="signals are sent otherwise there")
@pytest.mark.parametrize("ending", ["obj", "ply", "stl"])
def test_ctrl_c_ends_the_reading_of_a_file(tmp_path: Path, ending: str) -> None:
    text = {
        "obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\n" + "f 1 2 3\n" * 3_000_000,
        "ply": "ply\nformat ascii 1.0\nelement vertex 4000000\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 0\nproperty list uchar int vertex_indices\nend_header\n" + "1.25 2.5 3.75\n" * 4_000_000,
        "stl": "solid a\n"
        + "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n" * 1_500_000
        + "endsolid a\n",
    }
    path = tmp_path / f"large.{ending}"
    path.write_text(text[ending])
    code = f"""
import signal
import antumbra
signal.signal(signal.SIGINT, signal.default_int_handler)
print("ready", flush=True)
try:
    antumbra.Scene.load({str(path)!r})
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-W", "ignore", "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    try:
        assert child.stdout.readline() == "ready\n"
        time.sleep(0.15)
        begin = time.monotonic()
        child.send_signal(signal.SIGINT)
        assert child.stdout.readline() == "interrupted\n"
        assert time.monotonic() - begin < PROMISED
    finally:
        child.kill()
        child.wait()
        child.stdout.close()
