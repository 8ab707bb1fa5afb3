"""Energy that sensors get from sun and sky.

In: bits of sensors and suns, weather. Out: `Radiation`. Invariant: nothing is asked of a scene, so other weather costs sums
alone.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._arrays import as_array, rows, thread_count
from . import _bits
from ._sensors import units
from ._suns import Suns
from ._times import step_lengths

BEHIND = -0.01
"""Cosines below this are no rounding, neither of a sun in a sensor's plane nor of a narrow face's normal."""

LOOKED_AT = 16
"""Sensors of a chunk whose suns are looked at."""


@dataclass(frozen=True, eq=False)
class Radiation:
    """Energy on sensors, kWh/m2, float64.

    Attributes:
        direct: From the sun, shape (n,).
        diffuse: From an equally bright sky, shape (n,); `None` where it was not asked for.
    """

    direct: npt.NDArray[np.float64] = field(repr=False)
    diffuse: npt.NDArray[np.float64] | None = field(repr=False)

    @property
    def total(self) -> npt.NDArray[np.float64]:
        """Sum of both, shape (n,)."""
        return self.direct if self.diffuse is None else self.direct + self.diffuse


def radiation(
    bits: Any,
    suns: Suns,
    dni: Any,
    dhi: Any = None,
    *,
    normals: Any,
    sky_view: Any = None,
    step_hours: Any = None,
    threads: int = 0,
) -> Radiation:
    """Answers for each sensor how much energy it gets, from bits that are known.

    Direct light counts with the cosine of its angle to the normal, diffuse light with the sky view factor. Light that the
    ground or other surfaces reflect is left out.

    Args:
        bits: Answers of `sun_visibility` for these suns, as bools or packed, shape (n, suns) or (n, bytes); an array of
            NumPy, of xarray, or of Zarr, which is read in parts.
        suns: The suns that the bits are of.
        dni: Direct normal irradiance, W/m2, one a row that the suns were made of, night included, shape (`suns.count`,).
        dhi: Diffuse horizontal irradiance, W/m2, the same; `None` leaves diffuse light out.
        normals: Normals of the sensors, any length, shape (n, 3), or (3,) for all; those that the bits were answered
            with. `face_normals` returns those of faces.
        sky_view: Sky view factors, shape (n,); needed with `dhi`.
        step_hours: Hours that each row stands for, as of `sun_hours`; by default as times say.
        threads: Threads that work; 0 for one a processor. Answers do not depend on them.

    Raises:
        ValueError: A shape does not fit; weather is missing (NaN) or negative in a row that counts, which the message
            names; times of the weather are not those of the suns; a sensor sees a sun behind its normal.
        TypeError: A dtype does not fit.
    """
    if not isinstance(suns, Suns):
        raise TypeError(f"suns: expected Suns, as Suns.of makes them, found {type(suns).__name__}")
    threads = thread_count(threads)
    bits = _bits.rows_of_bits(bits, len(suns))
    count = bits.shape[0]
    facing = _normals(normals, count)
    lengths = step_lengths(suns._times, suns.count, step_hours)
    direct_light = _weather("dni", dni, suns, suns.rows)[suns.rows]
    diffuse = None
    if dhi is not None:
        # The sky is bright before the sun has risen.
        sky_light = _weather("dhi", dhi, suns, np.arange(suns.count))
        diffuse = _shares(sky_view, count) * (float(sky_light @ lengths) / 1000.0)
    elif sky_view is not None:
        raise ValueError("sky_view: expected dhi with it")
    towards = suns._units()
    weights = towards * (direct_light * lengths[suns.rows] / 1000.0)[:, None]
    direct = np.empty(count, np.float64)
    for begin, end in _bits.chunks(count, len(suns)):
        part = np.asarray(bits[begin:end])
        if part.dtype == np.bool_:
            part = _bits.packed(part)
        _check_sides(part, facing[begin:end], towards, begin)
        # The cosine is linear in the normal while no sun is behind it: one sum serves all normals.
        flux = _bits.weighted_sums(part, weights, threads)
        np.einsum("nc,nc->n", flux, facing[begin:end], out=direct[begin:end])
    # A sun in the plane of a sensor gives nothing, and rounding a little less.
    return Radiation(np.maximum(direct, 0.0, out=direct), diffuse)


def _normals(normals: Any, count: int) -> npt.NDArray[np.float64]:
    array = as_array("normals", normals)
    if array.shape == (3,):
        return np.broadcast_to(units(rows("normals", array[None]).astype(np.float64)), (count, 3))
    found = rows("normals", array).astype(np.float64)
    if len(found) != count:
        raise ValueError(f"normals: expected shape ({count}, 3) or (3,), found {found.shape}")
    bad = np.flatnonzero(~np.isfinite(found).all(axis=1))
    if len(bad):
        raise ValueError(f"normals[{bad[0]}] is {found[bad[0]].tolist()}: expected finite numbers")
    return units(found)


def _weather(name: str, values: Any, suns: Suns, used: npt.NDArray[np.int64]) -> npt.NDArray[np.float64]:
    """Checks irradiances: one a row; those of the rows that are used are finite and not negative."""
    index = getattr(values, "index", None)
    if hasattr(index, "equals") and hasattr(suns.times, "equals") and not suns.times.equals(index):
        raise ValueError(f"{name}: expected the times of the suns, found others in its index")
    array = np.asarray(values)
    if array.shape != (suns.count,) or array.dtype.kind not in "iuf":
        raise ValueError(
            f"{name}: expected numbers, shape ({suns.count},), one for each row of the suns, found shape {array.shape} and "
            f"dtype {array.dtype}"
        )
    found = array.astype(np.float64)
    bad = used[~(np.isfinite(found[used]) & (found[used] >= 0.0))]
    if len(bad):
        row = int(bad[0])
        time = "" if suns._times is None else f" ({suns._times.name(row)})"
        raise ValueError(
            f"{name}: row {row}{time} is {found[row]:g}: expected W/m2, zero or more; {len(bad)} of {len(used)} rows are missing "
            "or negative"
        )
    return found


def _shares(sky_view: Any, count: int) -> npt.NDArray[np.float64]:
    if sky_view is None:
        raise ValueError("sky_view: expected sky view factors with dhi; antumbra.sun.sky_view_factor answers them")
    found = np.asarray(sky_view, dtype=np.float64)
    if found.shape != (count,):
        raise ValueError(f"sky_view: expected shape ({count},), found {found.shape}")
    bad = np.flatnonzero(~((found >= 0.0) & (found <= 1.0)))
    if len(bad):
        raise ValueError(f"sky_view[{bad[0]}] is {found[bad[0]]}: expected 0 to 1")
    return found


def _check_sides(
    bits: npt.NDArray[np.uint8], normals: npt.NDArray[np.float64], towards: npt.NDArray[np.float64], begin: int
) -> None:
    """Refuses bits that were answered with other normals: looks at some sensors."""
    some = np.unique(np.linspace(0, len(bits) - 1, min(LOOKED_AT, len(bits))).astype(np.int64))
    is_behind = _bits.unpacked(bits[some], len(towards)) & (normals[some] @ towards.T < BEHIND)
    bad = np.argwhere(is_behind)
    if len(bad):
        sensor, sun = (int(number) for number in bad[0])
        raise ValueError(
            f"bits[{begin + some[sensor]}]: sun {sun} is seen behind normals[{begin + some[sensor]}]: give the normals that "
            "the bits were answered with"
        )
