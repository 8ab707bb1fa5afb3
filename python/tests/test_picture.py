"""Pictures: those of the program, as arrays."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import antumbra
import numpy as np
import pytest

NFF = """v
from 0 -6 2
at 0 0 0.5
up 0 0 1
angle 40
resolution 48 32
l 3 -2 6
l -4 -3 5
f 0.8 0.6 0.4 0.8 0.2 0 0 1
p 4
-4 -4 0
4 -4 0
4 4 0
-4 4 0
s 0 0 1 1
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("picture") / "ball.nff"
    path.write_text(NFF)
    return path


def test_a_picture_has_the_bytes_of_the_program_s(file: Path, tmp_path: Path) -> None:
    picture = antumbra.render(antumbra.Scene.load(file), samples=2)
    assert picture.colour.shape == (32, 48, 3) and picture.colour.dtype == np.float32
    picture.save_png(tmp_path / "ours.png")
    program = [sys.executable, "-m", "antumbra", "render", str(file), "--spp", "2", "-o", str(tmp_path / "program.png")]
    subprocess.run(program, check=True, timeout=120)
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "program.png").read_bytes()


def test_a_picture_replaces_neither_its_scene_nor_anything_but_a_png(file: Path, tmp_path: Path) -> None:
    scene = tmp_path / "ball.nff"
    scene.write_text(NFF)
    picture = antumbra.render(antumbra.Scene.load(scene), samples=1)
    for name in ("ball.nff", "picture.jpg", "picture"):
        with pytest.raises(ValueError, match="ends in .png"):
            picture.save_png(tmp_path / name)
    # The scene by another name.
    os.link(scene, tmp_path / "alias.png")
    with pytest.raises(ValueError, match="was read from this file"):
        picture.save_png(tmp_path / "alias.png")
    assert scene.read_text() == NFF
    assert sorted(path.name for path in tmp_path.iterdir()) == ["alias.png", "ball.nff"]


def test_layers_say_who_is_in_shadow_and_how_that_was_decided(file: Path) -> None:
    scene = antumbra.Scene.load(file)
    picture = antumbra.render(scene, samples=1)
    assert picture.shadow.shape == (2, 32, 48) and picture.shadow.dtype == np.float32
    assert len(picture.light_names) == len(set(picture.light_names)) == 2
    assert set(np.unique(picture.shadow)) == {0.0, 1.0}
    assert np.allclose(sum(picture.decided.values()), 1.0)
    assert picture.counts["primary"] == 32 * 48
    asked = picture.counts["queries"] - picture.counts["facing_away"] - picture.counts["out_of_cone"]
    parts = ("first_pass", "intermediate", "blocker_list", "rays")
    assert sum(picture.counts[part] for part in parts) == asked
    assert picture.stops == 0.0


def test_a_picture_depends_neither_on_method_nor_on_threads(file: Path) -> None:
    scene = antumbra.Scene.load(file)
    expected = antumbra.render(scene, method="naive", threads=1)
    for method in ("auto", "voxel", "bvh", "grid", "voxel-1990"):
        picture = antumbra.render(scene, method=method, threads=2)  # type: ignore[arg-type]
        assert np.array_equal(picture.colour, expected.colour)
        assert np.array_equal(picture.shadow, expected.shadow)


def test_what_is_not_given_is_chosen() -> None:
    scene = antumbra.Scene.from_arrays([[-1, -1, 0], [1, -1, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [0, 1, 3]])
    picture = antumbra.render(scene, size=(20, 10))
    assert picture.colour.shape == (10, 20, 3) and len(picture.shadow) == 1
    # Sky and surface.
    assert len(np.unique(picture.colour.reshape(-1, 3), axis=0)) > 1
    false_colours = antumbra.render(scene, size=(20, 10), show="occlusion")
    assert not np.array_equal(false_colours.colour, picture.colour)


def test_lights_and_camera_are_those_given(file: Path) -> None:
    scene = antumbra.Scene.load(file)
    above = antumbra.Camera(eye=(0, 0, 9), at=(0, 0, 0), up=(0, 1, 0), fov_degrees=50)
    lit = antumbra.render(scene, lights=[antumbra.PointLight((0, 0, 3), name="lamp")], camera=above, size=(21, 21))
    assert lit.light_names == ["lamp"]
    # The lit ball in the middle, its shadow around it, and beside the floor nothing.
    assert lit.shadow[0, 10, 10] == 1.0 and lit.shadow[0, 0, 0] == 1.0 and lit.shadow[0].min() == 0.0
    narrow = antumbra.SpotLight((0, 0, 8), (0, 0, -1), half_angle_degrees=1.0)
    spot = antumbra.render(scene, lights=[narrow], camera=above, size=(21, 21))
    assert spot.shadow[0, 10, 2] == 0.0 and spot.shadow[0, 10, 10] == 1.0
    dark = antumbra.render(scene, lights=[], camera=above, size=(21, 21), background=(0, 0, 0))
    assert dark.shadow.shape == (0, 21, 21)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"size": (0, 5)}, "size is 0: expected 1 to 16384"),
        ({"size": 5}, "size: expected width and height"),
        ({"samples": 0}, "samples is 0: expected 1 to 65536"),
        ({"show": "depth"}, "show is 'depth'"),
        ({"camera": antumbra.Camera((0, 0, 0), (0, 0, 0))}, "camera: "),
        ({"camera": antumbra.Camera((0, 0, 1), (0, np.nan, 0))}, "camera.at is (0.0, nan, 0.0)"),
    ],
)
def test_what_makes_no_picture_is_refused(file: Path, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError) as refused:
        antumbra.render(antumbra.Scene.load(file), **arguments)  # type: ignore[arg-type]
    assert message in str(refused.value)


def test_a_png_that_cannot_be_written_is_an_os_error(file: Path, tmp_path: Path) -> None:
    picture = antumbra.render(antumbra.Scene.load(file), size=(2, 2))
    with pytest.raises(OSError, match=r"missing.*a\.png"):
        picture.save_png(tmp_path / "missing" / "a.png")


def test_fog_is_the_program_s(file: Path, tmp_path: Path) -> None:
    scene = antumbra.Scene.load(file)
    antumbra.render(scene, fog=(0.05, 0.9, 0.3)).save_png(tmp_path / "ours.png")
    output = str(tmp_path / "program.png")
    program = [sys.executable, "-m", "antumbra", "render", str(file), "--fog", "0.05,0.9,0.3", "-o", output]
    subprocess.run(program, check=True, timeout=120)
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "program.png").read_bytes()
    clear, none = antumbra.render(scene), antumbra.render(scene, fog=0.0)
    assert np.array_equal(clear.color, none.color)
    thin = antumbra.render(scene, fog=0.05)
    assert clear.fog is None and clear.transmittance is None
    assert thin.fog is not None and thin.transmittance is not None
    assert thin.fog.shape == thin.color.shape and thin.fog.dtype == np.float32
    assert thin.transmittance.shape == thin.color.shape[:2]
    assert thin.fog.max() > 0 and 0 < thin.transmittance.min() < thin.transmittance.max() < 1
    thin.save_exr(tmp_path / "ours.exr")
    exr = (tmp_path / "ours.exr").read_bytes()
    assert b"transmittance" in exr and b"fog" in exr
    assert np.array_equal(thin.color, antumbra.render(scene, fog=[0.05, 1, 0]).color)
    assert not np.array_equal(thin.color, clear.color) and np.array_equal(thin.shadow, clear.shadow)


@pytest.mark.parametrize(
    ("fog", "message"),
    [
        (-1, "fog: the density is -1"),
        ((0.1, 2), "fog: the albedo is 2"),
        ((0.1, 1, 1), "fog: g is 1"),
        ((0.1, 1, 0, 0), "fog: expected a density"),
        ((), "fog: expected a density"),
        ([[0.1]], "fog: expected a density"),
    ],
)
def test_what_is_no_fog_is_refused(file: Path, fog: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        antumbra.render(antumbra.Scene.load(file), fog=fog)  # type: ignore[arg-type]
