"""The short ways to ask give the answers of the long one, and take what callers have."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import antumbra
import numpy as np
import pytest
from conftest import LIGHTS, points_on

SQUARE = (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float32), [[0, 1, 2], [0, 2, 3]])


def test_one_question_a_method(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, normals = points_on(*bumps, 2_000, seed=31)
    off = points + 0.3 * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    all_lights = [0, 1, 2]
    pairs: list[tuple[Any, Any]] = [
        (index.occluded_on_faces(points, ids), index.occluded(points, all_lights, face_ids=ids)),
        (index.occluded_near(points), index.occluded(points, all_lights, on_surface=True)),
        (
            index.occluded_near(points, normals=normals),
            index.occluded(points, all_lights, normals, on_surface=True),
        ),
        (index.occluded_at(off), index.occluded(off, all_lights)),
        (index.occluded_at(off, normals=normals), index.occluded(off, all_lights, normals)),
    ]
    for found, expected in pairs:
        assert found.shape == (2_000, 3) and found.dtype == np.bool_
        assert np.array_equal(found, expected) and found.any() and not found.all()


def test_lights_are_one_many_or_all(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, _ = points_on(*bumps, 500, seed=32)
    every = index.occluded_on_faces(points, ids)
    assert every.shape == (500, 3)
    assert np.array_equal(index.occluded_on_faces(points, ids, 1), every[:, 1])
    assert np.array_equal(index.occluded_on_faces(points, ids, [2, 0]), every[:, [2, 0]])
    assert np.array_equal(index.occluded_on_faces(points, ids, np.array([1])), every[:, [1]])
    bits = index.occluded_on_faces(points, ids, packed=True)
    assert bits.dtype == np.uint8 and np.array_equal(bits, np.packbits(every, axis=0, bitorder="little"))
    with pytest.raises(IndexError, match=r"lights is 3: expected less than 3, the number of lights"):
        index.occluded_on_faces(points, ids, 3)
    with pytest.raises(TypeError, match="lights"):
        index.occluded_near(points, 0.5)  # type: ignore[call-overload]


def test_points_on_surfaces_are_told_where_to_go(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, _ = points_on(*bumps, 300, seed=33)
    with pytest.warns(antumbra.AntumbraWarning, match=r"\(100 %\) lie on surfaces.*Call occluded_near") as reported:
        index.occluded_at(points)
    assert reported[0].filename == __file__
    with pytest.raises(ValueError, match="tolerance"):
        index.occluded_on_faces(points + 0.5, ids)
    assert index.occluded_on_faces(points + 0.5, ids, tolerance=np.inf).shape == (300, 3)
    with pytest.raises(ValueError, match="on no surface"):
        index.occluded_near(points + 0.5)
    assert index.occluded_near(points + 0.01, tolerance=0.1).shape == (300, 3)


def test_an_index_takes_what_has_surfaces() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: its meshes are not taken")
    light = antumbra.PointLight((0, 0, 2))
    mesh = trimesh.Trimesh(*SQUARE, process=False)
    found = [
        antumbra.ShadowIndex(scene, light).occluded_at([[0, 0, -1], [0, 0, 1]]).tolist()
        for scene in (antumbra.Scene.from_arrays(*SQUARE), SQUARE, list(SQUARE), mesh, trimesh.Scene([mesh]))
    ]
    assert found == [[[True], [False]]] * 5
    assert antumbra.ShadowIndex(mesh, [light, light]).stats()["lights"] == 2
    assert antumbra.render(SQUARE, lights=light, size=(4, 3)).color.shape == (3, 4, 3)
    for bad, kind in ((3, TypeError), ("scene.obj", TypeError), (SQUARE[:1], ValueError)):
        with pytest.raises(kind, match="scene: expected"):
            antumbra.ShadowIndex(bad)


def test_a_sun_is_a_directional_light() -> None:
    sun = antumbra.Sun(90, 0, up="y", color=(1, 0.5, 0))
    assert isinstance(sun, antumbra.DirectionalLight) and np.allclose(sun.direction, (1, 0, 0))
    assert sun == antumbra.DirectionalLight.sun(90, 0, up="y", color=(1, 0.5, 0))
    index = antumbra.ShadowIndex(SQUARE, antumbra.Sun(0, 90))
    assert index.occluded_at([[0, 0, -1], [0, 0, 1]], 0).tolist() == [True, False]
    with pytest.raises(ValueError, match="elevation"):
        antumbra.Sun(0, 91)


def test_both_spellings_of_color_are_taken() -> None:
    for make in (
        lambda **how: antumbra.PointLight((0, 0, 1), **how),
        lambda **how: antumbra.DirectionalLight((0, 0, 1), **how),
        lambda **how: antumbra.SpotLight((0, 0, 1), (0, 0, -1), **how),
    ):
        light = make(color=(1, 2, 3))
        assert light == make(colour=(1, 2, 3)) and light.color == light.colour == (1.0, 2.0, 3.0)
        assert pickle.loads(pickle.dumps(light)) == light
        with pytest.raises(ValueError, match="color is"):
            make(color=(1, -2, 3))
    picture = antumbra.render(SQUARE, size=(4, 3))
    assert picture.color is picture.colour


def test_progress_is_told_and_changes_nothing(scene: antumbra.Scene, bumps: Any, capsys: Any) -> None:
    reported: list[tuple[str, int, int]] = []

    def tell(stage: str, done: int, count: int) -> None:
        reported.append((stage, done, count))

    index = antumbra.ShadowIndex(scene, LIGHTS, refine="eager", resolution=64, progress=tell)
    assert reported and reported[-1][0] == "baking" and reported[-1][1] == reported[-1][2]
    reported.clear()
    points, ids, _ = points_on(*bumps, 150_001, seed=34)
    expected = index.occluded_on_faces(points, ids)
    assert np.array_equal(index.occluded_on_faces(points, ids, progress=tell), expected)
    bits = index.occluded_on_faces(points, ids, packed=True, progress=tell)
    assert np.array_equal(bits, np.packbits(expected, axis=0, bitorder="little"))
    assert reported[-1] == ("answering", 150_001, 150_001)
    bad = points.copy()
    bad[140_000] = np.nan
    for progress in (None, tell):
        with pytest.raises(ValueError, match=r"points\[140000\]"):
            index.occluded_on_faces(bad, ids, progress=progress)
    reported.clear()
    antumbra.render(scene, size=(64, 48), progress=tell)
    assert reported[-1] == ("rendering", 64 * 48, 64 * 48)
    capsys.readouterr()
    index.occluded_on_faces(points, ids, progress=True)
    assert capsys.readouterr().err.endswith("answering: 100 %\n")
    with pytest.raises(TypeError, match="progress: expected True or a callable"):
        index.occluded_on_faces(points, ids, progress=3)  # type: ignore[call-overload]


def test_what_a_progress_callable_raises_ends_the_call(scene: antumbra.Scene, bumps: Any) -> None:
    def stop(stage: str, done: int, count: int) -> None:
        raise RuntimeError(stage)

    points, ids, _ = points_on(*bumps, 1_000, seed=35)
    index = antumbra.ShadowIndex(scene, LIGHTS)
    with pytest.raises(RuntimeError, match="answering"):
        index.occluded_on_faces(points, ids, progress=stop)
    assert index.occluded_on_faces(points, ids).shape == (1_000, 3)


def test_a_picture_shows_itself(tmp_path: Path) -> None:
    picture = antumbra.render(SQUARE, lights=[antumbra.PointLight((0, 0, 2), name="lamp")], size=(32, 24))
    path = tmp_path / "picture.png"
    picture.save_png(path)
    assert picture._repr_png_() == path.read_bytes()
    srgb = picture.to_srgb()
    assert srgb.shape == (24, 32, 3) and srgb.dtype == np.uint8
    linear = np.clip(picture.color.astype(np.float64), 0, 1)
    expected = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(255 * expected - srgb).max() <= 0.501
    assert (picture.to_srgb(stops=-2) <= srgb).all() and (picture.to_srgb(stops=-2) < srgb).any()
    path = tmp_path / "picture.exr"
    picture.save_exr(path)
    data = path.read_bytes()
    assert data[:4] == b"\x76\x2f\x31\x01"
    for name in (b"beauty", b"shadow.lamp", b"decided-by", b"first_pass"):
        assert name in data
    with pytest.raises(ValueError, match="ends in .exr"):
        picture.save_exr(tmp_path / "picture.png")


def test_the_picture_of_a_file_is_not_written_over_it(tmp_path: Path) -> None:
    path = tmp_path / "scene.nff"
    path.write_text("f 1 1 1 1 0 0 0 1\np 3\n-1 -1 1\n1 -1 1\n0 1 1\n")
    with pytest.warns(antumbra.AntumbraWarning):
        scene = antumbra.Scene.load(path)
    link = tmp_path / "link.exr"
    link.hardlink_to(path)
    with pytest.raises(ValueError, match="the scene was read from this file"):
        antumbra.render(scene, size=(4, 3)).save_exr(link)


def test_values_of_a_file_are_loaded(scene: antumbra.Scene, bumps: Any, tmp_path: Path) -> None:
    path = tmp_path / "values.antumbra"
    reported: list[str] = []
    made = antumbra.ShadowIndex(scene, LIGHTS, refine="eager", resolution=64)
    made.save(path, progress=lambda stage, done, count: reported.append(stage))
    assert reported == ["saving", "saving"]
    index = antumbra.ShadowIndex.load(path, scene, LIGHTS, resolution=64)
    assert index.saved_lights == ["loaded"] * 3
    points, ids, _ = points_on(*bumps, 300, seed=36)
    assert np.array_equal(index.occluded_on_faces(points, ids), made.occluded_on_faces(points, ids))


def test_trimesh_uses_ours_once_it_is_installed() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: nothing to install into")
    before = trimesh.creation.box()
    antumbra.ray.install()
    try:
        antumbra.ray.install()
        mesh = trimesh.creation.icosphere(subdivisions=2)
        assert isinstance(mesh.ray, antumbra.ray.RayMeshIntersector)
        assert not isinstance(before.ray, antumbra.ray.RayMeshIntersector)
        assert mesh.contains([[0, 0, 0], [0, 0, 2]]).tolist() == [True, False]
        assert isinstance(mesh.copy().ray, antumbra.ray.RayMeshIntersector)
    finally:
        antumbra.ray.uninstall()
    assert not isinstance(trimesh.creation.box().ray, antumbra.ray.RayMeshIntersector)


def test_errors_name_what_was_called_and_not_an_argument_of_another_method() -> None:
    scene = antumbra.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    index = antumbra.ShadowIndex(scene, antumbra.PointLight((5, 5, 5)))
    with pytest.raises(ValueError, match="on no surface: .*occluded_at answers for points of space") as caught:
        index.occluded_near([[3.0, 3.0, 3.0]])
    assert "on_surface" not in str(caught.value) and "tolerance=" in str(caught.value)
