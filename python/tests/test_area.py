"""Lights with size: visible fractions and soft shadows."""

from __future__ import annotations

import dataclasses
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antumbra

FLOOR = [[-4, -4, 0], [4, -4, 0], [4, 4, 0], [-4, 4, 0]]
PLATE = [[-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
LAMP = antumbra.RectLight((0, 0, 3), (0, 1, 0), (1, 0, 0))

POINT: Any = antumbra.PointLight((0, 0, 1))

LIGHTS: list[Any] = [
    LAMP,
    antumbra.PolygonLight([(0, 0, 3), (0, 1, 3), (1, 0, 3)]),
    antumbra.DiskLight((0, 0, 3), (0, 0, -1), 0.5),
    antumbra.SphereLight((0, 0, 3), 0.5),
    antumbra.SegmentLight((-1, 0, 3), (1, 0, 3)),
    antumbra.SunDisc(direction=(1, 0, 1), diameter_degrees=5.0),
    antumbra.Sky(),
]


def scene() -> antumbra.Scene:
    vertices = np.array(FLOOR + PLATE, dtype=np.float64)
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    return antumbra.Scene.from_arrays(vertices, faces)


def test_a_point_under_the_plate_is_dark_one_far_away_is_lit_and_one_between_sees_a_part() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    points = np.array([[0.0, -0.1, 0.0], [3.9, -3.9, 0.0], [1.4, -0.1, 0.0]])
    found = index.visible_fraction(points, LAMP, face_ids=[0, 0, 0], samples=256)
    assert found.dtype == np.float32 and found.shape == (3,)
    assert found[0] == 0.0 and found[1] == 1.0 and 0.1 < found[2] < 0.9
    again = index.visible_fraction(points, LAMP, face_ids=[0, 0, 0], samples=256, threads=1)
    assert (found == again).all()


def test_fractions_do_not_depend_on_the_method() -> None:
    points = np.random.default_rng(1).uniform(-4, 4, (300, 3))
    points[:, 2] = 0.0
    ids = np.where(points[:, 1] <= points[:, 0], 0, 1)
    for light in LIGHTS:
        found = [
            antumbra.ShadowIndex(scene(), [], method=method).visible_fraction(points, light, ids, samples=33)
            for method in ("naive", "bvh", "voxel", "auto")
        ]
        for other in found[1:]:
            assert (found[0] == other).all()
        assert found[0].min() >= 0.0 and found[0].max() <= 1.0 and found[0].max() > 0.0


def test_the_side_of_the_surface_decides_what_is_seen() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    point = np.array([[3.0, -3.0, 0.0]])

    def seen(**how: Any) -> float:
        return float(index.visible_fraction(point, antumbra.Sky(), samples=16, **how)[0])

    assert seen(face_ids=[0]) > 0.9
    assert seen(face_ids=[0], side="back") == 0.0
    assert seen(face_ids=[0], side="both") == seen(face_ids=[0])
    with pytest.warns(antumbra.AntumbraWarning, match=r"points: 1 of 1 .* Give face_ids"):
        assert seen(normals=[[0.0, 0.0, -1.0]]) == 0.0


def test_exact_fractions_are_what_samples_come_near_to() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    points = np.random.default_rng(2).uniform(-3, 3, (60, 3))
    points[:, 2] = 0.0
    ids = np.where(points[:, 1] <= points[:, 0], 0, 1)
    for light in LIGHTS:
        found, exact = index.exact_visible_fraction(points, light, face_ids=ids)
        assert found.dtype == np.float64 and exact.dtype == np.bool_
        assert exact.all() == (not isinstance(light, (antumbra.SphereLight, antumbra.Sky)))
        by_samples = index.visible_fraction(points, light, face_ids=ids, samples=4096)
        assert abs(by_samples - found).max() < 0.05
        assert (index.visible_fraction(points, light, face_ids=ids, samples="exact") == found).all()
    under = index.visible_fraction([[0.0, -0.1, 0.0]], LAMP, face_ids=[0], samples="exact")
    assert under.tolist() == [0.0]
    wrong: Any = "many"
    with pytest.raises(ValueError, match="samples is 'many'"):
        index.visible_fraction(points, LAMP, ids, samples=wrong)


def test_a_linear_light_has_lit_intervals() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    # The plate at height 1 hides x from -2 to 2 of height 2.
    light = antumbra.SegmentLight((-4, 0.3, 2), (4, 0.3, 2))
    found = index.lit_intervals((0, 0, 0), light, face_id=0)
    assert found is not None and found.tolist() == [[0.0, 0.25], [0.75, 1.0]]
    below = index.lit_intervals((0, 0, 0), light, face_id=0, side="back")
    assert below is not None and below.shape == (0, 2)
    with pytest.raises(IndexError):
        index.lit_intervals((0, 0, 0), light, face_id=99)
    lamp: Any = LAMP
    with pytest.raises(ValueError, match="linear"):
        index.lit_intervals((0, 0, 0), lamp, face_id=0)


def test_segments_have_lit_intervals() -> None:
    index = antumbra.ShadowIndex(scene(), [antumbra.DirectionalLight((0, 0, 1)), antumbra.PointLight((0, 0, 2))])
    # The plate at height 1 shades x from -1 to 1, or from -2 to 2 by the lamp at height 2.
    origins = np.array([[-4, 0.3, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.0, 0.5]])
    ends = np.array([[4, 0.3, 0.0], [0.5, 0.0, 0.0], [0.0, 0.0, 1.5]])
    offsets, intervals = index.lit_intervals_along(origins, ends, 0)
    assert offsets.dtype == np.int64 and offsets.tolist() == [0, 2, 2, 3]
    assert intervals.tolist() == [[0.0, 0.375], [0.625, 1.0], [0.5, 1.0]]
    by_lamp = index.lit_intervals_along(origins[:1], ends[:1], 1)[1]
    assert by_lamp.tolist() == [[0.0, 0.25], [0.75, 1.0]]
    other = index.lit_intervals_along(origins, ends, antumbra.SpotLight((0, 0, 2), (0, 0, -1), 45))[1]
    assert other[:2].tolist() == by_lamp.tolist()
    single = index.lit_intervals_along(origins.astype(np.float32), ends.astype(np.float32), 0, threads=2)
    assert single[0].tolist() == offsets.tolist()
    nothing = index.lit_intervals_along(origins[:0], ends[:0], 0)
    assert nothing[0].tolist() == [0] and nothing[1].shape == (0, 2)
    with pytest.raises(IndexError, match="light is 2"):
        index.lit_intervals_along(origins, ends, 2)
    with pytest.raises(ValueError, match=r"ends\[1\] is"):
        index.lit_intervals_along(origins[:2], [[0, 0, 0], [0, np.nan, 0]], 0)
    with pytest.raises(ValueError, match="ends: expected shape"):
        index.lit_intervals_along(origins, ends[1:], 0)
    lamp: Any = LAMP
    with pytest.raises(TypeError, match="light"):
        index.lit_intervals_along(origins, ends, lamp)


def test_ambient_occlusion_and_sky_view_factor() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    # The form factor of a square of half-width 1 that is 1 above (Howell, B-3).
    hidden = 4 / np.pi * np.sqrt(0.5) * np.arctan(np.sqrt(0.5))
    floor = {"face_ids": [0]}
    point = [[0.0, 0.0, 0.0]]
    assert abs(index.ambient_occlusion(point, samples=4096, **floor)[0] - (1 - hidden)) < 0.01
    assert abs(index.sky_view_factor(point, samples=4096, **floor)[0] - (1 - hidden)) < 0.01
    assert index.ambient_occlusion(point, distance=0.9, **floor).tolist() == [1.0]
    assert index.sky_view_factor(point, side="back", **floor).tolist() == [0.0]
    free = index.sky_view_factor(np.array([[9.0, 9.0, 9.0]]), normals=[[1.0, 0.0, 0.0]])
    assert free.dtype == np.float32 and abs(free[0] - 0.5) < 0.02
    assert index.ambient_occlusion(np.array([[9.0, 9.0, 9.0]]), distance=5).tolist() == [1.0]
    with pytest.raises(ValueError, match="distance is 0.0"):
        index.ambient_occlusion(point, distance=0, **floor)
    with pytest.raises(ValueError, match="zero"):
        index.sky_view_factor(point, up=(0, 0, 0), **floor)


def test_pictures_have_soft_shadows() -> None:
    camera = antumbra.Camera((0, -6, 5), (0, 0, 0))
    picture = antumbra.render(
        scene(), lights=[*LIGHTS, antumbra.PointLight((2, 2, 4))], camera=camera, size=(32, 24), light_samples=8
    )
    assert picture.shadow.shape == (8, 24, 32) and len(picture.light_names) == 8
    # The point comes first; the rectangle behind it is seen in part somewhere.
    assert set(np.unique(picture.shadow[0])) <= {0.0, 1.0}
    assert ((picture.shadow[1] > 0.0) & (picture.shadow[1] < 1.0)).any()
    assert picture.color.max() > 0.0


CASES: list[tuple[Any, type[Exception], str]] = [
    (lambda: antumbra.RectLight((0, 0, 3), (1, 0, 0), (2, 0, 0)), ValueError, "it has no area"),
    (lambda: antumbra.RectLight((0, 0, float("nan")), (1, 0, 0), (0, 1, 0)), ValueError, "center is"),
    (lambda: antumbra.SphereLight((0, 0, 3), 0.0), ValueError, "its radius is zero"),
    (lambda: antumbra.SphereLight((0, 0, 3), -1.0), ValueError, "the radius is -1"),
    (lambda: antumbra.DiskLight((0, 0, 3), (0, 0, 0), 1.0), ValueError, "normal is"),
    (lambda: antumbra.SegmentLight((0, 0, 3), (0, 0, 3)), ValueError, "its ends are the same point"),
    (lambda: antumbra.SunDisc(0, 90, 180.0), ValueError, "angular diameter"),
    (lambda: antumbra.SunDisc(0, 91), ValueError, "the elevation is 91.0 degrees"),
    (lambda: antumbra.SunDisc((0, 0, 1), 5.0), TypeError, "a vector is given as direction="),  # type: ignore[call-overload]
    (lambda: antumbra.SunDisc(180), TypeError, "expected azimuth and elevation, or direction="),  # type: ignore[call-overload]
    (lambda: antumbra.SunDisc(180, 45, direction=(0, 0, 1)), TypeError, "not both"),  # type: ignore[call-overload]
    (lambda: antumbra.Sky(color=(-1, 0, 0)), ValueError, "color is"),
    (lambda: antumbra.PolygonLight([(0, 0, 0), (2, 0, 0), (0.5, 0.5, 0), (0, 2, 0)]), ValueError, "not convex"),
    (
        lambda: antumbra.ShadowIndex(scene(), []).visible_fraction([[0.0, 0, 0]], POINT),
        TypeError,
        "light: expected a light with size",
    ),
    (
        lambda: antumbra.ShadowIndex(scene(), []).visible_fraction([[0.0, 0, 0]], LAMP, [0], side="up"),  # type: ignore[arg-type]
        ValueError,
        'side is "up"',
    ),
    (
        lambda: antumbra.ShadowIndex(scene(), []).visible_fraction([[0.0, 0, 0]], LAMP, [0], samples=0),
        ValueError,
        "samples",
    ),
]


@pytest.mark.parametrize(("make", "kind", "text"), CASES)
def test_what_is_no_light_or_no_question_is_refused(make: Any, kind: type[Exception], text: str) -> None:
    with pytest.raises(kind) as caught:
        make()
    assert text in str(caught.value)


ODD: list[tuple[str, Any]] = [
    ("smaller than rounding", lambda: antumbra.RectLight((0.1, 0.1, 3), (1e-30, 0, 0), (0, 1e-30, 0), two_sided=True)),
    ("in the floor", lambda: antumbra.RectLight((0.5, 0.5, 0), (1, 0, 0), (0, 1, 0), two_sided=True)),
    ("turned away", lambda: antumbra.RectLight((0, 0, 3), (1, 0, 0), (0, 1, 0))),
    ("around all", lambda: antumbra.SphereLight((0, 0, 0), 1e3)),
    ("through the floor", lambda: antumbra.SphereLight((0.5, 0.5, 0), 0.25)),
    ("larger than the scene", lambda: antumbra.RectLight((0, 0, 50), (0, 9e5, 0), (9e5, 0, 0))),
    ("as long as numbers go", lambda: antumbra.SegmentLight((0, 0, -1e30), (0, 1, 1e30))),
]


@pytest.mark.parametrize(("name", "make"), ODD)
def test_odd_lights_have_shares_that_do_not_depend_on_the_method(name: str, make: Any) -> None:
    points, faces = [[0.3, 0.2, 0.0], [-0.5, 0.4, 0.0]], [0, 0]
    light = make()
    for samples in (16, "exact"):
        found = [
            antumbra.ShadowIndex(scene(), [], method=method).visible_fraction(
                points, light, faces, samples=samples, tolerance=np.inf
            )
            for method in ("auto", "bvh", "naive")
        ]
        assert ((found[0] >= 0.0) & (found[0] <= 1.0)).all(), name
        assert (found[0] == found[1]).all() and (found[0] == found[2]).all(), name


def test_a_hundred_thousand_lights_are_asked() -> None:
    lights = [antumbra.PointLight((i % 317 / 100 - 1.5, i % 499 / 100 - 2.0, 2.0 + i % 7)) for i in range(100_000)]
    points = [[0.3, 0.2, 0.5], [-0.5, 0.4, 0.7]]
    some = list(range(0, 100_000, 997))
    found = antumbra.ShadowIndex(scene(), lights).occluded_at(points)
    alone = antumbra.ShadowIndex(scene(), [lights[i] for i in some], method="naive").occluded_at(points)
    assert found.shape == (2, 100_000)
    assert (found[:, some] == alone).all()
    assert alone.any() and not alone.all()


def test_pictures_have_exact_soft_shadows() -> None:
    camera = antumbra.Camera((0, -6, 5), (0, 0, 0))
    pictures = [
        antumbra.render(scene(), lights=LAMP, camera=camera, size=(24, 16), light_samples="exact", seed=seed)
        for seed in (1, 2)
    ]
    # Without samples a seed changes nothing.
    assert (pictures[0].shadow == pictures[1].shadow).all() and (pictures[0].color == pictures[1].color).all()
    assert ((pictures[0].shadow > 0.0) & (pictures[0].shadow < 1.0)).any()


ASKED: list[Any] = [
    lambda index, points, **how: index.visible_fraction(points, LAMP, **how),
    lambda index, points, **how: index.visible_fraction(points, LAMP, samples="exact", **how),
    lambda index, points, **how: index.visible_fraction(points, antumbra.Sky(), **how),
    lambda index, points, **how: index.exact_visible_fraction(points, LAMP, **how),
    lambda index, points, **how: index.ambient_occlusion(points, **how),
    lambda index, points, **how: index.sky_view_factor(points, **how),
]


@pytest.mark.parametrize("ask", ASKED)
def test_points_of_space_that_lie_on_surfaces_warn_whatever_share_is_asked_for(ask: Any) -> None:
    index = antumbra.ShadowIndex(scene(), [])
    on_floor = np.array([[0.0, -0.1, 0.0], [3.0, -3.0, 0.0]])
    with pytest.warns(antumbra.AntumbraWarning, match="points: 2 of 2 .* Give face_ids") as reported:
        ask(index, on_floor)
    assert [warning.filename for warning in reported] == [__file__]
    # Those that name their faces, and those above them, are as they should be: a warning would be an error.
    ask(index, on_floor, face_ids=[0, 0])
    ask(index, on_floor + (0.0, 0.0, 0.5))


def test_a_point_of_space_on_a_surface_warns_where_intervals_are_asked_for() -> None:
    index = antumbra.ShadowIndex(scene(), [])
    light = antumbra.SegmentLight((-4, 0.3, 2), (4, 0.3, 2))
    with pytest.warns(antumbra.AntumbraWarning, match="point: 1 of 1 .* Give face_id "):
        index.lit_intervals((0, 0, 0), light)


def test_a_sun_disc_is_where_a_sun_is() -> None:
    for up in ("z", "y"):
        disc, sun = antumbra.SunDisc(140, 30, up=up), antumbra.Sun(140, 30, up=up)  # type: ignore[arg-type]
        assert disc.direction == sun.direction and disc.diameter_degrees == 0.53
    assert antumbra.SunDisc(direction=(0, 0, 2)).direction == (0.0, 0.0, 2.0)
    assert dataclasses.replace(antumbra.SunDisc(90, 0), diameter_degrees=2.0).diameter_degrees == 2.0
    with pytest.warns(antumbra.AntumbraWarning, match="10 degrees below the horizon"):
        antumbra.SunDisc(90, -10)


def test_up_of_a_file_that_does_not_say_it_is_told_where_the_sky_depends_on_it(tmp_path: Path) -> None:
    path = tmp_path / "wall.obj"
    path.write_text("v 0 0 -9\nv 0 9 9\nv 0 -9 9\nf 1 2 3\n")
    point = np.array([[1.0, 0.0, 0.0]])
    sides = {"normals": [[0.0, 1.0, 0.0]]}
    index = antumbra.ShadowIndex(antumbra.Scene.load(path), [])
    assert index.scene.up == (0.0, 1.0, 0.0)
    asked: list[Any] = [
        lambda index: index.sky_view_factor(point, samples=4096, **sides),
        lambda index: index.visible_fraction(point, antumbra.Sky(), samples=4096, **sides),
    ]
    for ask in asked:
        with pytest.warns(antumbra.AntumbraWarning, match=r"taking \+y for the sky; .*up=\"z\"") as reported:
            assumed = ask(index)
        assert [warning.filename for warning in reported] == [__file__]
        # What is said is not guessed, and the answers go by it.
        for up in ("y", "z"):
            said = ask(antumbra.ShadowIndex(antumbra.Scene.load(path, up=up), []))
            assert (said == assumed).all() == (up == "y")
    index.sky_view_factor(point, up=(0, 1, 0), **sides)
    index.ambient_occlusion(point, **sides)
    again = pickle.loads(pickle.dumps(index.scene))
    with pytest.warns(antumbra.AntumbraWarning, match="taking"):
        antumbra.ShadowIndex(again, []).sky_view_factor(point, **sides)
