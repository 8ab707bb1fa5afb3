"""What is refused, and what is said then: shape, dtype, value, index."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import antumbra
import numpy as np
import pytest

ONE = np.zeros((1, 3))
THREE = np.zeros((3, 3))
NAN = np.array([[0, 0, 0], [0, np.nan, 0], [np.inf, 0, 0]])
FACE = [[0, 1, 2]]
CORNERS = np.eye(3)


@pytest.fixture(scope="module")
def plain() -> antumbra.ShadowIndex:
    return antumbra.ShadowIndex(antumbra.Scene.from_arrays(CORNERS, FACE), [antumbra.PointLight((5, 5, 5))])


def occluded(**arguments: Any) -> Any:
    return lambda index: index.occluded(**arguments)


CASES: list[tuple[Any, type[Exception], str]] = [
    (occluded(points=[]), ValueError, "points: expected shape (n, 3), found (0,); give an empty array shape (0, 3)"),
    (occluded(points=np.zeros(3)), ValueError, "points: expected shape (n, 3), found (3,)"),
    (occluded(points=np.zeros((4, 2))), ValueError, "points: expected shape (n, 3), found (4, 2)"),
    (occluded(points=np.zeros((1, 4, 3))), ValueError, "points: expected shape (n, 3), found (1, 4, 3)"),
    (occluded(points=[[1, 2], [3]]), ValueError, "points: expected an array, found list"),
    (occluded(points=np.zeros((2, 3), complex)), TypeError, "points: expected dtype float32 or float64, found complex128"),
    (occluded(points=np.zeros((2, 3), bool)), TypeError, "points: expected dtype float32 or float64, found bool"),
    (occluded(points=[["a", "b", "c"]]), TypeError, "points: expected dtype float32 or float64, found <U1"),
    (occluded(points=np.zeros((2, 3), object)), TypeError, "points: expected dtype float32 or float64, found object"),
    (occluded(points=np.zeros((2, 3), np.longdouble)), TypeError, "float64, found float128"),
    (occluded(points=None), ValueError, "points: expected shape (n, 3), found ()"),
    (occluded(points=NAN), ValueError, "points[1] is (0, NaN, 0): coordinates must be finite"),
    (occluded(points=NAN.astype(np.float32)), ValueError, "points[1] is (0, NaN, 0)"),
    (occluded(points=NAN[[0, 2]]), ValueError, "points[1] is (inf, 0, 0)"),
    (occluded(points=[[0, 2.0**101, 0]]), ValueError, "at most 2^100 in magnitude"),
    (occluded(points=np.ma.masked_equal(THREE, 0.0)), ValueError, "points: some entries are masked"),
    (occluded(points=ONE, light_index=1), IndexError, "light_index is 1: expected less than 1, the number of lights"),
    (occluded(points=ONE, light_index=-1), IndexError, "light_index is -1: expected less than 1, the number of lights"),
    (occluded(points=ONE, light_index=[0, 7]), IndexError, "light_index[1] is 7: expected less than 1, the number of lights"),
    (occluded(points=ONE, light_index=0.5), TypeError, "light_index: expected a whole number or a sequence of them, found float"),
    (occluded(points=ONE, light_index="ab"), TypeError, "light_index[0]: expected a whole number"),
    (occluded(points=ONE, normals=np.zeros((2, 3))), ValueError, "normals: expected shape (1, 3) as that of points, found (2, 3)"),
    (occluded(points=THREE, normals=NAN), ValueError, "normals[1] is (0, NaN, 0)"),
    (occluded(points=CORNERS, normals=NAN, on_surface=True), ValueError, "normals[1] is (0, NaN, 0)"),
    (occluded(points=ONE, face_ids=[[0]]), ValueError, "face_ids: expected shape (1,), found (1, 1)"),
    (occluded(points=ONE, face_ids=[0, 0]), ValueError, "face_ids: expected shape (1,), found (2,)"),
    (occluded(points=ONE, face_ids=[0.0]), TypeError, "face_ids: expected integers, found dtype float64"),
    (occluded(points=THREE, face_ids=[0, -1, 5]), IndexError, "face_ids[1] is -1: expected less than 1, the number of surfaces"),
    (occluded(points=THREE, face_ids=[0, 0, 1]), IndexError, "face_ids[2] is 1: expected less than 1, the number of surfaces"),
    (occluded(points=THREE, face_ids=np.array([0, 9, 1], np.uint32), tolerance=np.inf), IndexError, "face_ids[1] is 9"),
    (occluded(points=THREE, face_ids=np.array([0, 2**40, 1])), IndexError, "face_ids[1] is 1099511627776"),
    (occluded(points=ONE, face_ids=[0], normals=ONE), ValueError, "face_ids say where points are"),
    (occluded(points=ONE, face_ids=[0], on_surface=True), ValueError, "face_ids say where points are"),
    (occluded(points=ONE, tolerance=1.0), ValueError, "only points with face_ids or on_surface=True"),
    (occluded(points=ONE, on_surface=True, tolerance=-1.0), ValueError, "tolerance -1: expected zero or more"),
    (occluded(points=ONE, on_surface=True, tolerance=np.nan), ValueError, "tolerance nan: expected zero or more"),
    (occluded(points=ONE, on_surface=True, tolerance="inf"), TypeError, "tolerance: expected a number, found str"),
    (occluded(points=ONE, on_surface=True, tolerance=np.ones(1)), TypeError, "tolerance: expected a number, found ndarray"),
    (lambda index: index.occluded_rays(ONE, ONE, [0], tolerance=-np.inf), ValueError, "tolerance -inf: expected zero or more, or infinity"),
    (lambda index: index.occluded_segments(ONE, ONE, [0], tolerance=np.nan), ValueError, "tolerance nan: expected zero or more"),
    (occluded(points=[CORNERS[0], [9, 9, 9]], on_surface=True), ValueError, "points[1] is (9, 9, 9): on no surface: the nearest, face 0, is"),
    (occluded(points=ONE, threads=-1), ValueError, "threads is -1: expected 0 to 1024"),
    (occluded(points=ONE, threads=1.5), TypeError, "threads: expected a whole number, found float"),
    (lambda index: index.occluded_segments(ONE, THREE), ValueError, "b: expected shape (1, 3) as that of a, found (3, 3)"),
    (lambda index: index.occluded_segments(THREE, NAN), ValueError, "ends[1] is (0, NaN, 0)"),
    (lambda index: index.occluded_segments(NAN, THREE), ValueError, "points[1] is (0, NaN, 0)"),
    (lambda index: index.occluded_rays(THREE, NAN), ValueError, "directions[1] is (0, NaN, 0)"),
]


@pytest.mark.parametrize("number", range(len(CASES)))
def test_a_question_that_makes_no_sense_is_refused(plain: antumbra.ShadowIndex, number: int) -> None:
    ask, kind, expected = CASES[number]
    with pytest.raises(kind, match=re.escape(expected)):
        ask(plain)


def test_the_first_bad_point_is_named_behind_the_first_block(plain: antumbra.ShadowIndex) -> None:
    points = np.zeros(((1 << 21) + 10, 3), np.float32)
    points[(1 << 21) + 5 :, 2] = np.nan
    with pytest.raises(ValueError, match=rf"points\[{(1 << 21) + 5}\] is \(0, 0, NaN\)"):
        plain.occluded(points)


SCENES: list[tuple[Any, type[Exception], str]] = [
    (lambda: antumbra.Scene(), TypeError, "made by Scene.load"),
    (lambda: antumbra.Scene.from_arrays(NAN, FACE), ValueError, "vertices[1] is (0, NaN, 0)"),
    (lambda: antumbra.Scene.from_arrays(CORNERS, [[0, 1, 3]]), IndexError, "faces[0, 2] is 3: expected less than 3, the number of vertices"),
    (lambda: antumbra.Scene.from_arrays(CORNERS, [[0, 1, -1]]), IndexError, "faces[0, 2] is -1: expected less than 3, the number of vertices"),
    (lambda: antumbra.Scene.from_arrays(CORNERS, np.array([[0, 1, 3]], np.uint32)), IndexError, "faces[0] is (0, 1, 3)"),
    (lambda: antumbra.Scene.from_arrays(CORNERS, [[0, 1, 2, 0]]), ValueError, "faces: expected shape (n, 3), found (1, 4)"),
    (lambda: antumbra.Scene.from_arrays(CORNERS, np.zeros((1, 3))), TypeError, "faces: expected integers, found dtype float64"),
    (lambda: antumbra.Scene.from_arrays(CORNERS[:, :2], FACE), ValueError, "vertices: expected shape (n, 3), found (3, 2)"),
    (lambda: antumbra.Scene.from_trimesh(3), TypeError, "mesh: expected vertices and faces, found int"),
    (lambda: antumbra.Scene.load("nowhere.obj"), FileNotFoundError, "nowhere.obj"),
    (lambda: antumbra.Scene.load("scene.xyz"), ValueError, "expected a name that ends in .nff"),
    (lambda: antumbra.Scene.load("a.obj", up="x"), ValueError, 'up is "x": expected "y", "z" or None'),
    (lambda: antumbra.PointLight((0, 0)), ValueError, "position: expected three numbers, found shape (2,)"),
    (lambda: antumbra.PointLight((0, 0, np.nan)), ValueError, "position is (0.0, 0.0, nan): expected finite numbers"),
    (lambda: antumbra.PointLight("abc"), ValueError, "position: expected three numbers"),
    (lambda: antumbra.PointLight((0, 0, 0), colour=(1, -1, 1)), ValueError, "expected no negative number"),
    (lambda: antumbra.DirectionalLight((0, 0, 0)), ValueError, "direction is (0.0, 0.0, 0.0): expected a direction"),
    (lambda: antumbra.SpotLight((0, 0, 0), (0, 0, 1), 100.0), ValueError, "half_angle_degrees is 100.0"),
    (lambda: antumbra.SpotLight((0, 0, 0), (0, 0, 0)), ValueError, "axis is (0.0, 0.0, 0.0)"),
]


@pytest.mark.parametrize("number", range(len(SCENES)))
def test_what_is_no_scene_and_no_light_is_refused(number: int) -> None:
    make, kind, expected = SCENES[number]
    with pytest.raises(kind, match=re.escape(expected)):
        make()


SETTINGS: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"method": "magic"}, ValueError, 'method is "magic": expected "auto", "voxel"'),
    ({"method": 3}, TypeError, "method: expected a str, found int"),
    ({"refine": "later"}, ValueError, 'refine is "later": expected "lazy"'),
    ({"resolution": 3}, ValueError, "resolution is 3: expected 4 to 4096"),
    ({"grid": 0}, ValueError, "grid is 0: expected 1 to 2048"),
    ({"grid": (1, 2)}, ValueError, "grid: expected one number or three, found 2"),
    ({"grid": 2048}, ValueError, "grid resolution [2048, 2048, 2048]"),
    ({"memory": -1}, ValueError, "memory is -1"),
    ({"memory_limit": 1}, MemoryError, "more than the limit of 1"),
    ({"lights": [(0, 0, 0)]}, TypeError, "lights[0]: expected PointLight, DirectionalLight or SpotLight, found tuple"),
]


@pytest.mark.parametrize("number", range(len(SETTINGS)))
def test_settings_out_of_range_are_refused(number: int) -> None:
    arguments, kind, expected = SETTINGS[number]
    scene = antumbra.Scene.from_arrays(CORNERS, FACE)
    with pytest.raises(kind, match=re.escape(expected)):
        antumbra.ShadowIndex(scene, **{"lights": [], **arguments})


def test_a_bad_file_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "bad.nff"
    path.write_text("f 1 1 1 1 0 0 0 1\ns 0 0 zero 1\n")
    with pytest.raises(ValueError, match=re.escape("bad.nff:2: ")):
        antumbra.Scene.load(path)


def test_a_tensor_that_numpy_cannot_take_is_refused(plain: antumbra.ShadowIndex) -> None:
    class Elsewhere:
        def __dlpack__(self, **how: Any) -> Any:
            raise BufferError("on another device")

        def __dlpack_device__(self) -> Any:
            return (2, 0)

    with pytest.raises(TypeError, match="points: NumPy cannot take this Elsewhere by DLPack"):
        plain.occluded(Elsewhere())


def test_vertices_that_no_face_uses_may_be_anything():
    vertices = np.array([[np.nan] * 3, [0, 0, 0], [1, 0, 0], [0, 1, 0], [np.inf, 0, 1e300]])
    scene = antumbra.Scene.from_arrays(vertices, [[1, 2, 3]])
    index = antumbra.ShadowIndex(scene, [antumbra.PointLight((0, 0, 1))])
    assert index.occluded_at([[0.1, 0.1, -1], [2, 2, -1]], 0).tolist() == [True, False]
    with pytest.raises(ValueError, match=r"vertices\[4\] is .*: coordinates must be finite"):
        antumbra.Scene.from_arrays(vertices, [[1, 2, 4]])
