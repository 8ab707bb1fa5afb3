"""Reliefs that are no geometry, in pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import antumbra


@pytest.fixture(scope="module")
def scene() -> antumbra.Scene:
    """A square over a floor."""

    def square(half: float, z: float) -> list[list[float]]:
        return [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]

    corners = np.array(square(8, 0) + square(1, 2))
    return antumbra.Scene.from_arrays(corners, np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]))


def shot(scene: antumbra.Scene, **named: Any) -> antumbra.Picture:
    light = antumbra.DirectionalLight((0.3, 0.2, 1.0))
    camera = antumbra.Camera((0.5, 4.0, 6.0), (0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0))
    return antumbra.render(scene, lights=light, camera=camera, size=(64, 48), **named)


def test_a_relief_moves_the_border_of_a_shadow_and_turns_light(scene: antumbra.Scene) -> None:
    smooth = shot(scene)
    assert smooth.counts["on_bumps"] == smooth.counts["perturbed"] == 0
    for bumps in [("noise", 0.3, 0.5), ("ripples", 0.3, 0.5)]:
        pictures = [shot(scene, bumps=bumps, method=method) for method in ("naive", "voxel-1990", "auto", "bvh")]
        first, by_values = pictures[:2]
        assert (first.shadow != smooth.shadow).any() and (first.color != smooth.color).any()
        assert all((picture.color == first.color).all() for picture in pictures)
        assert first.counts["perturbed"] == first.counts["on_bumps"] > by_values.counts["perturbed"] > 0
    # The scene's own, of which there is none.
    assert (shot(scene, bumps=False).color == smooth.color).all()


ODD = [("noise", 0.1), ("noise", "x", 1.0), 3, ("bricks", 0.1, 1.0), ("noise", 0.0, 1.0), ("noise", 1.0, float("nan"))]


@pytest.mark.parametrize("bumps", ODD)
def test_odd_reliefs_are_refused(scene: antumbra.Scene, bumps: Any) -> None:
    with pytest.raises(ValueError, match="bumps"):
        shot(scene, bumps=bumps)
