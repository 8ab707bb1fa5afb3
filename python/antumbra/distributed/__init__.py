"""Studies past one machine's memory or patience: chunks of sensors, on threads or on a Dask cluster, kept in a Zarr store; and
tiles of pictures.

```python
hours = antumbra.distributed.sun_hours(scene, points, face_ids, suns=suns, workers=4, store="hours.zarr")
hours = antumbra.distributed.sun_hours(scene, points, face_ids, suns=suns, client=Client("tcp://scheduler:8786"))
```

| who answers | argument |
|---|---|
| this process, on its threads | none: Dask need not be installed |
| processes of this machine | `workers=4` |
| any cluster | `client=` a `distributed.Client` |

Each worker gets the scene once and makes its own index. The client cuts the sensors into chunks, hands out a few for each
thread, and writes what comes back. Answers are those of one process, bit by bit, for any number of workers; a chunk whose
worker is killed goes to another.

With `store=` each chunk is written where it comes back, then a marker for it. A call that was stopped goes on where it was
when it is made again: it asks only for chunks without a marker. A store of another study is refused.

`render` cuts a picture into tiles in the same way, without a store.

Needs `pip install "antumbra[dask]"` for workers, clients and stores.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .._arrays import thread_count, whole
from .._progress import Progress, reporter
from .._warning import warn_of_surfaces
from ..area import AreaLight, Side, area_tuple_of
from ..index import ShadowIndex
from ..scene import Scene, SceneLike, scene_of
from ..sun._sensors import Sensors, checked_sensors, unit_normals
from ..sun._sky import sky_patches
from ..sun._suns import Up, suns_in, up_of
from ..sun._times import step_lengths
from ._pictures import render
from ._questions import ChunkWork, LightShare, Question, SkyShare, SunBits, SunSums, fingerprint
from ._run import answers_of, check_workers
from ._store import Store

__all__ = ["render", "sky_view_factor", "sun_hours", "sun_visibility", "visible_fraction"]

CHUNK = 32768
"""Sensors of a chunk: seconds of work for a year of hours, and half a mebibyte to send."""


def sun_visibility(
    scene: SceneLike | ShadowIndex,
    points: Any,
    face_ids: Any = None,
    *,
    normals: Any = None,
    side: Side = "front",
    tolerance: float | None = None,
    suns: Any,
    times: Any = None,
    north: float = 0.0,
    up: Up | None = None,
    refraction: bool = False,
    store: Any = None,
    client: Any = None,
    workers: int | None = None,
    chunk: int = CHUNK,
    threads: int = 0,
    progress: Progress = None,
) -> Any:
    """Answers as `antumbra.sun.sun_visibility` does with `packed=True`, chunk by chunk.

    Args:
        scene: As of `ShadowIndex`, or one, of which the surfaces are taken.
        points: As of `antumbra.sun.sun_visibility`, like all that are not named below.
        face_ids: Surfaces that the sensors lie on.
        normals: Normals of points of space.
        side: Side of the surface.
        tolerance: How far points may be from their faces.
        suns: The suns.
        times: Times of the suns.
        north: Degrees from the scene's north axis to north.
        up: Axis that points up.
        refraction: Which elevations of a table are taken.
        store: A path, URL or store of Zarr that answers are written to; `None` keeps them in memory.
        client: A `distributed.Client`; `None` for this process, or `workers`.
        workers: Number of processes of this machine to start for this call, with one thread each. They import the script
            that calls: put what it does below `if __name__ == "__main__":`.
        chunk: Sensors that are answered together, 1 or more.
        threads: Threads of a chunk; 0 for one a processor in this process, and one on a worker.
        progress: As of `ShadowIndex`: called with the sensors that are done.

    Returns:
        Bits, uint8, shape (n, bytes): an array of NumPy, or with `store` the array of Zarr `sun_visibility`, beside which
        lie `row`, the suns' rows of the input, and with times `time`.

    Raises:
        ValueError: As of `antumbra.sun.sun_visibility`; of a point that is at fault the message names the chunk and the row
            in it; or the store holds something else.
        ImportError: Zarr or Dask is needed and not installed.
    """
    scene = _scene_of(scene)
    used = suns_in(scene, suns, times, north, up, refraction)
    sensors = checked_sensors(scene, points, face_ids, normals, side, tolerance)
    beside: dict[str, npt.NDArray[Any]] = {"row": used.rows}
    if used._times is not None:
        beside["time"] = used._times.moments[used.rows].astype(np.int64)
    attributes = used._attributes()
    if used._times is not None:
        attributes["time_units"] = "microseconds since 1970-01-01, UTC where times have a zone"
    question = SunBits(used.directions)
    return _answer(scene, question, sensors, store, client, workers, chunk, threads, progress, attributes, beside)


def sun_hours(
    scene: SceneLike | ShadowIndex,
    points: Any,
    face_ids: Any = None,
    *,
    normals: Any = None,
    side: Side = "front",
    tolerance: float | None = None,
    suns: Any,
    times: Any = None,
    step_hours: Any = None,
    north: float = 0.0,
    up: Up | None = None,
    refraction: bool = False,
    store: Any = None,
    client: Any = None,
    workers: int | None = None,
    chunk: int = CHUNK,
    threads: int = 0,
    progress: Progress = None,
) -> Any:
    """Answers as `antumbra.sun.sun_hours` does, hours alone, chunk by chunk.

    Arguments, errors and the store are those of `sun_visibility` here; `step_hours` is that of `antumbra.sun.sun_hours`.

    Returns:
        Hours, float64, shape (n,): an array of NumPy, or with `store` the array of Zarr `sun_hours`.
    """
    scene = _scene_of(scene)
    used = suns_in(scene, suns, times, north, up, refraction)
    sensors = checked_sensors(scene, points, face_ids, normals, side, tolerance)
    weights = step_lengths(used._times, used.count, step_hours)[used.rows]
    question = SunSums(used.directions, weights)
    attributes = {**used._attributes(), "units": "hours"}
    return _answer(scene, question, sensors, store, client, workers, chunk, threads, progress, attributes, {})


def sky_view_factor(
    scene: SceneLike | ShadowIndex,
    points: Any,
    face_ids: Any = None,
    *,
    normals: Any = None,
    side: Side = "front",
    tolerance: float | None = None,
    subdivision: int = 1,
    up: Up | None = None,
    store: Any = None,
    client: Any = None,
    workers: int | None = None,
    chunk: int = CHUNK,
    threads: int = 0,
    progress: Progress = None,
) -> Any:
    """Answers as `antumbra.sun.sky_view_factor` does, chunk by chunk.

    Arguments, errors and the store are those of `sun_visibility` here; `subdivision` is that of `antumbra.sun.sky_patches`.

    Returns:
        Shares, float64, shape (n,): an array of NumPy, or with `store` the array of Zarr `sky_view_factor`.
    """
    scene = _scene_of(scene)
    sensors = checked_sensors(scene, points, face_ids, normals, side, tolerance)
    # What is refused is refused here, not on a worker.
    unit_normals(scene, sensors.part(0, 1))
    up = up or up_of(scene)
    sky = sky_patches(subdivision, up=up)
    question = SkyShare(sky.directions, sky.fluxes, (0.0, 0.0, 1.0) if up == "z" else (0.0, 1.0, 0.0))
    attributes = {"patches": len(sky)}
    return _answer(scene, question, sensors, store, client, workers, chunk, threads, progress, attributes, {})


def visible_fraction(
    scene: SceneLike | ShadowIndex,
    points: Any,
    light: AreaLight,
    face_ids: Any = None,
    *,
    normals: Any = None,
    side: Side = "front",
    tolerance: float | None = None,
    samples: int | Literal["exact"] = 64,
    seed: int = 0,
    store: Any = None,
    client: Any = None,
    workers: int | None = None,
    chunk: int = CHUNK,
    threads: int = 0,
    progress: Progress = None,
) -> Any:
    """Answers as `ShadowIndex.visible_fraction` does, chunk by chunk: a light map of a light with size, texel by texel.

    Samples depend on a point's row in its chunk and on the chunk, so on `chunk`, but not on workers. With `"exact"` they play
    no part where there is a closed form. Arguments, errors and the store are those of `sun_visibility` here.

    Returns:
        Shares, float64, shape (n,): an array of NumPy, or with `store` the array of Zarr `visible_fraction`.
    """
    scene = _scene_of(scene)
    sensors = checked_sensors(scene, points, face_ids, normals, side, tolerance)
    area_tuple_of(light, scene)
    question = LightShare(light, samples, whole("seed", seed, 0, 2**64 - 1))
    return _answer(scene, question, sensors, store, client, workers, chunk, threads, progress, {}, {})


def _scene_of(scene: SceneLike | ShadowIndex) -> Scene:
    """Returns surfaces: what an index knows of its lights plays no part here."""
    return scene.scene if isinstance(scene, ShadowIndex) else scene_of(scene)


def _answer(
    scene: Scene,
    question: Question,
    sensors: Sensors,
    place: Any,
    client: Any,
    workers: int | None,
    chunk: int,
    threads: int,
    progress: Progress,
    attributes: dict[str, Any],
    beside: dict[str, npt.NDArray[Any]],
) -> Any:
    """Answers all chunks that are not answered yet."""
    threads = thread_count(threads)
    chunk = whole("chunk", chunk, 1, 2**31)
    to = reporter(progress)
    workers = check_workers(client, workers)
    count = len(sensors)
    if sensors.face_ids is None and not isinstance(question, LightShare):
        # Workers cannot warn a caller.
        index = ShadowIndex(scene, [], threads=threads)
        warn_of_surfaces("points", index._native.suspicious_share(sensors.points), "face_ids")
    numbers = np.arange(-(-count // chunk))
    store = None
    found: npt.NDArray[Any] | None = None
    if place is None:
        shape = (count,) if question.columns is None else (count, question.columns)
        found = np.empty(shape, question.dtype)
    else:
        store = Store(place, question, count, chunk, fingerprint(scene, question, sensors, chunk))
        store.note(attributes, beside)
        numbers = store.missing()
    parts = ((int(n), (int(n) * chunk, sensors.part(int(n) * chunk, (int(n) + 1) * chunk))) for n in numbers)
    done = count - sum(min(chunk, count - int(n) * chunk) for n in numbers)
    if to is not None:
        to("sensors", done, count)
    with answers_of(ChunkWork(scene, question), parts, len(numbers), client, workers, threads) as answers:
        for number, rows in answers:
            begin = number * chunk
            if store is not None:
                store.write(number, rows)
            if found is not None:
                found[begin : begin + len(rows)] = rows
            done += len(rows)
            if to is not None:
                to("sensors", done, count)
    return found if store is None else store.answers
