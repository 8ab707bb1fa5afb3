"""What the package promises: shapes, dtypes, answers."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import antumbra
import numpy as np
import pytest
from antumbra import _arrays
from conftest import LIGHTS, bumpy_sphere, points_on

# Points of surfaces are asked as points of space, too: answers are compared, whatever was meant.
pytestmark = pytest.mark.filterwarnings("ignore::antumbra.AntumbraWarning")

SQUARE = (np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], dtype=np.float64), [[0, 1, 2], [0, 2, 3]])


def test_the_example_of_the_package_works() -> None:
    """The first thing that anybody tries."""
    source = antumbra.__doc__
    assert source is not None
    code = source.split("```python\n")[1].split("```")[0]
    exec(compile(code, "antumbra.__doc__", "exec"), {})


def test_a_square_shades_what_is_under_it() -> None:
    index = antumbra.ShadowIndex(
        antumbra.Scene.from_arrays(*SQUARE), [antumbra.PointLight((0, 0, 2)), antumbra.DirectionalLight((0, 0, 1))]
    )
    points = np.array([[0, 0, -1], [1.5, 0, -1], [0, 0, 1], [0, 0, 0]], dtype=np.float32)
    assert index.occluded(points).tolist() == [True, True, False, False]
    assert index.occluded(points, 1).tolist() == [True, False, False, False]
    both = index.occluded(points, [1, 0])
    assert both.shape == (4, 2) and both.dtype == np.bool_
    assert both[:, 0].tolist() == [True, False, False, False]


def test_a_directional_light_points_towards_the_light() -> None:
    above, below = antumbra.DirectionalLight((0, 0, 1)), antumbra.DirectionalLight((0, 0, -1))
    index = antumbra.ShadowIndex(antumbra.Scene.from_arrays(*SQUARE), [above, below])
    assert index.occluded([[0, 0, -1]], [0, 1]).tolist() == [[True, False]]


def test_a_spot_is_a_point_to_shadow_queries() -> None:
    away = antumbra.SpotLight((0, 0, 2), (0, 0, 1), 10.0)
    index = antumbra.ShadowIndex(antumbra.Scene.from_arrays(*SQUARE), [away])
    assert index.occluded([[0, 0, -1], [0, 0, 1]]).tolist() == [True, False]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("refine", ["lazy", "queried", "eager"])
def test_every_method_gives_the_answers_of_the_reference(
    scene: antumbra.Scene, reference: antumbra.ShadowIndex, bumps: Any, dtype: Any, refine: Any
) -> None:
    points, ids, normals = points_on(*bumps, 400, seed=1)
    points, normals = points.astype(dtype), normals.astype(dtype)
    asked: list[dict[str, Any]] = [
        {},
        {"normals": normals},
        {"face_ids": ids},
        {"on_surface": True},
        {"on_surface": True, "normals": normals},
    ]
    expected = [reference.occluded(points, [0, 1, 2], **more) for more in asked]
    assert all(answers.any() and not answers.all() for answers in expected)
    methods = ("auto", "voxel", "bvh", "grid", "voxel-1990") if refine == "lazy" else ("auto", "voxel")
    for method in methods:
        index = antumbra.ShadowIndex(scene, LIGHTS, method=method, refine=refine, resolution=64, grid=12)  # type: ignore[arg-type]
        for more, answers in zip(asked, expected):
            assert np.array_equal(index.occluded(points, [0, 1, 2], **more), answers), (method, list(more))


def test_rounding_to_float32_does_not_make_a_surface_shade_itself(bumps: Any) -> None:
    """Points of one face: named, or looked for, they see a light over the face."""
    vertices, faces = bumps
    points, ids, normals = points_on(vertices, faces, 2000, seed=2)
    alone = antumbra.Scene.from_arrays(vertices, faces[ids[:1]])
    at = points[ids == ids[0]].astype(np.float32)
    light = antumbra.PointLight(points[0] + normals[0] / np.linalg.norm(normals[0]))
    index = antumbra.ShadowIndex(alone, [light])
    assert not index.occluded(at, face_ids=np.zeros(len(at), int)).any()
    assert not index.occluded(at, on_surface=True).any()


def test_answers_do_not_depend_on_threads_or_packing(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, _ = points_on(*bumps, 10_001, seed=3)
    expected = index.occluded(points, [2, 0], face_ids=ids, threads=1)
    for threads in (0, 2, 3):
        assert np.array_equal(index.occluded(points, [2, 0], face_ids=ids, threads=threads), expected)
        bits = index.occluded(points, [2, 0], face_ids=ids, packed=True, threads=threads)
        assert bits.dtype == np.uint8 and np.array_equal(bits, np.packbits(expected, axis=0, bitorder="little"))
    one = index.occluded(points, 0, face_ids=ids, packed=True)
    assert np.array_equal(one, np.packbits(expected[:, 1], bitorder="little"))
    assert np.array_equal(np.unpackbits(one, count=len(points), bitorder="little").view(bool), expected[:, 1])


def test_nothing_is_copied_that_fits(bumps: Any) -> None:
    for dtype in (np.float32, np.float64):
        points = bumps[0].astype(dtype)
        assert np.shares_memory(_arrays.rows("points", points), points)
    ids = np.arange(9, dtype=np.uint32)
    assert np.shares_memory(_arrays.numbers("face_ids", ids, (9,), 9, "faces"), ids)


class OnlyDlpack:
    """What speaks DLPack and nothing else, as tensors of other libraries do."""

    def __init__(self, array: Any) -> None:
        self.array = array

    def __dlpack__(self, **how: Any) -> Any:
        return self.array.__dlpack__(**how)

    def __dlpack_device__(self) -> Any:
        return self.array.__dlpack_device__()


def test_dlpack_is_taken_without_a_copy(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, _ = points_on(*bumps, 100, seed=4)
    tensor: Any = OnlyDlpack(points)
    assert np.shares_memory(_arrays.rows("points", tensor), points)
    found = index.occluded(tensor, face_ids=OnlyDlpack(ids))
    assert np.array_equal(found, index.occluded(points, face_ids=ids))


def test_any_layout_and_dtype_that_loses_nothing_is_taken(index: antumbra.ShadowIndex, bumps: Any) -> None:
    points, ids, normals = points_on(*bumps, 300, seed=5)
    points, normals = (array.astype(np.float32) for array in (points, normals))
    expected = index.occluded(points, 0, normals)
    unaligned = np.frombuffer(b"x" + points.tobytes(), np.uint8)[1:].view(np.float32).reshape(points.shape)
    assert not unaligned.flags.aligned
    frozen = points.copy()
    frozen.flags.writeable = False
    layouts = {
        "Fortran": np.asfortranarray(points),
        "every second": np.repeat(points, 2, axis=0)[::2],
        "backwards": points[::-1].copy()[::-1],
        "columns of more": np.column_stack([points, points])[:, :3],
        "big-endian": points.astype(">f4"),
        "unaligned": unaligned,
        "read-only": frozen,
        "float64": points.astype(np.float64),
        "nested lists": points.tolist(),
    }
    for name, layout in layouts.items():
        assert np.array_equal(index.occluded(layout, 0, normals), expected), name
        # One in float32, one in float64: nothing is rounded.
        assert np.array_equal(index.occluded(points, 0, normals.astype(np.float64)), expected), name
    for kind in (np.int8, np.uint16, np.int32, np.int64, np.uint64):
        fits = ids <= np.iinfo(np.int8).max
        found = index.occluded(points[fits], 0, face_ids=ids[fits].astype(kind))
        assert len(found) and np.array_equal(found, index.occluded(points, 0, face_ids=ids)[fits])
    assert index.occluded(np.array([[3, 0, 0]], dtype=np.int32)).shape == (1,)
    assert index.occluded(np.array([[3, 0, 0]], dtype=np.float16)).shape == (1,)


def test_no_points_are_no_error(index: antumbra.ShadowIndex) -> None:
    none = np.empty((0, 3), np.float32)
    assert index.occluded(none).shape == (0,)
    assert index.occluded(none, [0, 1], none).shape == (0, 2)
    assert index.occluded(none, [0, 1], packed=True).shape == (0, 2)
    assert index.occluded(none, face_ids=np.empty(0, int)).shape == (0,)
    assert index.occluded(none, on_surface=True).shape == (0,)
    assert index.occluded([[0, 0, 0]], []).shape == (1, 0)
    assert index.occluded_segments(none, none).shape == (0,)
    assert index.occluded_rays(none, none).shape == (0,)


def test_an_empty_scene_shades_nothing() -> None:
    empty = antumbra.Scene.from_arrays(np.empty((0, 3)), [])
    assert empty.surface_count == 0 and empty.bounds is None
    index = antumbra.ShadowIndex(empty, [antumbra.PointLight((0, 0, 1))])
    assert index.occluded([[0, 0, 0]]).tolist() == [False]
    assert index.occluded_segments([[0, 0, 0]], [[1, 1, 1]]).tolist() == [False]
    assert "0 surfaces" in repr(empty)


def test_segments_are_open_at_both_ends() -> None:
    index = antumbra.ShadowIndex(antumbra.Scene.from_arrays(*SQUARE), [])
    a = [[0.5, 0.2, -1.0], [0.5, 0.2, 0.0], [0.5, 0.2, -1.0], [0.5, 0.2, -1.0], [1.0, 1.0, -1.0]]
    b = [[0.5, 0.2, 1.0], [0.5, 0.2, 1.0], [0.5, 0.2, 0.0], [0.5, 0.2, -0.5], [1.0, 1.0, 1.0]]
    assert index.occluded_segments(a, b).tolist() == [True, False, False, False, True]
    directions = np.subtract(b, a)
    # A ray goes on beyond the end.
    assert index.occluded_rays(a, directions).tolist() == [True, False, True, True, True]
    assert index.occluded_rays(a, np.zeros((5, 3))).tolist() == [False] * 5


def test_a_segment_is_a_query_with_a_light_of_its_own(
    index: antumbra.ShadowIndex, reference: antumbra.ShadowIndex, bumps: Any
) -> None:
    points, ids, _ = points_on(*bumps, 500, seed=6)
    position = np.array([2.0, -3.0, 4.0])
    ends = np.broadcast_to(position, points.shape)
    for more in ({}, {"face_ids": ids}):
        expected = index.occluded(points, 0, **more)  # type: ignore[arg-type]
        assert np.array_equal(index.occluded_segments(points, ends, **more), expected)
        assert np.array_equal(reference.occluded_segments(points, ends, **more), expected)
        towards = np.broadcast_to(np.array([0.3, 0.2, -1.0]), points.shape)
        assert np.array_equal(index.occluded_rays(points, towards, **more), index.occluded(points, 1, **more))  # type: ignore[arg-type]


def test_counts_add_up(scene: antumbra.Scene, bumps: Any) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS, method="voxel", refine="eager", resolution=64)
    points, ids, normals = points_on(*bumps, 1000, seed=7)
    blocked = index.occluded(points, [0, 1], normals).sum() + index.occluded(points, face_ids=ids).sum()
    stats = index.stats()
    assert stats["queries"] == 3000 and stats["shadowed"] == blocked
    parts = ("facing_away", "first_pass", "intermediate", "blocker_list", "rays")
    assert sum(stats[part] for part in parts) == 3000  # type: ignore[literal-required]
    assert stats["facing_away"] > 0 and stats["first_pass"] > 0 and stats["value_bytes"] > 0
    assert stats["method"] == "voxel" and stats["surfaces"] == len(bumps[1]) and stats["lights"] == 3
    assert "3 lights, voxel" in repr(index)


def test_lights_are_values() -> None:
    index = antumbra.ShadowIndex(antumbra.Scene.from_arrays(*SQUARE), LIGHTS)
    assert index.lights[:2] == LIGHTS[:2]
    spot = index.lights[2]
    assert isinstance(spot, antumbra.SpotLight) and abs(spot.half_angle_degrees - 20.0) < 1e-9
    assert pickle.loads(pickle.dumps(LIGHTS)) == LIGHTS
    assert antumbra.PointLight(np.array([1, 2, 3])) == antumbra.PointLight((1.0, 2.0, 3.0))
    assert hash(LIGHTS[0]) == hash(antumbra.PointLight([2.0, -3.0, 4.0]))


def test_a_scene_is_that_of_the_file_it_was_written_to(tmp_path: Path) -> None:
    vertices, faces = bumpy_sphere(6)
    path = tmp_path / "bumps.obj"
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += ["f " + " ".join(str(vertex + 1) for vertex in face) for face in faces.tolist()]
    path.write_text("\n".join(lines) + "\n")
    loaded, made = antumbra.Scene.load(path), antumbra.Scene.from_arrays(vertices, faces)
    assert np.array_equal(loaded.triangles(), made.triangles())
    assert np.array_equal(made.triangles(), vertices[faces])
    assert np.array_equal(made.bounds, [vertices.min(axis=0), vertices.max(axis=0)])
    assert loaded.lights == [] and loaded.warnings == []
    assert made.surface_count == made.triangle_count == len(faces)


def test_lights_of_a_file_are_taken_by_default(tmp_path: Path) -> None:
    path = tmp_path / "one.nff"
    path.write_text("l 0 0 5\nf 1 1 1 1 0 0 0 1\np 3\n-1 -1 1\n1 -1 1\n0 1 1\ns 0 0 3 0.5\n")
    with pytest.warns(antumbra.AntumbraWarning, match="no view"):
        scene = antumbra.Scene.load(path)
    assert scene.surface_count == 2 and scene.triangle_count == 1
    index = antumbra.ShadowIndex(scene)
    assert [light.position for light in index.lights if isinstance(light, antumbra.PointLight)] == [(0.0, 0.0, 5.0)]
    assert index.occluded([[0, 0, 0], [0, 0, 4], [0, 0, 2]]).tolist() == [True, False, True]
