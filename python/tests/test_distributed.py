"""Studies in chunks: on threads, on workers of which one is killed, into a store that a second call goes on with."""

from __future__ import annotations

import os
import pickle
import signal
from pathlib import Path
from typing import Any

import antumbra
import antumbra.distributed
import antumbra.sun
import numpy as np
import pytest
from conftest import points_on

SUNS = np.random.default_rng(1).normal(size=(100, 3)) * [1, 1, 0] + [0, 0, 0.7]
TIMES = np.datetime64("2025-06-01T08") + np.arange(100) * np.timedelta64(1, "h")


@pytest.fixture(scope="module")
def sensors(bumps: Any) -> tuple[Any, Any]:
    points, ids, _ = points_on(*bumps, 1000, seed=31)
    return points, ids


def test_chunks_of_one_process_change_no_answer(scene: antumbra.Scene, sensors: Any) -> None:
    points, ids = sensors
    bits = antumbra.distributed.sun_visibility(scene, points, ids, suns=SUNS, chunk=77)
    assert np.array_equal(bits, antumbra.sun.sun_visibility(scene, points, ids, suns=SUNS, packed=True))
    hours = antumbra.distributed.sun_hours(scene, points, ids, suns=SUNS, times=TIMES, chunk=77)
    assert np.array_equal(hours, antumbra.sun.sun_hours(scene, points, ids, suns=SUNS, times=TIMES).hours)
    sky = antumbra.distributed.sky_view_factor(scene, points, ids, chunk=300)
    assert np.array_equal(sky, antumbra.sun.sky_view_factor(scene, points, ids))
    light = antumbra.SunDisc(90, 30, diameter_degrees=20)
    exact = antumbra.distributed.visible_fraction(scene, points[:50], light, ids[:50], samples="exact", chunk=20)
    expected, is_exact = antumbra.ShadowIndex(scene, []).exact_visible_fraction(points[:50], light, ids[:50])
    assert is_exact.any() and np.array_equal(exact[is_exact], expected[is_exact])
    assert antumbra.distributed.sun_hours(scene, points[:0], ids[:0], suns=SUNS, times=TIMES).shape == (0,)


def test_a_point_at_fault_is_named_in_its_chunk(scene: antumbra.Scene, sensors: Any) -> None:
    points, ids = sensors
    bad = points.copy()
    bad[205] += 1.0
    with pytest.raises(ValueError, match=r"chunk of 100 sensors from 200 on: .*points\[5\]"):
        antumbra.distributed.sun_visibility(scene, bad, ids, suns=SUNS, chunk=100)
    with pytest.raises(ValueError, match="give one of both"):
        antumbra.distributed.sun_visibility(scene, points, ids, suns=SUNS, client=object(), workers=2)
    with pytest.raises(ValueError, match="chunk is 0"):
        antumbra.distributed.sun_visibility(scene, points, ids, suns=SUNS, chunk=0)


def test_points_of_space_that_lie_on_surfaces_are_reported_once(scene: antumbra.Scene, bumps: Any) -> None:
    points, _, _ = points_on(*bumps, 500, seed=10)
    with pytest.warns(antumbra.AntumbraWarning, match="lie on surfaces.*Give face_ids") as caught:
        antumbra.distributed.sun_visibility(scene, points, suns=SUNS[:1], chunk=100)
    assert len(caught) == 1


def test_workers_change_no_answer(scene: antumbra.Scene, sensors: Any, client: Any) -> None:
    points, ids = sensors
    done: list[int] = []
    bits = antumbra.distributed.sun_visibility(
        scene, points, ids, suns=SUNS, client=client, chunk=50, progress=lambda stage, part, count: done.append(part)
    )
    assert np.array_equal(bits, antumbra.sun.sun_visibility(scene, points, ids, suns=SUNS, packed=True))
    assert done == sorted(done) and done[0] == 0 and done[-1] == 1000 and len(done) == 21
    light = antumbra.RectLight((0, 0, 4), (1, 0, 0), (0, 1, 0), two_sided=True)
    how: dict[str, Any] = {"samples": 32, "chunk": 300}
    shares = antumbra.distributed.visible_fraction(scene, points, light, ids, client=client, **how)
    assert np.array_equal(shares, antumbra.distributed.visible_fraction(scene, points, light, ids, **how))
    # Nothing of a study stays behind.
    plugins = client.run(lambda dask_worker: list(dask_worker.plugins))
    assert len(plugins) == 2 and not any("antumbra" in name for names in plugins.values() for name in names)


def test_errors_of_workers_are_those_of_one_process(scene: antumbra.Scene, sensors: Any, client: Any) -> None:
    points, ids = sensors
    bad = points.copy()
    bad[205] += 1.0
    with pytest.raises(ValueError, match=r"chunk of 100 sensors from 200 on: .*points\[5\]"):
        antumbra.distributed.sun_visibility(scene, bad, ids, suns=SUNS, client=client, chunk=100)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="this system kills in another way")
def test_a_killed_worker_changes_nothing(scene: antumbra.Scene, sensors: Any, client: Any, tmp_path: Path) -> None:
    points, ids = sensors
    pytest.importorskip("zarr", reason="Zarr is not installed: its stores are not tested")
    workers = client.run(os.getpid)
    assert len(workers) == 2
    killed: list[int] = []

    def kill(stage: str, done: int, count: int) -> None:
        if 0 < done < count and not killed:
            killed.append(next(iter(workers.values())))
            os.kill(killed[0], signal.SIGKILL)

    found = antumbra.distributed.sun_visibility(
        scene, points, ids, suns=SUNS, client=client, chunk=10, progress=kill, store=tmp_path / "bits.zarr"
    )
    assert killed
    assert np.array_equal(found[...], antumbra.sun.sun_visibility(scene, points, ids, suns=SUNS, packed=True))


def test_a_rerun_goes_on_where_a_call_was_stopped(
    scene: antumbra.Scene, sensors: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    zarr = pytest.importorskip("zarr", reason="Zarr is not installed: its stores are not tested")
    points, ids = sensors
    store = tmp_path / "bits.zarr"
    expected = antumbra.sun.sun_visibility(scene, points, ids, suns=SUNS, packed=True)

    class Stop(Exception):
        pass

    def stop(stage: str, done: int, count: int) -> None:
        if done >= 300:
            raise Stop

    how: dict[str, Any] = {"suns": SUNS, "times": TIMES, "chunk": 100, "store": store}
    with pytest.raises(Stop):
        antumbra.distributed.sun_visibility(scene, points, ids, progress=stop, **how)
    group = zarr.open_group(store, mode="r")
    assert group["finished_chunks"][...].tolist() == [1] * 3 + [0] * 7
    answered: list[int] = []
    from antumbra.distributed import _questions

    answer = _questions.SunBits.answer

    def counted(self: Any, index: Any, sensors: Any, begin: int, threads: int) -> Any:
        answered.append(begin)
        return answer(self, index, sensors, begin, threads)

    monkeypatch.setattr(_questions.SunBits, "answer", counted)
    found = antumbra.distributed.sun_visibility(scene, points, ids, **how)
    assert answered == list(range(300, 1000, 100))
    assert np.array_equal(found[...], expected) and found.attrs["suns"] == 100
    assert group["row"][...].tolist() == list(range(100))
    assert np.array_equal(group["time"][...].astype("datetime64[us]"), TIMES)
    # All is there: nothing is asked.
    again = antumbra.distributed.sun_visibility(scene, points, ids, **how)
    assert len(answered) == 7 and np.array_equal(again[...], expected)
    # The store's array is what radiation takes.
    suns = antumbra.sun.Suns.of(SUNS, times=TIMES)
    normals = antumbra.sun.face_normals(scene, ids)
    weather = np.full(100, 500.0)
    from_store = antumbra.sun.radiation(again, suns, weather, normals=normals)
    assert np.array_equal(from_store.direct, antumbra.sun.radiation(expected, suns, weather, normals=normals).direct)


def test_a_store_of_something_else_is_refused(scene: antumbra.Scene, sensors: Any, tmp_path: Path) -> None:
    zarr = pytest.importorskip("zarr", reason="Zarr is not installed: its stores are not tested")
    points, ids = sensors
    store = tmp_path / "hours.zarr"
    ask = antumbra.distributed.sun_hours
    how: dict[str, Any] = {"suns": SUNS, "times": TIMES, "chunk": 400, "store": store}
    hours = ask(scene, points, ids, **how)[...]
    moved = points.copy()
    moved[0, 0] = np.nextafter(moved[0, 0], 9.0)
    for others in (
        {"points": moved},
        {"suns": SUNS[::-1]},
        {"chunk": 200},
        {"step_hours": 0.5},
        {"side": "back"},
    ):
        with pytest.raises(ValueError, match="it holds another study"):
            ask(scene, others.pop("points", points), ids, **{**how, **others})
    assert np.array_equal(zarr.open_group(store, mode="r")["sun_hours"][...], hours)
    foreign = tmp_path / "foreign.zarr"
    zarr.open_group(foreign, mode="w").create_array("a", shape=(3,), dtype="uint8")
    with pytest.raises(ValueError, match="found something else"):
        ask(scene, points, ids, **{**how, "store": foreign})


def test_workers_of_this_machine_are_one_argument(scene: antumbra.Scene, sensors: Any) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed: its workers are not tested")
    points, ids = sensors
    hours = antumbra.distributed.sun_hours(scene, points, ids, suns=SUNS, times=TIMES, workers=2, chunk=250)
    assert np.array_equal(hours, antumbra.sun.sun_hours(scene, points, ids, suns=SUNS, times=TIMES).hours)


def test_suns_are_pickled() -> None:
    suns = antumbra.sun.Suns.of(SUNS, times=TIMES)
    again = pickle.loads(pickle.dumps(suns))
    assert np.array_equal(again.directions, suns.directions) and np.array_equal(again.times, suns.times)
