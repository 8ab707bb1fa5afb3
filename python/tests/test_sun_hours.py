"""Hours of sun on scenes that are solved by hand, days and spans, shares of the sky, energy."""

from __future__ import annotations

import datetime
import math
from typing import Any

import antumbra
import antumbra.sun
import numpy as np
import numpy.typing as npt
import pytest
from antumbra.sun import _bits

LATITUDE = math.radians(48.0)
FAR = 2.0**20


def day_of_suns(declination: float, step_minutes: int = 10) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Returns directions of a day of true solar time, and their hour angles: x east, y north, z up."""
    minutes = np.arange(step_minutes / 2, 24 * 60, step_minutes)
    hour = (minutes / 60 - 12) * math.pi / 12
    sine, cosine = math.sin(declination), math.cos(declination)
    directions = np.stack(
        [
            -cosine * np.sin(hour),
            sine * math.cos(LATITUDE) - cosine * np.cos(hour) * math.sin(LATITUDE),
            cosine * np.cos(hour) * math.cos(LATITUDE) + sine * math.sin(LATITUDE),
        ],
        axis=-1,
    )
    return directions, hour


def rectangle(corners: Any) -> tuple[npt.NDArray[np.float64], list[list[int]]]:
    return np.array(corners, dtype=float), [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("declination", [0.0, math.radians(23.44), math.radians(-23.44)])
@pytest.mark.parametrize("distance", [1.0, 2.5, 4.0, 12.0])
def test_hours_behind_a_long_wall_are_exact_to_the_step(declination: float, distance: float) -> None:
    """A sensor lies north of a wall of height 3 that runs from east to west without an end."""
    height = 3.0
    scene = antumbra.Scene.from_arrays(*rectangle([(-FAR, 0, 0), (FAR, 0, 0), (FAR, 0, height), (-FAR, 0, height)]))
    suns, hour = day_of_suns(declination)
    found = antumbra.sun.sun_hours(scene, [[0, distance, 0]], normals=[[0, 0, 1]], suns=suns, step_hours=1 / 6)
    # The sun is over the wall where its height over its way south is more than height / distance. At the equinox that is the
    # cotangent of the latitude all day. Else it is so for cos(hour) * a > b.
    sine, cosine = math.sin(declination), math.cos(declination)
    a = cosine * (distance * math.cos(LATITUDE) - height * math.sin(LATITUDE))
    b = -sine * (height * math.cos(LATITUDE) + distance * math.sin(LATITUDE))
    is_over = np.cos(hour) * a > b
    is_up = cosine * np.cos(hour) * math.cos(LATITUDE) > -sine * math.sin(LATITUDE)
    is_in_the_south = cosine * np.cos(hour) * math.sin(LATITUDE) > sine * math.cos(LATITUDE)
    expected = is_up & (is_over | ~is_in_the_south)
    assert round(found.hours[0] * 6) == expected.sum() and abs(found.hours[0] * 6 - expected.sum()) < 1e-9
    assert abs(found.most * 6 - is_up.sum()) < 1e-9 and found.suns.below_horizon == (~is_up).sum()


@pytest.mark.parametrize("declination", [0.0, math.radians(23.44), math.radians(-23.44)])
@pytest.mark.parametrize("depth", [0.5, 1.0, 2.0])
def test_hours_below_an_overhang_are_exact_to_the_step(declination: float, depth: float) -> None:
    """A sensor lies on a wall that faces south, 1.5 below an overhang without an end."""
    below = 1.5
    wall = [(-FAR, 0, 0), (FAR, 0, 0), (FAR, 0, 9), (-FAR, 0, 9)]
    roof = [(-FAR, -depth, 3), (FAR, -depth, 3), (FAR, 0, 3), (-FAR, 0, 3)]
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    scene = antumbra.Scene.from_arrays(np.array(wall + roof, dtype=float), faces)
    suns, hour = day_of_suns(declination)
    found = antumbra.sun.sun_hours(scene, [[0.25, 0, 3 - below]], [0], suns=suns, step_hours=1 / 6)
    sine, cosine = math.sin(declination), math.cos(declination)
    # Height over way south is less than below / depth, and the sun is in the south.
    a = cosine * (depth * math.cos(LATITUDE) - below * math.sin(LATITUDE))
    b = -sine * (below * math.cos(LATITUDE) + depth * math.sin(LATITUDE))
    is_under = np.cos(hour) * a < b
    is_up = cosine * np.cos(hour) * math.cos(LATITUDE) > -sine * math.sin(LATITUDE)
    is_in_the_south = cosine * np.cos(hour) * math.sin(LATITUDE) > sine * math.cos(LATITUDE)
    expected = (is_up & is_under & is_in_the_south).sum()
    assert abs(found.hours[0] * 6 - expected) < 1e-9


def test_open_ground_has_all_hours_and_the_back_of_a_roof_none() -> None:
    scene = antumbra.Scene.from_arrays(*rectangle([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]))
    suns, _ = day_of_suns(0.3)
    how: dict[str, Any] = {"suns": suns, "step_hours": 1 / 6}
    front = antumbra.sun.sun_hours(scene, [[0.5, 0.25, 0]], [0], **how)
    assert front.hours[0] == pytest.approx(front.most, abs=1e-9)
    assert antumbra.sun.sun_hours(scene, [[0.5, 0.25, 0]], [0], side="back", **how).hours.tolist() == [0.0]


def east_and_west() -> antumbra.Scene:
    """A post that hides azimuths from 153.4 to 206.6 degrees from the origin."""
    return antumbra.Scene.from_arrays(*rectangle([(-1, -2, 0), (1, -2, 0), (1, -2, 99), (-1, -2, 99)]))


def test_spans_and_first_and_last_suns_of_days() -> None:
    days = np.array(["2024-02-28", "2024-02-29", "2024-03-01"], dtype="datetime64[D]")
    times = (days[:, None] + np.arange(24) * np.timedelta64(1, "h")).ravel()
    hours = np.tile(np.arange(24), 3)
    # Azimuth by the clock: 90 at six, 180 at noon. No sun on the leap day: a polar night.
    azimuths = hours * 15.0
    elevations = np.where((hours > 5) & (hours < 19), 20.0, -20.0)
    elevations[24:48] = -5.0
    found = antumbra.sun.sun_hours(
        east_and_west(), [[0, 0, 0], [0, -3, 0]], normals=[[0, 0, 1]] * 2, suns=(azimuths, elevations), times=times,
        spans=True, first_and_last=True,
    )
    assert found.days is not None and found.longest is not None and found.first is not None and found.last is not None
    assert found.days.tolist() == days.tolist() and found.most == 26.0
    # Hidden at 11, 12 and 13 o'clock: five hours before and five after.
    assert found.hours.tolist() == [20.0, 26.0]
    assert found.longest[0].tolist() == [5, 0, 5]
    assert found.longest[1].tolist() == [13, 0, 13]
    assert found.first[0].tolist() == [6, None, 54] and found.last[0].tolist() == [18, None, 66]
    assert found.first.mask[:, 1].all() and not found.first.mask[:, 0].any()


def test_a_missing_row_ends_a_span() -> None:
    times = np.array(["2025-06-01T10", "2025-06-01T11", "2025-06-01T13", "2025-06-01T14", "2025-06-01T15"], "datetime64[h]")
    suns = (np.full(5, 90.0), np.full(5, 30.0))
    how: dict[str, Any] = {"normals": [[0, 0, 1]], "suns": suns, "times": times, "spans": True}
    found = antumbra.sun.sun_hours(east_and_west(), [[0, 0, 0]], **how)
    assert found.hours.tolist() == [5.0] and found.longest is not None and found.longest.tolist() == [[3.0]]


def test_chunks_change_no_hours(monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(3)
    times = np.datetime64("2025-01-01T00") + np.arange(24 * 5) * np.timedelta64(1, "h")
    suns = (random.random(120) * 360, random.random(120) * 90 - 30)
    points = random.random((50, 3)) * [4, 4, 0] - [2, 3, 0]
    how: dict[str, Any] = {"suns": suns, "times": times, "spans": True, "first_and_last": True}
    whole = antumbra.sun.sun_hours(east_and_west(), points, **how)
    monkeypatch.setattr(_bits, "CHUNK_BYTES", 1500)
    parts = antumbra.sun.sun_hours(east_and_west(), points, **how)
    assert np.array_equal(whole.hours, parts.hours)
    for name in ("longest", "first", "last"):
        assert np.ma.allequal(getattr(whole, name), getattr(parts, name))
        assert np.array_equal(np.ma.getmaskarray(getattr(whole, name)), np.ma.getmaskarray(getattr(parts, name)))


def steps(times: Any, **how: Any) -> float:
    """Returns the hours of one sensor that sees all suns."""
    count = len(times)
    how = {"suns": (np.full(count, 90.0), np.full(count, 30.0)), "times": times, **how}
    return float(antumbra.sun.sun_hours(east_and_west(), [[0, 0, 0]], **how).hours[0])


def test_steps_follow_from_times() -> None:
    quarter = np.datetime64("2025-06-01T10") + np.arange(5) * np.timedelta64(15, "m")
    assert steps(quarter) == 1.25
    assert steps(quarter, step_hours=1.0) == 5.0
    assert steps(quarter, step_hours=[1, 2, 3, 4, 5]) == 15.0
    # A row is left out: what is there stands for a step each.
    assert steps(np.delete(quarter, 2)) == 1.0
    # Local times in autumn show an hour twice.
    hours = np.array(["2025-10-26T01", "2025-10-26T02", "2025-10-26T02", "2025-10-26T03"], "datetime64[h]")
    assert steps(hours) == 4.0
    zone = datetime.timezone(datetime.timedelta(hours=2))
    assert steps([datetime.datetime(2025, 6, 1, hour, tzinfo=zone) for hour in (9, 10, 11)]) == 3.0
    with pytest.raises(ValueError, match=r"times\[2\] is .*, earlier than"):
        steps(np.array(["2025-10-26T02:00", "2025-10-26T02:30", "2025-10-26T02:00"], "datetime64[m]"))
    with pytest.raises(ValueError, match=r"times\[3\] is .* expected a multiple of the step of 1 h"):
        steps(np.array(["2025-06-01T01:00", "2025-06-01T02:00", "2025-06-01T03:00", "2025-06-01T04:30"], "datetime64[m]"))
    with pytest.raises(ValueError, match="a single time does not say"):
        steps(quarter[:1])
    with pytest.raises(ValueError, match=r"step_hours\[1\] is -1"):
        steps(quarter[:2], step_hours=[1.0, -1.0])
    suns = np.array([[1.0, 0.0, 1.0]])
    with pytest.raises(ValueError, match="step_hours: expected the hours that each sun stands for"):
        antumbra.sun.sun_hours(east_and_west(), [[0, 0, 0]], suns=suns)
    with pytest.raises(ValueError, match="expected times, as there are no days"):
        antumbra.sun.sun_hours(east_and_west(), [[0, 0, 0]], suns=suns, step_hours=1.0, spans=True)


def test_zones_with_summer_time_keep_their_days() -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: time zones are not tested")
    for day, count in (("2025-03-30", 23), ("2025-10-26", 25), ("2024-02-29", 24)):
        times = pandas.date_range(day, periods=count, freq="1h", tz="Europe/Berlin")
        found = antumbra.sun.sun_hours(
            east_and_west(), [[0, 0, 0]], suns=(np.full(count, 90.0), np.full(count, 30.0)), times=times, spans=True
        )
        assert found.days is not None and found.days.tolist() == [datetime.date.fromisoformat(day)]
        assert found.hours.tolist() == [count] and found.longest is not None and found.longest.tolist() == [[count]]
        assert found.suns.times is times


def test_patches_cover_the_sky() -> None:
    for subdivision, count in ((1, 145), (2, 577), (4, 2305)):
        for up, axis in (("z", 2), ("y", 1)):
            sky = antumbra.sun.sky_patches(subdivision, up=up)  # type: ignore[arg-type]
            assert len(sky) == count and sky.directions.shape == sky.fluxes.shape == (count, 3)
            assert np.allclose(np.linalg.norm(sky.directions, axis=1), 1.0)
            assert sky.solid_angles.sum() == pytest.approx(2 * np.pi)
            total = np.zeros(3)
            total[axis] = np.pi
            assert np.allclose(sky.fluxes.sum(axis=0), total, atol=1e-12)
            # A small patch's flux is its middle times its angle.
            near = np.linalg.norm(sky.fluxes - sky.directions * sky.solid_angles[:, None], axis=1)
            assert (near < 0.02 * sky.solid_angles).all()
            assert (sky.directions[:, axis] > 0).all() and sky.directions[-1][axis] == 1.0
    # Middles of Tregenza's rows.
    heights = np.degrees(np.arcsin(antumbra.sun.sky_patches(1).directions[:, 2]))
    assert np.allclose(np.unique(heights.round(6)), [6, 18, 30, 42, 54, 66, 78, 90])
    assert np.allclose(antumbra.sun.sky_patches(1).directions[0], antumbra.Sun(0.0, 6.0).direction)
    with pytest.raises(ValueError, match="subdivision is 0"):
        antumbra.sun.sky_patches(0)


def test_shares_of_the_sky_are_near_those_by_other_directions(bumps: Any, scene: antumbra.Scene) -> None:
    from conftest import points_on

    points, ids, _ = points_on(*bumps, 200, seed=21)
    index = antumbra.ShadowIndex(scene, [])
    expected = index.sky_view_factor(points, ids, samples=4096)
    coarse = antumbra.sun.sky_view_factor(index, points, ids)
    fine = antumbra.sun.sky_view_factor(index, points, ids, subdivision=4)
    assert np.abs(fine - expected).max() < 0.02 and np.abs(coarse - expected).max() < 0.08
    assert np.abs(fine - expected).mean() < np.abs(coarse - expected).mean()


def test_shares_of_the_sky_that_are_known() -> None:
    ground = antumbra.Scene.from_arrays(*rectangle([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)]))
    how: dict[str, Any] = {"subdivision": 4}
    assert antumbra.sun.sky_view_factor(ground, [[0, 1, 0]], [1], **how) == pytest.approx([1.0], abs=1e-12)
    assert antumbra.sun.sky_view_factor(ground, [[0, 1, 3]], **how) == pytest.approx([1.0], abs=1e-12)
    # A free wall sees half of the sky; a slope of 45 degrees has (1 + cos 45) / 2.
    wall = antumbra.sun.sky_view_factor(ground, [[0, 0, 3]], normals=[[0, -1, 0]], **how)
    assert wall == pytest.approx([0.5], abs=0.01)
    slope = antumbra.sun.sky_view_factor(ground, [[0, 0, 3]], normals=[[0, -1, 1]], **how)
    assert slope == pytest.approx([(1 + math.sqrt(0.5)) / 2], abs=0.01)
    # At the foot of a wall without an end half of the sky is hidden.
    half = antumbra.Scene.from_arrays(*rectangle([(-FAR, 0, 0), (FAR, 0, 0), (FAR, 0, FAR), (-FAR, 0, FAR)]))
    foot = antumbra.sun.sky_view_factor(half, [[0, -1e-3, 0]], normals=[[0, 0, 1]], **how)
    sky = antumbra.sun.sky_patches(4)
    # Two columns of patches have their middle in the wall's plane, and count as seen.
    seen = sky.fluxes[sky.directions[:, 1] < 1e-9, 2].sum() / np.pi
    assert foot == pytest.approx([seen], abs=1e-12) and abs(seen - 0.5) < 0.02
    with pytest.raises(ValueError, match='side is "both"'):
        antumbra.sun.sky_view_factor(ground, [[0, 1, 0]], [1], side="both")


def study() -> tuple[antumbra.sun.Suns, npt.NDArray[np.uint8], npt.NDArray[np.float64]]:
    times = np.datetime64("2025-06-01T00") + np.arange(48) * np.timedelta64(30, "m")
    hour = np.arange(48) / 2
    suns = antumbra.sun.Suns.of((hour * 15.0, 50 * np.sin((hour - 6) * np.pi / 12)), times=times)
    normals = np.array([[0, 0, 1], [0, -1, 1], [1, -1, 0.5]], dtype=float)
    points = np.array([[0, 0.5, 0], [0.5, 0, 0.5], [5, 5, 5]])
    bits = antumbra.sun.sun_visibility(east_and_west(), points, normals=normals, suns=suns, packed=True)
    return suns, bits, normals


def test_energy_is_the_sum_over_the_suns_that_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    suns, bits, normals = study()
    random = np.random.default_rng(2)
    dni, dhi = random.random(48) * 900, random.random(48) * 300
    lit = np.unpackbits(bits, axis=1, count=len(suns), bitorder="little").astype(bool)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    cosines = unit @ suns.directions.T
    assert (cosines[lit] > 0).all() and lit.any() and not lit.all()
    expected = (lit * cosines * dni[suns.rows] * 0.5 / 1000).sum(axis=1)
    found = antumbra.sun.radiation(bits, suns, dni, normals=normals)
    assert np.allclose(found.direct, expected, rtol=1e-12) and found.diffuse is None
    assert np.array_equal(found.total, found.direct)
    sky = np.array([0.5, 0.25, 1.0])
    both = antumbra.sun.radiation(lit, suns, dni, dhi, normals=normals, sky_view=sky, step_hours=2.0)
    assert both.diffuse is not None and np.allclose(both.diffuse, sky * dhi.sum() * 2 / 1000)
    assert np.allclose(both.total, 4 * expected + both.diffuse)
    monkeypatch.setattr(_bits, "CHUNK_BYTES", 40)
    assert np.array_equal(antumbra.sun.radiation(bits, suns, dni, normals=normals).direct, found.direct)


def test_weather_that_does_not_fit_is_named() -> None:
    suns, bits, normals = study()
    good = np.full(48, 100.0)

    def refused(match: str, kind: type[Exception] = ValueError, **how: Any) -> None:
        how = {"bits": bits, "suns": suns, "dni": good, "normals": normals, **how}
        with pytest.raises(kind, match=match):
            antumbra.sun.radiation(how.pop("bits"), how.pop("suns"), how.pop("dni"), how.pop("dhi", None), **how)

    missing = good.copy()
    missing[20] = np.nan
    refused(r"dni: row 20 \(2025-06-01T10:00.*\) is nan.*; 1 of", dni=missing)
    at_night = good.copy()
    at_night[0] = np.nan
    # What no sun of the day needs may be missing for direct light, not for diffuse light.
    antumbra.sun.radiation(bits, suns, at_night, normals=normals)
    refused("dhi: row 0 ", dhi=at_night, sky_view=np.ones(3))
    refused("dni: row 24 .* is -1", dni=np.where(np.arange(48) == 24, -1.0, good))
    refused(r"dni: expected numbers, shape \(48,\)", dni=good[:5])
    refused("sky_view: expected sky view factors with dhi", dhi=good)
    refused("sky_view: expected dhi with it", sky_view=np.ones(3))
    refused(r"sky_view\[1\] is 1.5", dhi=good, sky_view=np.array([1, 1.5, 0]))
    refused(r"normals: expected shape \(3, 3\) or \(3,\)", normals=normals[:2])
    refused(r"bits\[2\]: sun \d+ is seen behind normals\[2\]", normals=[[0, 0, 1], [0, -1, 1], [-1, 1, 0]])
    refused(r"bits: expected shape \(n, \d+\)", bits=bits[:, :1])
    refused("bits: expected dtype bool", TypeError, bits=bits.astype(float))
    refused("suns: expected Suns", TypeError, suns=np.zeros((3, 3)))


def test_energy_on_open_ground_is_that_of_pvlib() -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: pvlib is not compared with")
    pvlib = pytest.importorskip("pvlib", reason="pvlib is not installed: it is not compared with")
    place = pvlib.location.Location(48.0, 9.0, "Europe/Berlin", 300)
    times = pandas.date_range("2025-03-01", "2025-04-15", freq="30min", tz="Europe/Berlin", inclusive="left")
    position = place.get_solarposition(times)
    weather = place.get_clearsky(times, model="haurwitz", solar_position=position)["ghi"]
    parts = pvlib.irradiance.erbs(weather, position["zenith"], times)
    dni, dhi = parts["dni"].fillna(0.0), parts["dhi"].fillna(0.0)
    suns = antumbra.sun.Suns.of(position)
    empty = antumbra.Scene.from_arrays(np.empty((0, 3)), np.empty((0, 3), int))
    tilt, azimuth = 35.0, 150.0
    normal = np.array(antumbra.Sun(azimuth, 90.0 - tilt).direction)[None]
    bits = antumbra.sun.sun_visibility(empty, [[0, 0, 0]], normals=normal, suns=suns, packed=True)
    sky_view = antumbra.sun.sky_view_factor(empty, [[0, 0, 0]], normals=normal, subdivision=8)
    found = antumbra.sun.radiation(bits, suns, dni, dhi, normals=normal, sky_view=sky_view)
    is_up = position["elevation"] > 0
    beam = pvlib.irradiance.beam_component(tilt, azimuth, position["zenith"], position["azimuth"], dni)[is_up].sum() / 2000
    diffuse = pvlib.irradiance.isotropic(tilt, dhi).sum() / 2000
    assert found.direct[0] == pytest.approx(beam, rel=1e-9)
    assert found.diffuse is not None and found.diffuse[0] == pytest.approx(diffuse, rel=5e-3)
    moved = pandas.Series(dni.to_numpy(), index=times + pandas.Timedelta("1h"))
    with pytest.raises(ValueError, match="dni: expected the times of the suns"):
        antumbra.sun.radiation(bits, suns, moved, normals=normal)
    hours = antumbra.sun.sun_hours(empty, [[0, 0, 0]], normals=[[0, 0, 1]], suns=suns)
    rise_to_set = pvlib.solarposition.sun_rise_set_transit_spa(times.normalize().unique(), 48.0, 9.0)
    # The middle of the sun without refraction rises later: a few minutes a day.
    expected = (rise_to_set["sunset"] - rise_to_set["sunrise"]).dt.total_seconds().sum() / 3600
    assert 0 < expected - hours.hours[0] < 45 * 0.3


def test_a_polar_night_and_a_polar_day() -> None:
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: pvlib's tables are not tested")
    pvlib = pytest.importorskip("pvlib", reason="pvlib is not installed: its tables are not tested")

    def hours(begin: str, end: str) -> antumbra.sun.SunHours:
        times = pandas.date_range(begin, end, freq="1h", tz="Arctic/Longyearbyen", inclusive="left")
        table = pvlib.solarposition.get_solarposition(times, 78.2, 15.6)
        return antumbra.sun.sun_hours(east_and_west(), [[50, 50, 0]], suns=table, spans=True)

    with pytest.raises(ValueError, match="none of 240 is above the horizon"):
        hours("2025-12-15", "2025-12-25")
    day = hours("2025-06-01", "2025-06-03")
    assert day.hours.tolist() == [48.0] and day.longest is not None and day.longest.tolist() == [[24.0, 24.0]]
    # The sun comes back: days of the night are there and have nothing.
    spring = hours("2025-02-01", "2025-03-01")
    assert spring.longest is not None and spring.longest.shape == (1, 28)
    assert spring.longest[0, 0] == 0.0 < spring.longest[0, -1] and spring.longest.sum() == spring.hours[0]
