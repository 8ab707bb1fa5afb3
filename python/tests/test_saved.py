"""Values that are kept in files."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import antumbra
import numpy as np
import pytest
from conftest import LIGHTS, points_on

# Points of surfaces are asked as points of space, too: answers are compared, whatever was meant.
pytestmark = pytest.mark.filterwarnings("ignore::antumbra.AntumbraWarning")


@pytest.fixture(scope="module")
def file(scene: antumbra.Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Values of the first two lights."""
    path = tmp_path_factory.mktemp("kept") / "bumps.antumbra"
    index = antumbra.ShadowIndex(scene, LIGHTS[:2], method="voxel", refine="eager", resolution=64)
    assert index.save(path) == path.stat().st_size > 0
    return path


def test_a_loaded_index_answers_as_one_that_was_made(
    scene: antumbra.Scene, reference: antumbra.ShadowIndex, bumps: Any, file: Path
) -> None:
    points, ids, _ = points_on(*bumps, 2000, seed=11)
    index = antumbra.ShadowIndex.load(file, scene, LIGHTS[:2], resolution=64)
    assert index.saved_lights == ["loaded", "loaded"]
    found = index.occluded(points, [0, 1], face_ids=ids)
    assert np.array_equal(found, reference.occluded(points, [0, 1], face_ids=ids))
    stats = index.stats()
    # Known from the file: a lazy index that has just been made would trace rays.
    assert stats["rays"] < 0.1 * stats["queries"] < stats["first_pass"] + stats["blocker_list"]
    assert antumbra.ShadowIndex(scene, LIGHTS[:2], resolution=64).saved_lights == []


def test_a_moved_light_is_made_anew(
    scene: antumbra.Scene, reference: antumbra.ShadowIndex, bumps: Any, file: Path
) -> None:
    moved = [LIGHTS[1], LIGHTS[2]]
    index = antumbra.ShadowIndex(scene, moved, resolution=64, occlusion=file)
    assert index.saved_lights == ["loaded", "absent"]
    points, ids, _ = points_on(*bumps, 500, seed=12)
    assert np.array_equal(
        index.occluded(points, [0, 1], face_ids=ids), reference.occluded(points, [1, 2], face_ids=ids)
    )


def test_power_and_colour_play_no_part(scene: antumbra.Scene, file: Path) -> None:
    dim = [antumbra.PointLight((2.0, -3.0, 4.0), colour=(0.1, 0, 0), falls_off=True)]
    assert antumbra.ShadowIndex(scene, dim, resolution=64, occlusion=file).saved_lights == ["loaded"]


def test_a_file_that_does_not_fit_is_refused_with_the_reason(scene: antumbra.Scene, bumps: Any, file: Path, tmp_path: Path) -> None:
    def refused(kind: type[Exception], path: Path, of: antumbra.Scene = scene, **how: Any) -> str:
        with pytest.raises(kind) as error:
            antumbra.ShadowIndex(of, LIGHTS[:2], occlusion=path, **{"resolution": 64, **how})
        assert path.name in str(error.value)
        return str(error.value)

    vertices, faces = bumps
    changed = vertices.copy()
    changed[7, 2] = np.nextafter(changed[7, 2], 9.0)
    refused(ValueError, file, antumbra.Scene.from_arrays(changed, faces))
    refused(ValueError, file, resolution=128)
    refused(ValueError, file, method="bvh")
    refused(OSError, tmp_path / "none.antumbra")
    whole = file.read_bytes()
    for name, content in {
        "empty": b"",
        "foreign": b"PK\x03\x04" + whole[4:],
        "cut": whole[:-1],
        "longer": whole + b"\0",
        "flipped": whole[: len(whole) // 2] + bytes([whole[len(whole) // 2] ^ 1]) + whole[len(whole) // 2 + 1 :],
    }.items():
        path = tmp_path / f"{name}.antumbra"
        path.write_bytes(content)
        refused(ValueError, path)


def test_what_cannot_be_saved_is_said(scene: antumbra.Scene, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="keeps nothing"):
        antumbra.ShadowIndex(scene, LIGHTS, method="bvh").save(tmp_path / "a.antumbra")
    with pytest.raises(OSError, match=r"a\.antumbra"):
        antumbra.ShadowIndex(scene, LIGHTS, resolution=64).save(tmp_path / "missing" / "a.antumbra")


def test_a_picture_takes_values_from_a_file(scene: antumbra.Scene, file: Path) -> None:
    how: dict[str, Any] = {"lights": LIGHTS[:2], "size": (24, 24), "resolution": 64}
    from_file, made = antumbra.render(scene, **how, occlusion=file), antumbra.render(scene, **how)
    assert np.array_equal(from_file.colour, made.colour)
    assert from_file.counts["rays"] < made.counts["rays"]


def test_a_volume_says_what_is_known(scene: antumbra.Scene, reference: antumbra.ShadowIndex) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS[:2], method="voxel", refine="eager", resolution=64)
    volume = index.volume(16)
    assert volume is not None and volume.values.dtype == np.uint8
    assert volume.values.ndim == 4 and volume.values.shape[3] == 2
    # Cubes lie in a lattice that is larger than the scene.
    assert 8 <= max(volume.values.shape[:3]) <= 17
    assert set(np.unique(volume.values)) == {antumbra.Volume.LIT, antumbra.Volume.SHADOWED, antumbra.Volume.MIXED}
    # What is said of a cube holds for its points.
    cells = np.argwhere(np.ones(volume.values.shape[:3], bool))
    points = volume.lowest + volume.edge * (cells + np.random.default_rng(1).random(cells.shape))
    known = volume.values.reshape(-1, 2)
    truth = reference.occluded(points, [0, 1])
    assert not truth[known == antumbra.Volume.LIT].any()
    assert truth[known == antumbra.Volume.SHADOWED].all()
    assert antumbra.ShadowIndex(scene, LIGHTS, method="bvh").volume() is None
    with pytest.raises(ValueError, match="resolution is 2000: expected 1 to 1024"):
        index.volume(2000)


def test_nothing_but_a_file_of_values_is_replaced(scene: antumbra.Scene, tmp_path: Path) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS[:1], resolution=64)
    other = tmp_path / "scene.obj"
    other.write_text("v 0 0 0\n")
    with pytest.raises(ValueError, match="is not replaced"):
        index.save(other)
    assert other.read_text() == "v 0 0 0\n"
    empty = tmp_path / "empty.antumbra"
    empty.touch()
    assert index.save(empty) > 0
    assert index.save(empty) > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty.antumbra", "scene.obj"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no pipes with names")
def test_a_pipe_in_place_of_a_file_is_refused_at_once(scene: antumbra.Scene, tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.obj"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="no regular file"):
        antumbra.ShadowIndex(scene, LIGHTS[:1], resolution=64, occlusion=pipe)
    with pytest.raises(ValueError, match="not a regular file"):
        antumbra.Scene.load(pipe)


@pytest.mark.skipif(os.name != "posix", reason="links need rights elsewhere")
def test_a_link_is_not_written_to(scene: antumbra.Scene, tmp_path: Path) -> None:
    index = antumbra.ShadowIndex(scene, LIGHTS[:1], resolution=64)
    target = tmp_path / "target.antumbra"
    link = tmp_path / "link.antumbra"
    link.symlink_to(target)
    with pytest.raises(OSError, match="symbolic link"):
        index.save(link)
    assert link.is_symlink() and not target.exists()


def test_a_path_may_be_bytes_as_the_system_has_it(scene: antumbra.Scene, tmp_path: Path) -> None:
    path: Any = os.fsencode(tmp_path / "a.antumbra")
    antumbra.ShadowIndex(scene, LIGHTS[:1], resolution=8).save(path)
    assert antumbra.ShadowIndex.load(path, scene, LIGHTS[:1], resolution=8).saved_lights == ["loaded"]
