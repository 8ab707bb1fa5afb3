"""Which suns each sensor sees.

In: a scene, sensors, suns. Out: a bool or a bit a pair; with times, an array of xarray with its coordinates.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from .._arrays import thread_count
from .._progress import Progress, reporter
from ..area import Side
from ..index import ShadowIndex
from ..scene import SceneLike
from . import _bits
from ._sensors import index_of, sensors_of
from ._suns import Suns, Up, suns_in


@overload
def sun_visibility(
    scene_or_index: SceneLike | ShadowIndex,
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
    packed: Literal[False] = False,
    as_xarray: bool | Literal["auto"] = "auto",
    threads: int = 0,
    progress: Progress = None,
) -> Any: ...


@overload
def sun_visibility(
    scene_or_index: SceneLike | ShadowIndex,
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
    packed: Literal[True],
    as_xarray: bool | Literal["auto"] = "auto",
    threads: int = 0,
    progress: Progress = None,
) -> npt.NDArray[np.uint8]: ...


def sun_visibility(
    scene_or_index: SceneLike | ShadowIndex,
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
    packed: bool = False,
    as_xarray: bool | Literal["auto"] = "auto",
    threads: int = 0,
    progress: Progress = None,
) -> Any:
    """Answers for each sensor and sun whether the sensor sees the middle of the sun.

    It does where nothing opaque is between them, and the sun is strictly on the side that the sensor looks to, by the
    exact sign. Each answer is that of a shadow query to a light from that direction.

    Args:
        scene_or_index: A `ShadowIndex`, or whatever it can be made of; lights play no part.
        points: Sensors, shape (n, 3), float32 or float64, world space, finite. Without `face_ids` they are points of
            space: an `AntumbraWarning` says it where many lie on surfaces.
        face_ids: Shape (n,), integers: the surfaces that the sensors lie on, up to rounding.
        normals: Shape (n, 3), any length: points of space that look to one side; zero sees nothing. Points of space without
            normals look all around.
        side: For sensors with `face_ids`: the side of the surface that they look to, `"front"` as its winding says,
            `"back"`, or `"both"`.
        tolerance: With `face_ids`: how far points may be from their faces, as of `occluded_on_faces`.
        suns: `Suns`, or whatever `Suns.of` takes: a table of `pvlib`, a tuple of azimuths and elevations in degrees, or
            directions of shape (n, 3).
        times: As of `Suns.of`.
        north: As of `Suns.of`.
        up: As of `Suns.of`; by default the scene's up, with a warning where its file does not say it.
        refraction: As of `Suns.of`.
        packed: Whether to return bits.
        as_xarray: `"auto"` returns an `xarray.DataArray` if there are times, `packed` is false and xarray is installed;
            `True` always, `False` never.
        threads: Threads that work; 0 for one a processor. Answers do not depend on them.
        progress: As of `ShadowIndex`.

    Returns:
        True where a sun is seen: bool, shape (n, suns), for the suns above the horizon in their order, which are the rows
        `Suns.of(...).rows` of the input. With `packed` uint8, eight suns a byte, the first in the lowest bit: the bytes of
        `np.packbits(answers, axis=1, bitorder="little")`. A `DataArray` has dimensions `sensor` and `time` (`sun` without
        times), coordinates `time` and `row`, and says in its attributes how many suns were left out below the horizon.

    Memory beside the result is at most 512 MiB, and the index.

    Raises:
        ValueError: As of `Suns.of`; a shape does not fit, a number is not finite, or a point is not on the face that it
            names.
        TypeError: A dtype does not fit.
        IndexError: A face does not exist.
        ImportError: xarray is asked for and not installed.
    """
    threads = thread_count(threads)
    if packed and as_xarray is True:
        raise ValueError("packed: an array of xarray has an answer an entry; give packed=False or as_xarray=False")
    index = index_of(scene_or_index, threads)
    sensors = sensors_of(index, points, face_ids, normals, side, tolerance)
    used = suns_in(index.scene, suns, times, north, up, refraction)
    to = reporter(progress)
    count, sun_count = len(sensors), len(used)
    found: npt.NDArray[Any]
    found = np.empty((count, _bits.width(sun_count)), np.uint8) if packed else np.empty((count, sun_count), np.bool_)
    for begin, end in _bits.chunks(count, sun_count):
        bits = _bits.lit_bits(index, sensors, used.directions, begin, end, threads)
        found[begin:end] = bits if packed else _bits.unpacked(bits, sun_count)
        _bits.report(to, end, count)
    is_wanted = as_xarray is True or as_xarray == "auto" and used.times is not None and not packed
    if not is_wanted or as_xarray == "auto" and importlib.util.find_spec("xarray") is None:
        return found
    return _labeled(found, used)


def _labeled(found: npt.NDArray[Any], suns: Suns) -> Any:
    """Returns answers as an array of xarray."""
    try:
        xarray = importlib.import_module("xarray")
    except ImportError as error:
        raise ImportError('as_xarray needs the package xarray: pip install "antumbra[sun]"') from error
    axis = "sun" if suns.times is None else "time"
    coordinates: dict[str, Any] = {"row": (axis, suns.rows)}
    if suns.times is not None:
        times = suns.times if hasattr(suns.times, "__array__") else np.asarray(suns.times)
        if hasattr(times, "iloc"):
            times = times.iloc[suns.rows].array
        else:
            times = times[suns.rows]
        coordinates["time"] = (axis, times)
    return xarray.DataArray(
        found, dims=("sensor", axis), coords=coordinates, name="sun_visibility", attrs=suns._attributes()
    )
