"""Which suns are seen: bits against the rule in rational numbers, and what callers may give."""

from __future__ import annotations

import datetime
import tracemalloc
from fractions import Fraction
from typing import Any

import antumbra
import antumbra.sun
import numpy as np
import numpy.typing as npt
import pytest
from antumbra.sun import _bits
from conftest import points_on
from exact import cross, distance, dot, exact, minus

pytestmark = pytest.mark.filterwarnings("ignore:points.*:antumbra.AntumbraWarning")


def half_sphere(count: int, seed: int) -> npt.NDArray[np.float64]:
    """Returns directions above the horizon."""
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 1e-3
    return directions


PYRAMID = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 2]], dtype=float)
SIDES = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])


def test_the_shadow_of_a_pyramid_is_that_of_rational_numbers() -> None:
    """Suns in a grid of small numbers go through edges and the tip, where signs are zero."""
    suns = np.array([(x, y, 1) for x in (-2, -1, -0.5, 0, 0.5, 1, 2) for y in (-2, -1, 0, 1, 2)], dtype=float)
    points = np.array([(x, y, 0) for x in (-3, -1.5, 0, 1.5, 3) for y in (-3, -2, -1.5, 2, 3)], dtype=float)
    scene = antumbra.Scene.from_arrays(PYRAMID, SIDES)
    seen = antumbra.sun.sun_visibility(scene, points, normals=np.broadcast_to((0.0, 0.0, 2.0), points.shape), suns=suns)
    expected = np.array([
        [all(distance(point, sun, PYRAMID[face]) is None for face in SIDES) for sun in suns] for point in points
    ])
    assert np.array_equal(seen, expected)
    assert expected.any() and not expected.all()


def test_bits_are_those_of_shadow_queries_and_of_the_side(bumps: Any, scene: antumbra.Scene) -> None:
    points, ids, _ = points_on(*bumps, 300, seed=5)
    suns = half_sphere(150, 6)
    index = antumbra.ShadowIndex(scene, [antumbra.DirectionalLight(sun) for sun in suns])
    open_ways = ~index.occluded_on_faces(points, ids)
    vertices, faces = bumps
    corners = [[exact(vertices[corner]) for corner in face] for face in faces[ids]]
    normals = [cross(minus(b, a), minus(c, a)) for a, b, c in corners]
    front = np.array([[dot(normal, exact(sun)) > 0 for sun in suns] for normal in normals])
    for threads in (1, 3):
        seen = antumbra.sun.sun_visibility(scene, points, ids, suns=suns, threads=threads)
        assert seen.dtype == np.bool_ and np.array_equal(seen, open_ways & front)
    back = antumbra.sun.sun_visibility(index, points, ids, suns=suns, side="back")
    assert np.array_equal(back, open_ways & ~front)
    both = antumbra.sun.sun_visibility(index, points, ids, suns=suns, side="both")
    assert np.array_equal(both, open_ways)
    bits = antumbra.sun.sun_visibility(index, points, ids, suns=suns, packed=True)
    assert np.array_equal(bits, np.packbits(open_ways & front, axis=1, bitorder="little"))


def test_points_with_normals_see_nothing_behind_themselves(bumps: Any, scene: antumbra.Scene) -> None:
    points, _, normals = points_on(*bumps, 200, seed=7)
    points = points + 1e-3 * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    suns = half_sphere(70, 8)
    index = antumbra.ShadowIndex(scene, [antumbra.DirectionalLight(sun) for sun in suns])
    seen = antumbra.sun.sun_visibility(index, points, normals=normals, suns=suns)
    assert np.array_equal(seen, ~index.occluded_at(points, normals=normals))
    free = antumbra.sun.sun_visibility(index, points, suns=suns)
    assert np.array_equal(free, ~index.occluded_at(points))


def test_a_sun_in_the_plane_of_a_sensor_is_not_seen() -> None:
    wall = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1]], dtype=float)
    scene = antumbra.Scene.from_arrays(wall, [[0, 1, 2]])
    suns = np.array([[1, 0, 1], [1, -1e-300, 1], [1, 1e-300, 1]])
    front = antumbra.sun.sun_visibility(scene, [[0.5, 0, 0.25]], [0], suns=suns)
    back = antumbra.sun.sun_visibility(scene, [[0.5, 0, 0.25]], [0], suns=suns, side="back")
    assert front.tolist() == [[False, True, False]] and back.tolist() == [[False, False, True]]


def test_sensors_in_solids_and_on_edges_have_answers() -> None:
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    box = trimesh.creation.box()
    scene = antumbra.Scene.from_trimesh(box)
    suns = half_sphere(100, 3)
    inside = antumbra.sun.sun_visibility(scene, [[0, 0, 0], [0.1, 0.2, 0.4]], suns=suns)
    assert not inside.any()
    # A corner of the box, as a point of a face of its top: nothing of a convex solid is before it.
    top = int(np.flatnonzero(box.face_normals[:, 2] > 0.5)[0])
    corner = box.triangles[top][0]
    assert antumbra.sun.sun_visibility(scene, [corner], [top], suns=suns).all()
    # The same corner on a side face sees what is on the face's side.
    side = int(np.flatnonzero((box.face_normals[:, 0] > 0.5) & (box.triangles == box.triangles[top][0]).all(2).any(1))[0]) if (
        corner[0] > 0
    ) else int(np.flatnonzero((box.face_normals[:, 0] < -0.5) & (box.triangles == box.triangles[top][0]).all(2).any(1))[0])
    seen = antumbra.sun.sun_visibility(scene, [corner], [side], suns=suns)
    assert np.array_equal(seen[0], suns[:, 0] * np.sign(corner[0]) > 0)


def test_angles_are_those_of_sun(scene: antumbra.Scene) -> None:
    azimuths, elevations = np.linspace(0, 350, 36), np.linspace(0.5, 90, 36)
    for up in ("z", "y"):
        suns = antumbra.sun.Suns.of((azimuths, elevations), up=up)
        expected = [antumbra.Sun(a, e, up=up).direction for a, e in zip(azimuths, elevations)]
        assert np.array_equal(suns.directions, expected)
    turned = antumbra.sun.Suns.of((azimuths, elevations), north=30.0)
    # Thirty degrees clockwise from +y is north, so a sun in the north stands there.
    assert np.allclose(turned.directions[0], antumbra.Sun(30.0, 0.5).direction)


def test_suns_of_the_night_are_left_out_and_counted(scene: antumbra.Scene) -> None:
    elevations = np.array([-10.0, 0.0, 5.0, 30.0, -0.0, 1e-9])
    suns = antumbra.sun.Suns.of((np.full(6, 90.0), elevations))
    assert suns.rows.tolist() == [2, 3, 5] and suns.count == 6 and suns.below_horizon == 3 and len(suns) == 3
    directions = np.array([[0, 0, 1.0], [1, 0, 0], [1, 0, -1], [1, 0, 1e-300]])
    assert antumbra.sun.Suns.of(directions).rows.tolist() == [0, 3]
    assert antumbra.sun.sun_visibility(scene, [[9, 9, 9]], suns=directions).shape == (1, 2)
    with pytest.raises(ValueError, match="none of 2 is above the horizon"):
        antumbra.sun.Suns.of(([0.0, 0.0], [-1.0, -2.0]))


def test_what_is_no_sun_is_refused_by_name() -> None:
    of = antumbra.sun.Suns.of
    times = np.array(["2025-06-01T10", "2025-06-01T11", "2025-06-01T12"], dtype="datetime64[h]")
    with pytest.raises(ValueError, match=r"suns: row 1 \(2025-06-01T11\) has no position \(NaN\)"):
        of(([1.0, np.nan, 2.0], [1.0, 2.0, 3.0]), times=times)
    with pytest.raises(ValueError, match=r"row 0, 1, 2 and 1 more has no position"):
        of(([np.nan] * 4, [1.0] * 4))
    with pytest.raises(ValueError, match="row 2 has an elevation beyond"):
        of(([0.0] * 3, [0.0, 90.0, 90.5]))
    with pytest.raises(ValueError, match="row 0 has an azimuth beyond"):
        of(([np.inf], [1.0]))
    with pytest.raises(ValueError, match=r"elevations: expected shape \(2,\)"):
        of(([0.0, 1.0], [1.0]))
    with pytest.raises(ValueError, match="times: expected 2, one for each sun, found 3"):
        of(([0.0, 1.0], [1.0, 2.0]), times=times)
    with pytest.raises(TypeError, match="expected a table with azimuth and elevation"):
        of([1.0, 2.0])
    with pytest.raises(ValueError, match="row 1 is zero"):
        of([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match=r"row 1 has no direction \(NaN\)"):
        of([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]])
    with pytest.raises(ValueError, match=r"times\[1\] is missing"):
        of(([0.0, 1.0], [1.0, 2.0]), times=np.array(["2025-01-01", "NaT"], dtype="datetime64[s]"))
    with pytest.raises(TypeError, match="expected times of pandas"):
        of(([0.0, 1.0], [1.0, 2.0]), times=["10:00", "11:00"])
    with pytest.raises(ValueError, match=r"times\[1\] is .*expected a time zone for all"):
        of(
            ([0.0, 1.0], [1.0, 2.0]),
            times=[datetime.datetime(2025, 1, 1, tzinfo=datetime.timezone.utc), datetime.datetime(2025, 1, 1, 1)],
        )
    with pytest.raises(ValueError, match='up is "x"'.replace('"', "'")):
        of(([0.0], [1.0]), up="x")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="north is nan"):
        of(([0.0], [1.0]), north=float("nan"))
    with pytest.raises(ValueError, match="refraction: only a table"):
        of(([0.0], [1.0]), refraction=True)


def test_what_is_no_sensor_is_refused_by_row(bumps: Any, scene: antumbra.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    points, ids, _ = points_on(*bumps, 50, seed=9)
    sun = np.array([[0.0, 0.0, 1.0]])
    ask = antumbra.sun.sun_visibility
    # Rows are those of all sensors, whatever the chunks are.
    monkeypatch.setattr(_bits, "CHUNK_BYTES", 100)
    bad = points.copy()
    bad[37, 1] = np.nan
    with pytest.raises(ValueError, match=r"points\[37\]"):
        ask(scene, bad, ids, suns=sun)
    off = points.copy()
    off[41] += 1.0
    with pytest.raises(ValueError, match=r"points\[41\]"):
        ask(scene, off, ids, suns=sun)
    with pytest.raises(IndexError, match=r"face_ids\[1\] is 1600"):
        ask(scene, points[:2], [0, 1600], suns=sun)
    with pytest.raises(ValueError, match="give them without normals"):
        ask(scene, points, ids, normals=points, suns=sun)
    with pytest.raises(ValueError, match="only points with face_ids have sides"):
        ask(scene, points, suns=sun, side="both")
    with pytest.raises(ValueError, match="suns are made already"):
        ask(scene, points, ids, suns=antumbra.sun.Suns.of(sun), north=3.0)
    assert ask(scene, np.empty((0, 3)), suns=sun).shape == (0, 1)


def test_points_of_space_that_lie_on_surfaces_are_reported(bumps: Any, scene: antumbra.Scene) -> None:
    points, _, normals = points_on(*bumps, 500, seed=10)
    with pytest.warns(antumbra.AntumbraWarning, match="lie on surfaces.*Give face_ids"):
        antumbra.sun.sun_visibility(scene, points, normals=normals, suns=np.array([[0.0, 0.0, 1.0]]))


def test_chunks_change_no_answer(bumps: Any, scene: antumbra.Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    points, ids, _ = points_on(*bumps, 333, seed=11)
    suns = half_sphere(97, 12)
    whole = antumbra.sun.sun_visibility(scene, points, ids, suns=suns)
    steps: list[tuple[str, int, int]] = []
    monkeypatch.setattr(_bits, "CHUNK_BYTES", 4000)
    in_parts = antumbra.sun.sun_visibility(
        scene, points, ids, suns=suns, progress=lambda stage, done, count: steps.append((stage, done, count))
    )
    assert np.array_equal(in_parts, whole)
    assert len(steps) > 2 and steps[-1] == ("suns", 333, 333)


def test_memory_beside_the_packed_result_is_bounded() -> None:
    """A chunk's size does not depend on the number of sensors, and a million of them fit."""
    for unpacked in (False, True):
        lengths = [end - begin for begin, end in _bits.chunks(1_000_000, 4376, unpacked=unpacked)]
        assert sum(lengths) == 1_000_000
        words, rows = max(lengths) * 8 * -(-4376 // 64), max(lengths) * _bits.width(4376)
        # What is unpacked, its transposed copy, and a table of weights of each four suns.
        beside = max(lengths) * 4376 * (2 if unpacked else 0) + 2 * 547 * 16 * 4 * 8
        assert words + rows + beside <= 512 << 20
    square = np.array([[0, 0, 1], [9, 0, 1], [9, 9, 1]], dtype=float)
    scene = antumbra.Scene.from_arrays(square, [[0, 1, 2]])
    points = np.random.default_rng(1).random((150_000, 3)).astype(np.float32)
    suns = half_sphere(1000, 2)
    index = antumbra.ShadowIndex(scene, [])
    tracemalloc.start()
    try:
        bits = antumbra.sun.sun_visibility(index, points, suns=suns, packed=True)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # NumPy's arrays are traced, the engine's words are not: these are the chunk's other half.
    assert peak - bits.nbytes <= _bits.CHUNK_BYTES + (8 << 20)


def test_tables_of_pvlib_are_taken_as_they_come(scene: antumbra.Scene) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: tables are not tested")
    pvlib = pytest.importorskip("pvlib", reason="pvlib is not installed: its tables are not tested")
    times = pandas.date_range("2025-06-21", "2025-06-22", freq="1h", tz="Europe/Berlin", inclusive="left")
    table = pvlib.solarposition.get_solarposition(times, 48.0, 9.0)
    suns = antumbra.sun.Suns.of(table)
    assert suns.elevation == "elevation" and suns.times is table.index
    is_up = table["elevation"].to_numpy() > 0
    assert np.array_equal(suns.rows, np.flatnonzero(is_up)) and suns.below_horizon == (~is_up).sum()
    zenith, azimuth = np.radians(table["zenith"][is_up]), np.radians(table["azimuth"][is_up])
    expected = np.stack([np.sin(zenith) * np.sin(azimuth), np.sin(zenith) * np.cos(azimuth), np.cos(zenith)], axis=-1)
    assert np.allclose(suns.directions, expected, atol=1e-12)
    lifted = antumbra.sun.Suns.of(table, refraction=True)
    assert lifted.elevation == "apparent_elevation"
    shared = np.isin(lifted.rows, suns.rows)
    assert (lifted.directions[shared, 2] > suns.directions[np.isin(suns.rows, lifted.rows), 2]).all()
    with pytest.raises(ValueError, match="expected a column elevation, found azimuth"):
        antumbra.sun.Suns.of(table[["azimuth"]])
    with pytest.raises(ValueError, match="refraction=True takes apparent_elevation"):
        antumbra.sun.Suns.of(table[["azimuth", "apparent_elevation"]])
    broken = table.copy()
    broken.loc[times[7], "azimuth"] = np.nan
    with pytest.raises(ValueError, match=r"suns: row 7 \(2025-06-21 07:00:00\+02:00\) has no position"):
        antumbra.sun.Suns.of(broken)


def test_answers_with_times_are_arrays_of_xarray(scene: antumbra.Scene, bumps: Any) -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: time zones are not tested")
    xarray = pytest.importorskip("xarray", reason="xarray is not installed: its arrays are not tested")
    points, ids, _ = points_on(*bumps, 20, seed=13)
    # The hour from two to three is missing on this day.
    times = pandas.date_range("2025-03-30 00:00", periods=20, freq="1h", tz="Europe/Berlin")
    angles = (np.linspace(0, 340, 20), 40 * np.sin(np.linspace(-1.5, 4.5, 20)))
    found = antumbra.sun.sun_visibility(scene, points, ids, suns=angles, times=times)
    assert isinstance(found, xarray.DataArray) and found.dims == ("sensor", "time") and found.dtype == bool
    is_up = angles[1] > 0
    assert found.indexes["time"].equals(times[is_up]) and found.indexes["time"].tz is not None
    assert found["row"].values.tolist() == np.flatnonzero(is_up).tolist()
    assert found.attrs["suns"] == 20 and found.attrs["suns_below_horizon"] == (~is_up).sum()
    plain = antumbra.sun.sun_visibility(scene, points, ids, suns=angles, times=times, as_xarray=False)
    assert type(plain) is np.ndarray and np.array_equal(plain, found.values)
    assert type(antumbra.sun.sun_visibility(scene, points, ids, suns=angles)) is np.ndarray
    without = antumbra.sun.sun_visibility(scene, points, ids, suns=angles, as_xarray=True)
    assert without.dims == ("sensor", "sun") and "time" not in without.coords
    series = antumbra.sun.sun_visibility(scene, points, ids, suns=angles, times=pandas.Series(times))
    assert series.indexes["time"].equals(times[is_up])
    listed = antumbra.sun.sun_visibility(scene, points, ids, suns=angles, times=[t.to_pydatetime() for t in times])
    assert listed.shape == found.shape
    with pytest.raises(ValueError, match="packed: an array of xarray"):
        antumbra.sun.sun_visibility(scene, points, ids, suns=angles, packed=True, as_xarray=True)  # type: ignore[call-overload]


def test_up_is_that_of_the_scene() -> None:
    triangle = np.array([[0, 5, 0], [1, 5, 0], [0, 5, 1]], dtype=float)
    scene = antumbra.Scene.from_arrays(triangle, [[0, 1, 2]], up=(0, 1, 0))
    above = (np.array([0.0]), np.array([90.0]))
    assert antumbra.sun.sun_visibility(scene, [[0.2, 0, 0.2]], suns=above).tolist() == [[False]]
    assert antumbra.sun.sun_visibility(scene, [[0.2, 0, 0.2]], suns=above, up="z").tolist() == [[True]]
    slanted = antumbra.Scene.from_arrays(triangle, [[0, 1, 2]], up=(0, 1, 1))
    with pytest.raises(ValueError, match="which is no axis"):
        antumbra.sun.sun_visibility(slanted, [[0.2, 0, 0.2]], suns=above)


def test_weighted_sums_are_those_of_rational_numbers() -> None:
    random = np.random.default_rng(4)
    for suns, columns in ((1, 1), (7, 3), (8, 4), (13, 5), (200, 9)):
        lit = random.random((31, suns)) < 0.5
        # Dyadic numbers add up without rounding.
        weights = random.integers(-1000, 1000, size=(suns, columns)) / 64
        sums = _bits.weighted_sums(_bits.packed(lit), weights, 2)
        expected = [[sum(Fraction(w) for w in column[row]) for column in weights.T] for row in lit]
        assert [[Fraction(number) for number in line] for line in sums.tolist()] == expected
