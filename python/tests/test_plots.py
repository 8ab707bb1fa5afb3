"""Plots of sensors: what is drawn is read back from what draws it."""

from __future__ import annotations

import datetime
import importlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import antumbra
import antumbra.sun
import numpy as np
import pytest
from conftest import skip_for_want_of

HOURS = np.arange(72)
TIMES = np.datetime64("2025-06-20T00:30") + HOURS * np.timedelta64(1, "h")
# East at six, south at noon; up from six to eighteen.
SUNS = (15.0 * (HOURS % 24 + 0.5), np.where((HOURS % 24 >= 6) & (HOURS % 24 < 18), 30.0, -30.0))


@pytest.fixture
def pyplot() -> Iterator[Any]:
    pytest.importorskip("matplotlib", reason="matplotlib is not installed: charts are not tested")
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    yield pyplot
    pyplot.close("all")


def bits(suns: antumbra.sun.Suns) -> Any:
    """Four sensors: one sees all suns, one the mornings, one the second day, one nothing."""
    hours = HOURS[suns.rows]
    return np.stack([hours >= 0, hours % 24 < 12, hours // 24 == 1, hours < 0])


def test_a_histogram_has_a_share_for_each_range_of_hours(pyplot: Any) -> None:
    hours = np.array([0.0, 1.0, 9.0, 10.0])
    ax = antumbra.sun.plot_hours(hours, bins=5)
    assert [bar.get_height() for bar in ax.patches] == [0.5, 0.0, 0.0, 0.0, 0.5]
    assert ax.patches[0].get_x() == 0.0 and ax.patches[-1].get_x() + ax.patches[-1].get_width() == 10.0
    assert ax.get_xlabel() == "hours of sun" and ax.get_ylabel() == "share of sensors"
    # By area, on axes of the caller's own.
    _, own = pyplot.subplots()
    same = antumbra.sun.plot_hours(hours, weights=[1, 0, 3, 4], bins=2, ax=own)
    assert same is own and [bar.get_height() for bar in own.patches] == [0.125, 0.875]
    # No sensor has any hour.
    dark = antumbra.sun.plot_hours(np.zeros(3), bins=2)
    assert [bar.get_height() for bar in dark.patches] == [1.0, 0.0]


def test_a_histogram_of_a_study_ends_at_the_hours_of_all_suns(pyplot: Any) -> None:
    scene = antumbra.Scene.from_arrays(np.empty((0, 3)), np.empty((0, 3), int))
    normals = [[0, 0, 1], [1, 0, 0], [0, 0, -1]]
    found = antumbra.sun.sun_hours(scene, np.zeros((3, 3)), normals=normals, suns=SUNS, times=TIMES)
    assert found.hours.tolist() == [36.0, 18.0, 0.0] and found.most == 36.0
    ax = antumbra.sun.plot_hours(found, bins=4)
    assert np.allclose([bar.get_height() for bar in ax.patches], [1 / 3, 0, 1 / 3, 1 / 3])
    assert ax.patches[-1].get_x() + ax.patches[-1].get_width() == 36.0


def test_a_day_has_a_point_for_each_row_with_the_share_that_is_lit(pyplot: Any) -> None:
    suns = antumbra.sun.Suns.of(SUNS, times=TIMES)
    lit = bits(suns)
    packed = np.packbits(lit, axis=1, bitorder="little")
    for day, others in (("2025-06-20", 0), (datetime.date(2025, 6, 21), 1), (np.datetime64("2025-06-22"), 0)):
        for answers in (lit, packed):
            ax = antumbra.sun.plot_day(answers, suns, day)
            hours, shares = ax.lines[0].get_data()
            assert hours.tolist() == (np.arange(24) + 0.5).tolist()
            is_up = (hours > 6) & (hours < 18)
            expected = is_up * (1 + (hours < 12) + others) / 4
            assert np.allclose(shares, expected) and shares.max() > 0.4
            assert ax.get_xlabel() == f"hour of {day}"
    heavy = antumbra.sun.plot_day(lit, suns, "2025-06-21", weights=[0.0, 0.0, 2.0, 2.0])
    shares = heavy.lines[0].get_ydata()
    assert set(shares.tolist()) == {0.0, 0.5} and heavy.get_ylabel() == "share of weights in the sun"


def test_a_day_is_that_of_the_times_own_zone(pyplot: Any) -> None:
    zone = datetime.timezone(datetime.timedelta(hours=2))
    times = [datetime.datetime(2025, 6, 20, 22, 30, tzinfo=zone) + datetime.timedelta(hours=n) for n in range(4)]
    suns = antumbra.sun.Suns.of((np.full(4, 90.0), np.full(4, 10.0)), times=times)
    ax = antumbra.sun.plot_day(np.array([[True, True, False, True]]), suns, "2025-06-21")
    assert ax.lines[0].get_xdata().tolist() == [0.5, 1.5] and ax.lines[0].get_ydata().tolist() == [0.0, 1.0]


def test_what_cannot_be_charted_is_named(pyplot: Any) -> None:
    suns = antumbra.sun.Suns.of(SUNS, times=TIMES)
    lit = bits(suns)
    for message, ask in (
        ("day is 2025-07-01: expected one of the times, which are from 2025-06-20 to 2025-06-22", ("2025-07-01", {})),
        ("day is 'noon': expected a date", ("noon", {})),
        (r"weights: expected numbers, shape \(4,\)", ("2025-06-21", {"weights": [1.0]})),
        (r"weights\[1\] is -1", ("2025-06-21", {"weights": [1, -1, 1, 1]})),
        ("expected a finite sum above zero", ("2025-06-21", {"weights": np.zeros(4)})),
    ):
        day, how = ask
        with pytest.raises(ValueError, match=message):
            antumbra.sun.plot_day(lit, suns, day, **how)
    with pytest.raises(ValueError, match="bits: expected shape"):
        antumbra.sun.plot_day(lit[:, :5], suns, "2025-06-21")
    with pytest.raises(ValueError, match="expected times, as there are no days"):
        antumbra.sun.plot_day(lit, antumbra.sun.Suns.of(SUNS), "2025-06-21")
    with pytest.raises(TypeError, match="suns: expected Suns"):
        antumbra.sun.plot_day(lit, SUNS, "2025-06-21")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"hours\[1\] is nan"):
        antumbra.sun.plot_hours([1.0, np.nan])
    with pytest.raises(ValueError, match=r"hours: expected numbers, shape \(n,\), n not zero"):
        antumbra.sun.plot_hours([])
    with pytest.raises(ValueError, match="bins is 0"):
        antumbra.sun.plot_hours([1.0], bins=0)


@pytest.mark.parametrize(("package", "extra"), [("matplotlib.pyplot", "matplotlib"), ("pyvista", "pyvista")])
def test_a_package_that_is_missing_is_named_with_its_extra(
    package: str, extra: str, monkeypatch: pytest.MonkeyPatch, scene: antumbra.Scene
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=rf'package {extra}: pip install "antumbra\[plot\]"'):
        if extra == "matplotlib":
            antumbra.sun.plot_hours([1.0])
        else:
            antumbra.sun.plot_mesh(scene, [[0, 0, 0]], values=[1.0])


ROOF = antumbra.Scene.from_arrays([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [5, 5, 5]], [[0, 1, 2], [0, 2, 3], [2, 3, 4]])
SENSORS = np.array([[1.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.5, 0.0]])
FACES = [0, 0, 1]


@pytest.fixture
def pyvista() -> Any:
    return pytest.importorskip("pyvista", reason="PyVista is not installed: plots of meshes are not tested")


def test_sensors_lie_on_their_scene_with_their_values(pyvista: Any) -> None:
    plotter = antumbra.sun.plot_mesh(ROOF, SENSORS, FACES, values=[3, 9, 4], label="hours", limits=(0, 12))
    surfaces, sensors = (plotter.actors[name].mapper for name in ("scene", "sensors"))
    assert np.array_equal(surfaces.dataset.points.reshape(-1, 3, 3), ROOF.triangles())
    assert surfaces.dataset.regular_faces.tolist() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    assert np.array_equal(sensors.dataset.points, SENSORS)
    assert sensors.dataset.point_data["hours"].tolist() == [3.0, 9.0, 4.0]
    assert tuple(sensors.scalar_range) == (0.0, 12.0)
    up = plotter.camera.up
    assert up[2] > 0 and plotter.camera.position[2] > plotter.camera.focal_point[2]
    plotter.close()


def test_faces_have_the_mean_of_their_sensors(pyvista: Any) -> None:
    index = antumbra.ShadowIndex(ROOF, [])
    plotter = antumbra.sun.plot_mesh(index, SENSORS, FACES, values=np.array([3.0, 9.0, 4.0]), on="faces")
    means = plotter.actors["scene"].mapper.dataset.cell_data["hours of sun"]
    assert means[:2].tolist() == [6.0, 4.0] and np.isnan(means[2]) and "sensors" not in plotter.actors
    assert tuple(plotter.actors["scene"].mapper.scalar_range) == (4.0, 6.0)
    plotter.close()


# Without OpenGL, VTK ends the process that renders: others render.
PROBE = "import pyvista; pyvista.Plotter(off_screen=True).screenshot(None, return_img=True)"
PICTURE = """
import antumbra
import antumbra.sun
import numpy as np

corners, faces = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [5, 5, 5]], [[0, 1, 2], [0, 2, 3], [2, 3, 4]]
sensors = [[1.5, 0.5, 0.0], [1.0, 0.5, 0.0], [0.5, 1.5, 0.0]]
how = {"values": [0.0, 1.0, 2.0], "on": "faces", "color_map": "viridis", "size": (200, 150)}
plotter = antumbra.sun.plot_mesh((corners, faces), sensors, [0, 0, 1], **how)
picture = plotter.screenshot("sensors.png", return_img=True)
assert picture.shape == (150, 200, 3), picture.shape
# A background, grey, and two colors.
assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 3 and picture.std() > 1.0
"""


def test_a_picture_of_sensors_shows_them(pyvista: Any, tmp_path: Path) -> None:
    probe = subprocess.run([sys.executable, "-c", PROBE], capture_output=True, text=True, timeout=300)
    if probe.returncode != 0:
        skip_for_want_of("opengl", f"VTK cannot render here: {probe.stderr[-300:]}")
    drawn = subprocess.run([sys.executable, "-c", PICTURE], cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert drawn.returncode == 0, drawn.stdout + drawn.stderr
    assert (tmp_path / "sensors.png").stat().st_size > 1000


def test_curved_surfaces_are_left_out_aloud(pyvista: Any, tmp_path: Path) -> None:
    file = tmp_path / "ball.nff"
    file.write_text("v\nfrom 0 -6 2\nat 0 0 0\nup 0 0 1\nangle 40\nresolution 8 8\nl 3 -2 6\nf 1 1 1 1 0 0 0 1\np 3\n0 0 0\n1 0 0\n0 1 0\ns 0 0 1 1\n")
    scene = antumbra.Scene.load(file)
    with pytest.warns(antumbra.AntumbraWarning, match="1 curved surfaces are left out"):
        plotter = antumbra.sun.plot_mesh(scene, [[0.2, 0.2, 0.0]], [0], values=[1.0], on="faces")
    assert plotter.actors["scene"].mapper.dataset.n_cells == 1
    plotter.close()


def test_what_cannot_be_drawn_is_named(pyvista: Any) -> None:
    for message, how in (
        (r"values: expected numbers, shape \(3,\)", {"values": [1.0]}),
        (r"values\[2\] is nan", {"values": [1.0, 2.0, np.nan]}),
        ("on is 'cells'", {"values": [1, 2, 3], "on": "cells"}),
        ("face_ids: expected them", {"values": [1, 2, 3], "on": "faces", "face_ids": None}),
    ):
        asked: dict[str, Any] = {"face_ids": FACES, **how}
        with pytest.raises(ValueError, match=message):
            antumbra.sun.plot_mesh(ROOF, SENSORS, **asked)
    with pytest.raises(ValueError, match="points: expected sensors, found none"):
        antumbra.sun.plot_mesh(ROOF, np.empty((0, 3)), values=[])
