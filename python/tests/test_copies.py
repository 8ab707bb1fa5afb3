"""Copies and pickles of scenes and indices: for process pools, Dask and the like."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from pathlib import Path
from typing import Any

import antumbra
import numpy as np
import pytest
from conftest import LIGHTS, points_on

PROTOCOLS = range(2, pickle.HIGHEST_PROTOCOL + 1)

NFF = """v
from 4 -6 5
at 0 0 0.5
up 0 0 1
angle 40
hither 0.1
resolution 64 48
l 5 -3 8 0.5 0.4 0.3
f 0.8 0.7 0.6 0.9 0 1 0 0
p 4
-3 -3 0
3 -3 0
3 3 0
-3 3 0
s 0 0 0.8 0.5
c
1 0.5 0 0.3
1 0.5 1.5 0.1
"""


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_scene_comes_back_bit_for_bit(scene: antumbra.Scene, protocol: int) -> None:
    again = pickle.loads(pickle.dumps(scene, protocol))
    assert np.array_equal(again.triangles(), scene.triangles())
    assert again.surface_count == scene.surface_count
    assert np.array_equal(again.bounds, scene.bounds)


def test_a_scene_with_curves_lights_and_a_camera_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "scene.nff"
    path.write_text(NFF)
    scene = antumbra.Scene.load(path)
    again = pickle.loads(pickle.dumps(scene))
    assert again.lights == scene.lights and again.surface_count == scene.surface_count == 4
    first, second = (antumbra.render(of, size=(32, 24)) for of in (scene, again))
    assert np.array_equal(first.colour, second.colour)


def test_warnings_of_a_reader_come_back_and_are_not_told_again(tmp_path: Path) -> None:
    path = tmp_path / "scene.nff"
    path.write_text("s 0 0 0 1\n")
    with pytest.warns(antumbra.AntumbraWarning, match="no view"):
        scene = antumbra.Scene.load(path)
    assert pickle.loads(pickle.dumps(scene)).warnings == scene.warnings != []


def test_bytes_that_are_no_scene_are_refused(scene: antumbra.Scene) -> None:
    data = scene._native.to_bytes()
    for bad in (b"", data[:-1], b"\xff" * 100, b"\x059.9.9" + data[6:]):
        with pytest.raises(ValueError, match="no scene's bytes"):
            antumbra._antumbra.Scene.of_bytes(bad)


@pytest.mark.parametrize("method", ["auto", "voxel", "voxel-1990", "grid", "bvh", "naive"])
@pytest.mark.parametrize("protocol", [2, pickle.HIGHEST_PROTOCOL])
def test_an_index_answers_as_before(scene: antumbra.Scene, bumps: Any, method: Any, protocol: int) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS, method=method, refine="queried", resolution=64, grid=8)
    points, ids, _ = points_on(*bumps, 300, seed=21)
    expected = index.occluded(points, [0, 1, 2], face_ids=ids)
    again = pickle.loads(pickle.dumps(index, protocol))
    assert np.array_equal(again.occluded(points, [0, 1, 2], face_ids=ids), expected)
    assert again.lights == index.lights and again.stats()["method"] == method
    assert again.stats()["grid"] == index.stats()["grid"]


def test_an_index_comes_back_with_what_it_knows(scene: antumbra.Scene, bumps: Any) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS, method="voxel", refine="eager", resolution=64)
    again = pickle.loads(pickle.dumps(index))
    assert again.saved_lights == ["loaded"] * 3
    points, ids, _ = points_on(*bumps, 300, seed=22)
    assert np.array_equal(
        again.occluded(points, [0, 1, 2], face_ids=ids), index.occluded(points, [0, 1, 2], face_ids=ids)
    )
    assert again.stats()["value_bytes"] == index.stats()["value_bytes"]


def test_copies_are_the_object_itself(scene: antumbra.Scene, index: antumbra.ShadowIndex) -> None:
    for thing in (scene, index):
        assert copy.copy(thing) is thing and copy.deepcopy([thing])[0] is thing


def test_everything_else_is_copied_and_pickled_too(scene: antumbra.Scene) -> None:
    picture = antumbra.render(scene, size=(8, 6), lights=LIGHTS)
    camera = antumbra.Camera(eye=(1, 2, 3), at=(0, 0, 0))
    volume = antumbra.ShadowIndex(scene, LIGHTS, method="voxel").volume(4)
    for make in (copy.copy, copy.deepcopy, lambda thing: pickle.loads(pickle.dumps(thing))):
        assert make(LIGHTS) == LIGHTS and make(camera) == camera
        assert np.array_equal(make(picture).colour, picture.colour)
        assert np.array_equal(make(volume).values, volume.values)


def ask(work: tuple[antumbra.ShadowIndex, Any, Any]) -> Any:
    index, points, ids = work
    return index.occluded(points, [0, 1, 2], face_ids=ids, threads=1)


def test_a_pool_of_new_processes_asks_an_index(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, _ = points_on(*bumps, 400, seed=23)
    parts = [(index, points[part], ids[part]) for part in (slice(0, 200), slice(200, 400))]
    with multiprocessing.get_context("spawn").Pool(2) as pool:
        found = np.concatenate(pool.map(ask, parts))
    assert np.array_equal(found, index.occluded(points, [0, 1, 2], face_ids=ids))
