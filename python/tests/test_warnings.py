"""What may not be what the caller meant is reported once, at the caller's line."""

from __future__ import annotations

import subprocess
import sys
import warnings
from pathlib import Path

import antumbra
import numpy as np
import pytest


def test_each_warning_of_a_reader_is_told_once_at_the_callers_line(tmp_path: Path) -> None:
    path = tmp_path / "scene.nff"
    path.write_text("s 0 0 0 1\ns 0 0 0 0\n")
    with warnings.catch_warnings(record=True) as reported:
        warnings.simplefilter("always")
        scene = antumbra.Scene.load(path)
    assert [str(warning.message) for warning in reported] == scene.warnings and len(reported) >= 2
    assert all(warning.category is antumbra.AntumbraWarning for warning in reported)
    assert all(warning.filename == __file__ for warning in reported)
    assert issubclass(antumbra.AntumbraWarning, UserWarning)


def test_a_sun_is_where_the_compass_says() -> None:
    """North is +y and east +x with z up, north is -z and east +x with y up."""
    sun = antumbra.DirectionalLight.sun
    for up, north in (("z", (0, 1, 0)), ("y", (0, 0, -1))):
        assert np.allclose(sun(0, 0, up=up).direction, north)  # type: ignore[arg-type]
        assert np.allclose(sun(90, 0, up=up).direction, (1, 0, 0))  # type: ignore[arg-type]
        assert np.allclose(sun(180, 0, up=up).direction, -np.array(north))  # type: ignore[arg-type]
        assert np.allclose(sun(33, 90, up=up).direction, (0, 0, 1) if up == "z" else (0, 1, 0))  # type: ignore[arg-type]


def test_a_sun_below_the_horizon_is_told() -> None:
    with pytest.warns(antumbra.AntumbraWarning, match="30 degrees below the horizon") as reported:
        light = antumbra.DirectionalLight.sun(10, -30)
    assert light.direction[2] == pytest.approx(-0.5) and reported[0].filename == __file__
    for azimuth, elevation, up in ((0, 91, "z"), (4000, 0, "z"), (0, float("nan"), "z"), (0, 0, "x")):
        with pytest.raises(ValueError, match="expected"):
            antumbra.DirectionalLight.sun(azimuth, elevation, up=up)  # type: ignore[arg-type]


def test_the_docstring_of_ray_is_true() -> None:
    """`import antumbra` is enough for `antumbra.ray`."""
    pytest.importorskip("trimesh", reason="trimesh is not installed: antumbra.ray cannot be imported")
    code = """
import antumbra, trimesh
mesh = trimesh.creation.box()
mesh.ray = antumbra.ray.RayMeshIntersector(mesh)
assert mesh.ray.intersects_any([[0, 0, 5]], [[0, 0, -1]]).all()
"""
    subprocess.run([sys.executable, "-c", code], check=True, timeout=120)
    with pytest.raises(AttributeError, match="no attribute 'rays'"):
        antumbra.rays  # type: ignore[attr-defined]


def test_a_point_of_1e300_is_named_in_few_characters() -> None:
    scene = antumbra.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    index = antumbra.ShadowIndex(scene, [antumbra.PointLight((5, 5, 5))])
    with pytest.raises(ValueError, match=r"points\[0\] is \(1e300, 0.5, -1e-300\)"):
        index.occluded([[1e300, 0.5, -1e-300]])
    with pytest.raises(ValueError, match=r"vertices\[1\] is \(0, 1e300, 0\)"):
        antumbra.Scene.from_arrays([[0, 0, 0], [0, 1e300, 0], [1, 0, 0]], [[0, 1, 2]])
