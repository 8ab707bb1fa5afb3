"""What is asked of points that are meant to lie on surfaces: tolerances, ties, named faces, warnings."""

from __future__ import annotations

import math
import warnings
from typing import Any

import antumbra
import numpy as np
import numpy.typing as npt
import pytest

METHODS = ("auto", "voxel", "bvh", "grid", "voxel-1990", "naive")
MUNICH = np.array([691000.0, 5334000.0, 520.0])
SUN = [antumbra.DirectionalLight((0, 0, 1))]
NORMAL = [[0.1, 0.0, 1.0]]


def floor_and_slab(offset: Any, method: Any = "voxel") -> antumbra.ShadowIndex:
    """A floor, faces 0 and 1, and a slanted slab one unit over it, faces 2 and 3."""
    floor = [[-5, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]]
    slab = [[-1, -1, 1.1], [1, -1, 0.9], [1, 1, 0.9], [-1, 1, 1.1]]
    vertices = np.array(floor + slab) + offset
    scene = antumbra.Scene.from_arrays(vertices, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    return antumbra.ShadowIndex(scene, SUN, method=method)


@pytest.mark.parametrize("offset", [np.zeros(3), MUNICH])
@pytest.mark.parametrize("method", METHODS)
def test_a_point_of_a_floor_in_map_coordinates_is_not_put_on_the_slab_over_it(offset: Any, method: Any) -> None:
    index = floor_and_slab(offset, method)
    points = [[0.2, 0.1, 0.0]] + offset
    assert index.occluded(points, 0, face_ids=[0]).tolist() == [True]
    assert index.occluded(points, 0, NORMAL, on_surface=True).tolist() == [True]
    assert index.occluded(points, 0, on_surface=True).tolist() == [True]
    # Nor by a wide tolerance, nor in float32, where the point moves by centimetres along the floor.
    assert index.occluded(points, 0, NORMAL, on_surface=True, tolerance=2.0).tolist() == [True]
    narrow = points.astype(np.float32)
    assert index.occluded(narrow, 0, np.array(NORMAL, np.float32), on_surface=True).tolist() == [True]
    # Normals of another dtype do not make coarse points fine.
    assert index.occluded(narrow, 0, np.array(NORMAL, np.float64), on_surface=True).tolist() == [True]


@pytest.mark.parametrize("offset", [np.zeros(3), MUNICH])
def test_a_point_one_metre_off_every_surface_is_refused_wherever_the_scene_lies(offset: Any) -> None:
    index = floor_and_slab(offset)
    points = np.array([[0.2, 0.1, 0.0], [4.0, 0.0, 1.0]]) + offset
    with pytest.raises(ValueError, match=r"points\[1\] is .*: on no surface: the nearest, face 0, is .* tolerance="):
        index.occluded(points, 0, on_surface=True)
    assert index.occluded(points, 0, on_surface=True, tolerance=1.5).tolist() == [True, False]
    with pytest.raises(ValueError, match=r"points\[1\]"):
        index.occluded(points.astype(np.float32), 0, on_surface=True)


def test_points_rounded_to_float32_are_refused_as_float64_and_taken_as_float32() -> None:
    vertices = np.array([[0.1, 0.2, 0.3], [1.3, 0.1, 0.7], [0.2, 1.1, 0.9]])
    index = antumbra.ShadowIndex(antumbra.Scene.from_arrays(vertices, [[0, 1, 2]]), SUN)
    points = vertices.mean(axis=0, keepdims=True).astype(np.float32)
    assert index.occluded(points, on_surface=True).tolist() == [False]
    with pytest.raises(ValueError, match="float32"):
        index.occluded(points.astype(np.float64), on_surface=True)


def test_points_named_to_be_on_faces_far_from_them_are_refused() -> None:
    """As when a mesh was renumbered after its points were made."""
    index = floor_and_slab(MUNICH)
    points = np.array([[0.2, 0.0, 0.0], [0.3, 0.0, 0.0], [-0.9, 0.0, 0.0], [0.5, 0.0, 0.0]]) + MUNICH
    ids = [0, 2, 3, 0]
    for dtype in (np.float32, np.float64):
        with pytest.raises(ValueError) as caught:
            index.occluded(points.astype(dtype), 0, face_ids=ids)
        said = str(caught.value)
        assert "2 points are not on the faces that they name" in said and "the first is points[1]" in said, said
        # The slab rises to that side.
        assert "points[2] = " in said and "off face 3" in said and "process=False" in said and "tolerance=" in said, said
    expected = [True, False, False, True]
    assert index.occluded(points, 0, face_ids=ids, tolerance=1.5).tolist() == expected
    assert index.occluded(points, 0, face_ids=ids, tolerance=math.inf).tolist() == expected
    with pytest.raises(ValueError, match="2 points"):
        index.occluded(points, 0, face_ids=ids, tolerance=0.5)
    up = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    for ask, towards in ((index.occluded_rays, up), (index.occluded_segments, points + 9 * up)):
        with pytest.raises(ValueError, match="2 points are not on the faces"):
            ask(points, towards, ids)
        assert ask(points, towards, ids, tolerance=math.inf).tolist() == expected
        with pytest.raises(ValueError, match="only points with face_ids"):
            ask(points, towards, tolerance=1.0)


def on_floor(count: int, height: float) -> npt.NDArray[np.float64]:
    random = np.random.default_rng(1)
    return np.column_stack([random.uniform(-4, 4, (count, 2)), np.full(count, height)]) + MUNICH


@pytest.mark.parametrize("method", METHODS)
def test_points_of_a_mesh_asked_as_points_of_space_are_warned_of(method: Any) -> None:
    index = floor_and_slab(MUNICH, method)
    on, above = on_floor(5000, 0.0), on_floor(5000, 3.0)
    up = np.broadcast_to([0.0, 0.0, 1.0], on.shape)
    calls = [
        lambda points: index.occluded(points),
        lambda points: index.occluded(points, 0, up),
        lambda points: index.occluded_rays(points, up),
        lambda points: index.occluded_segments(points, points + up),
    ]
    for number, call in enumerate(calls):
        with pytest.warns(antumbra.AntumbraWarning, match="lie on surfaces.*face_ids") as caught:
            call(on)
        assert caught[0].filename == __file__, number
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            call(above)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        index.occluded(on, on_surface=True)
        index.occluded(on, face_ids=np.zeros(len(on), int), tolerance=math.inf)
    assert issubclass(antumbra.AntumbraWarning, UserWarning)


def test_packed_answers_have_the_first_point_in_the_lowest_bit() -> None:
    index = floor_and_slab(np.zeros(3))
    points = [[0.0, 0.0, 0.5]] + 8 * [[3.0, 3.0, 0.5]] + [[0.0, 0.5, 0.5]]
    assert index.occluded(points, packed=True).tolist() == [1, 2]
    expected = np.packbits(index.occluded(points, [0]), axis=0, bitorder="little")
    assert np.array_equal(index.occluded(points, [0], packed=True), expected)


@pytest.mark.parametrize("method", METHODS)
def test_a_start_inside_its_own_sphere_is_not_shadowed_by_what_covers_the_voxel(method: Any, tmp_path: Any) -> None:
    path = tmp_path / "ball.nff"
    path.write_text("f 1 1 1 1 0 0 0 1\ns 0 0 0 1\n")
    with pytest.warns(antumbra.AntumbraWarning, match="no view"):
        scene = antumbra.Scene.load(path)
    for light in (antumbra.DirectionalLight((1, 0, 0)), antumbra.PointLight((1, 0, 0))):
        index = antumbra.ShadowIndex(scene, [light], method=method, grid=8)
        found = index.occluded([[0.125, 0.125, 0.625]], face_ids=[0], tolerance=math.inf)
        assert found.tolist() == [False]
        with pytest.raises(ValueError, match="off face 0"):
            index.occluded([[0.125, 0.125, 0.625]], face_ids=[0])
