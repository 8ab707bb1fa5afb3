"""What reaches points through glass."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import antumbra


@pytest.fixture
def scene(tmp_path: Path) -> antumbra.Scene:
    """A floor, and a pane at height 1 over its middle that lets half of red through, a quarter of green and an eighth of blue."""
    (tmp_path / "pane.mtl").write_text("newmtl red\nd 0.5\nTf 1 0.5 0.25\nnewmtl floor\nKd 1 1 1\n")
    (tmp_path / "pane.obj").write_text(
        "mtllib pane.mtl\n"
        "usemtl floor\nv -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nf 1 2 3 4\n"
        "usemtl red\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nf 5 6 7 8\n"
    )
    with pytest.warns(antumbra.AntumbraWarning, match="light through"):
        return antumbra.Scene.load(tmp_path / "pane.obj", up="z")


RED = (0.5, 0.25, 0.125)


@pytest.mark.parametrize("method", ["auto", "voxel", "bvh", "grid", "voxel-1990", "naive"])
def test_shares_of_colors(scene: antumbra.Scene, method: str) -> None:
    lights = [antumbra.PointLight((0, 0, 9)), antumbra.PointLight((0, 0, -9))]
    index = antumbra.ShadowIndex(scene, lights, method=method)  # type: ignore[arg-type]
    points = np.array([[0, 0, 0], [0.5, -0.25, 0], [5, 5, 0]], dtype=np.float32)
    found = index.transmittance(points, 0, on_surface=True)
    assert found.dtype == np.float64
    assert found.tolist() == [list(RED), list(RED), [1, 1, 1]]
    space = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 2.0]])
    both = index.transmittance(space)
    assert both.shape == (2, 2, 3)
    assert both[:, 0].tolist() == [list(RED), [1, 1, 1]]
    assert both[:, 1].tolist() == [[0, 0, 0]] * 2
    ids = np.array([0, 0, 2])
    with pytest.raises(ValueError, match="points"):
        index.transmittance(points, 0, ids)
    on = np.array([[0.5, -0.5, 0.0]])
    assert index.transmittance(on, 0, [0]).tolist() == [list(RED)]


def test_bad_questions(scene: antumbra.Scene) -> None:
    index = antumbra.ShadowIndex(scene, antumbra.PointLight((0, 0, 9)))
    with pytest.raises(ValueError, match="tolerance"):
        index.transmittance(np.zeros((1, 3)), tolerance=1.0)
    with pytest.raises(IndexError, match="lights is 1"):
        index.transmittance(np.full((1, 3), 0.5), 1)
    with pytest.raises(ValueError, match="shape"):
        index.transmittance(np.zeros(3))
    with pytest.warns(antumbra.AntumbraWarning, match="lie on surfaces"):
        index.transmittance(np.array([[x, 0.5, 0.0] for x in np.linspace(-5, 5, 50)]), 0)


def test_pictures_have_colored_shadows(scene: antumbra.Scene) -> None:
    # From below the pane onto its shadow.
    camera = antumbra.Camera((0, 0, 0.75), (0, 0, 0), up=(0, 1, 0), fov_degrees=40)
    light = antumbra.DirectionalLight((0, 0, 1))
    shots = [
        antumbra.render(scene, lights=light, camera=camera, size=(3, 3), colored_shadows=is_colored)
        for is_colored in (True, False)
    ]
    colored, plain = (shot.color[1, 1] for shot in shots)
    # Ambient light is the same in both.
    np.testing.assert_allclose(plain - colored, 1 - np.array(RED), rtol=1e-6)
