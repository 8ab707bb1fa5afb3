"""Windows of pictures, and pictures in tiles: on threads, and on workers of which one is killed."""

from __future__ import annotations

import base64
import json
import os
import signal
import struct
from pathlib import Path
from typing import Any

import antumbra
import antumbra.distributed
import numpy as np
import pytest

SIZE = (75, 52)
LAMP = antumbra.PointLight((2.0, -3.0, 4.0), name="lamp")
LIGHTS = [LAMP, antumbra.RectLight((-2, -2, 4), (1, 0, 0), (0, 1, 0), two_sided=True)]
HOW: dict[str, Any] = {"lights": LIGHTS, "size": SIZE, "samples": 3, "light_samples": 7, "seed": 5, "fog": 0.1}


@pytest.fixture(scope="module")
def picture(scene: antumbra.Scene) -> antumbra.Picture:
    """The whole picture, of one process."""
    return antumbra.render(scene, **HOW)


def assert_same(found: antumbra.Picture, whole: antumbra.Picture, window: tuple[int, int, int, int] = (0, 0, *SIZE)) -> None:
    """Compares all but how queries were decided."""
    x0, y0, x1, y1 = window
    for name in ("color", "shadow", "fog", "transmittance"):
        part, all_of_it = getattr(found, name), getattr(whole, name)
        expected = all_of_it[:, y0:y1, x0:x1] if name == "shadow" else all_of_it[y0:y1, x0:x1]
        assert part.dtype == expected.dtype and np.array_equal(part, expected), name
    assert found.light_names == whole.light_names


def assert_same_work(found: antumbra.Picture, whole: antumbra.Picture) -> None:
    """Compares what does not depend on what an index had learned."""
    for name in ("primary", "primary_hits", "queries", "facing_away", "out_of_cone", "shadowed"):
        assert found.counts[name] == whole.counts[name] > 0 or name == "out_of_cone", name
    assert found.decided.keys() == whole.decided.keys()
    assert np.allclose(sum(found.decided.values()), sum(whole.decided.values()))


def test_a_window_has_the_pixels_of_the_whole_picture(scene: antumbra.Scene, picture: antumbra.Picture) -> None:
    assert len(np.unique(picture.color.reshape(-1, 3), axis=0)) > 1000 and 0.0 < picture.shadow.mean() < 1.0
    for window in ((0, 0, *SIZE), (20, 11, 61, 40), (74, 51, 75, 52), (0, 30, 75, 31)):
        found = antumbra.render(scene, window=window, **HOW)
        assert found.color.shape == (window[3] - window[1], window[2] - window[0], 3)
        assert_same(found, picture, window)
    # The camera frames the whole picture, whatever the window is.
    plain: dict[str, Any] = {"lights": [LAMP], "size": (40, 20)}
    left = antumbra.render(scene, window=(0, 0, 20, 20), **plain)
    assert np.array_equal(left.color, antumbra.render(scene, **plain).color[:, :20])


@pytest.mark.parametrize(
    ("window", "message"),
    [
        ((0, 0, 76, 52), "window is 76: expected 0 to 75"),
        ((0, -1, 75, 52), "window is -1: expected 0 to 52"),
        ((5, 0, 5, 52), "expected x0 < x1 and y0 < y1"),
        ((5, 9, 6, 8), "expected x0 < x1 and y0 < y1"),
        ((5, 9), r"found shape \(2,\)"),
        (7, r"found shape \(\)"),
    ],
)
def test_what_is_no_window_is_refused(scene: antumbra.Scene, window: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        antumbra.render(scene, window=window, **HOW)


def test_tiles_of_one_process_change_no_pixel(scene: antumbra.Scene, picture: antumbra.Picture) -> None:
    done: list[int] = []
    for tile in (16, 50, 512):
        found = antumbra.distributed.render(scene, tile=tile, progress=lambda _, part, count: done.append(part), **HOW)
        assert_same(found, picture)
        assert_same_work(found, picture)
    assert done[0] == 0 and done[20] == 75 * 52 and len(done) == 21 + 5 + 2
    for bad, message in (
        ({"tile": 7}, "tile is 7: expected 8 to 16384"),
        ({"client": object(), "workers": 2}, "give one of both"),
        ({"workers": 0}, "workers is 0"),
        ({"samples": 0}, "samples is 0"),
    ):
        with pytest.raises(ValueError, match=message):
            antumbra.distributed.render(scene, **{**HOW, **bad})


def test_a_scene_without_lights_has_a_sun_in_every_tile(scene: antumbra.Scene) -> None:
    found = antumbra.distributed.render(scene, size=(30, 20), tile=10)
    assert np.array_equal(found.color, antumbra.render(scene, size=(30, 20)).color)
    assert found.fog is None and found.transmittance is None and found.stops == 0.0


def test_exposure_is_that_of_the_whole_picture(tmp_path: Path) -> None:
    """Light in candela: a picture is metered."""
    corners = [(-2, 0, 2), (2, 0, 2), (2, 0, -2), (-2, 0, -2)]
    data = struct.pack("<12f6H", *(x for corner in corners for x in corner), 0, 1, 2, 0, 2, 3)
    extension = "KHR_lights_punctual"
    model = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [extension],
        "extensions": {extension: {"lights": [{"type": "point", "intensity": 900}]}},
        "buffers": [{"byteLength": 60, "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-2, 0, -2], "max": [2, 0, 2]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}, {"translation": [0.5, 1.5, 0], "extensions": {extension: {"light": 0}}}],
        "scenes": [{"nodes": [0, 1]}],
        "scene": 0,
    }
    file = tmp_path / "lit.gltf"
    file.write_text(json.dumps(model))
    scene = antumbra.Scene.load(file)
    whole = antumbra.render(scene, size=(60, 40))
    assert whole.stops != 0.0
    found = antumbra.distributed.render(scene, size=(60, 40), tile=16)
    assert found.stops == whole.stops
    found.save_png(tmp_path / "tiles.png")
    whole.save_png(tmp_path / "whole.png")
    assert (tmp_path / "tiles.png").read_bytes() == (tmp_path / "whole.png").read_bytes()
    assert antumbra.render(scene, size=(60, 40), window=(0, 0, 30, 20)).stops != whole.stops


def test_workers_change_no_pixel(scene: antumbra.Scene, picture: antumbra.Picture, client: Any, tmp_path: Path) -> None:
    found = antumbra.distributed.render(scene, tile=16, client=client, **HOW)
    assert_same(found, picture)
    assert_same_work(found, picture)
    plugins = client.run(lambda dask_worker: list(dask_worker.plugins))
    assert len(plugins) == 2 and not any("antumbra" in name for names in plugins.values() for name in names)
    # Values that a file has are read where tiles are rendered.
    known = tmp_path / "known.antumbra"
    antumbra.ShadowIndex(scene, [LAMP], refine="eager", method="voxel", resolution=64).save(known)
    how = {**HOW, "lights": [LAMP], "fog": None, "method": "voxel", "resolution": 64, "occlusion": known}
    from_file = antumbra.distributed.render(scene, tile=32, client=client, **how)
    assert np.array_equal(from_file.color, antumbra.render(scene, **how).color)
    with pytest.raises(OSError, match="absent: cannot be read"):
        antumbra.distributed.render(scene, client=client, **{**how, "occlusion": tmp_path / "absent"})


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system kills in another way")
def test_a_killed_worker_changes_no_pixel(scene: antumbra.Scene, picture: antumbra.Picture, client: Any) -> None:
    workers = client.run(os.getpid)
    assert len(workers) == 2
    killed: list[int] = []

    def kill(stage: str, done: int, count: int) -> None:
        if 0 < done < count and not killed:
            killed.append(next(iter(workers.values())))
            os.kill(killed[0], signal.SIGKILL)

    found = antumbra.distributed.render(scene, tile=8, client=client, progress=kill, **HOW)
    assert killed
    assert_same(found, picture)
    assert_same_work(found, picture)


def test_workers_of_this_machine_are_one_argument(scene: antumbra.Scene, picture: antumbra.Picture) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed: its workers are not tested")
    assert_same(antumbra.distributed.render(scene, tile=40, workers=2, **HOW), picture)
