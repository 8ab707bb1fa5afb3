"""Where the sun is, row by row.

In: a table of `pvlib`, angles, or directions. Out: directions of the suns above the horizon. Invariant: a row that is left
out is counted, a row without a position is named. Absent here: how positions follow from places and times.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .._arrays import LARGEST, as_array
from ..lights import towards_sun
from ..scene import Scene
from ._times import Times, times_of

Up = Literal["z", "y"]

ELEVATIONS = {False: "elevation", True: "apparent_elevation"}
"""Columns of a table of `pvlib`: without and with refraction."""


@dataclass(frozen=True, eq=False)
class Suns:
    """Suns above the horizon, as directions of a scene. `Suns.of` makes them.

    Attributes:
        directions: Towards each sun, float64, shape (suns, 3).
        rows: Rows of the input that these suns are, int64, shape (suns,), in their order.
        count: Number of rows of the input.
        below_horizon: Number of rows that were left out, as their sun is at or below the horizon.
        times: Times of all rows as they came, or `None`.
        elevation: Column that elevations are from, `"elevation"` or `"apparent_elevation"`; `""` for other input.
        north: Degrees from the scene's north axis to north.
        up: Axis that points up, `"z"` or `"y"`.
    """

    directions: npt.NDArray[np.float64] = field(repr=False)
    rows: npt.NDArray[np.int64] = field(repr=False)
    count: int
    times: Any = field(repr=False)
    elevation: str
    north: float
    up: Up
    _times: Times | None = field(repr=False)

    @property
    def below_horizon(self) -> int:
        """Number of rows that were left out, as their sun is at or below the horizon."""
        return self.count - len(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    @classmethod
    def of(
        cls, suns: Any, *, times: Any = None, north: float = 0.0, up: Up = "z", refraction: bool = False
    ) -> Suns:
        """Takes positions of the sun.

        **With z up, north is +y and east is +x. With y up, north is -z and east is +x.**

        Args:
            suns: A table with columns `azimuth` and `elevation` in degrees, as
                `pvlib.solarposition.get_solarposition` returns it; or a tuple of two arrays, azimuths and elevations in
                degrees; or directions towards suns, shape (n, 3), of any length but zero, which are taken as they are.
            times: Times of the rows, n of them; by default the index of a table, if it holds times. They are kept as they
                are, with their time zone.
            north: Degrees clockwise, seen from above, from the scene's north axis to north: azimuths are turned by it.
                Directions stay as they are.
            up: Axis that points up, `"z"` or `"y"`.
            refraction: Whether a table's `apparent_elevation` is taken, where refraction lifts the sun, in place of
                its `elevation`.

        Suns at or below the horizon are left out and counted.

        Raises:
            TypeError: Positions are of no kind above.
            ValueError: A row has no position, which the message names; an angle is out of range; lengths differ; no sun is
                above the horizon.
        """
        if up not in ("z", "y"):
            raise ValueError(f'up is {up!r}: expected "z" or "y"')
        if not (np.isfinite(north) and abs(north) <= 3600.0):
            raise ValueError(f"north is {north} degrees: expected -3600 to 3600")
        column = ""
        if _is_table(suns):
            column = ELEVATIONS[bool(refraction)]
            azimuths, elevations = _columns(suns, column)
            if times is None and _holds_times(suns.index if hasattr(suns, "index") else None):
                times = suns.index
        elif refraction:
            raise ValueError("refraction: only a table has elevations with and without it; give the ones that you mean")
        elif isinstance(suns, tuple):
            azimuths, elevations = _pair(suns)
        else:
            known = None if times is None else times_of(times)
            directions = _directions(suns, known)
            is_up = directions[:, 2 if up == "z" else 1] > 0.0
            return cls._above(directions[is_up], is_up, known, column, north, up)
        known = None if times is None else times_of(times)
        _check_angles(azimuths, elevations, known)
        is_up = elevations > 0.0
        turned = azimuths[is_up] + north
        # A turn may leave the range of azimuths.
        turned = np.where(np.abs(turned) <= 3600.0, turned, np.remainder(turned, 360.0))
        towards = [towards_sun(azimuth, elevation, up) for azimuth, elevation in zip(turned, elevations[is_up])]
        directions = np.array(towards, dtype=np.float64).reshape(-1, 3)
        return cls._above(directions, is_up, known, column, north, up)

    @classmethod
    def _above(
        cls,
        directions: npt.NDArray[np.float64],
        is_up: npt.NDArray[np.bool_],
        times: Times | None,
        column: str,
        north: float,
        up: Up,
    ) -> Suns:
        count = len(is_up)
        if times is not None and len(times) != count:
            raise ValueError(f"times: expected {count}, one for each sun, found {len(times)}")
        rows = np.flatnonzero(is_up).astype(np.int64)
        if not len(rows):
            raise ValueError(f"suns: none of {count} is above the horizon, so there is nothing to answer")
        given = None if times is None else times.given
        return cls(directions, rows, count, given, column, float(north), up, times)

    def _attributes(self) -> dict[str, Any]:
        """Returns what a result says of its suns."""
        attributes: dict[str, Any] = {
            "suns": self.count,
            "suns_below_horizon": self.below_horizon,
            "north_degrees": self.north,
            "up": self.up,
        }
        if self.elevation:
            attributes["elevation_column"] = self.elevation
        return attributes

    def _units(self) -> npt.NDArray[np.float64]:
        """Returns directions of length one."""
        longest = np.abs(self.directions).max(axis=1, keepdims=True)
        scaled = self.directions / longest
        return np.asarray(scaled / np.linalg.norm(scaled, axis=1, keepdims=True), dtype=np.float64)


def suns_in(
    scene: Scene, suns: Any, times: Any, north: float, up: Up | None, refraction: bool
) -> Suns:
    """Returns suns for a scene, which says which way is up if the caller does not."""
    if isinstance(suns, Suns):
        if times is not None or north != 0.0 or up is not None or refraction:
            raise ValueError("suns are made already: give times, north, up and refraction to Suns.of")
        return suns
    return Suns.of(suns, times=times, north=north, up=up or up_of(scene), refraction=refraction)


def up_of(scene: Scene) -> Up:
    """Returns the axis that points up in a scene."""
    found = scene._up_for("suns")
    if found == (0.0, 0.0, 1.0):
        return "z"
    if found == (0.0, 1.0, 0.0):
        return "y"
    raise ValueError(f'up: the scene\'s up is {found}, which is no axis: give up="z" or "y"')


def _is_table(suns: Any) -> bool:
    return hasattr(suns, "columns") and hasattr(suns, "__getitem__")


def _holds_times(index: Any) -> bool:
    return index is not None and (hasattr(index, "tz_localize") or getattr(getattr(index, "dtype", None), "kind", "") == "M")


def _columns(table: Any, column: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    names = [str(name) for name in table.columns]
    for name in ("azimuth", column):
        if name not in names:
            other = ELEVATIONS[column == "elevation"]
            advice = f"; refraction={column == 'elevation'} takes {other}" if name == column and other in names else ""
            raise ValueError(f"suns: expected a column {name}, found {', '.join(names) or 'none'}{advice}")
    return _angles("suns.azimuth", table["azimuth"]), _angles(f"suns.{column}", table[column])


def _pair(suns: tuple[Any, ...]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    if len(suns) != 2:
        raise ValueError(f"suns: expected a tuple of azimuths and elevations, found {len(suns)} items")
    azimuths, elevations = _angles("azimuths", suns[0]), _angles("elevations", suns[1])
    if azimuths.shape != elevations.shape:
        raise ValueError(f"elevations: expected shape {azimuths.shape} as that of azimuths, found {elevations.shape}")
    return azimuths, elevations


def _angles(name: str, value: Any) -> npt.NDArray[np.float64]:
    array = np.atleast_1d(as_array(name, value))
    if array.ndim != 1 or array.dtype.kind not in "iuf":
        raise TypeError(f"{name}: expected numbers, shape (n,), found shape {array.shape} and dtype {array.dtype}")
    return array.astype(np.float64)


def _directions(suns: Any, times: Times | None) -> npt.NDArray[np.float64]:
    array = as_array("suns", suns)
    if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iuf":
        raise TypeError(
            "suns: expected a table with azimuth and elevation, a tuple of azimuths and elevations, or directions of shape "
            f"(n, 3), found {type(suns).__name__} of shape {array.shape}"
        )
    directions = np.ascontiguousarray(array, dtype=np.float64)
    largest = np.abs(directions).max(axis=1, initial=0.0)
    _refuse(np.isnan(largest), "has no direction (NaN)", times)
    _refuse(~(largest <= LARGEST), "is larger than 2^100", times)
    _refuse(largest == 0.0, "is zero, which is no direction", times)
    return directions


def _check_angles(
    azimuths: npt.NDArray[np.float64], elevations: npt.NDArray[np.float64], times: Times | None
) -> None:
    _refuse(np.isnan(azimuths) | np.isnan(elevations), "has no position (NaN)", times)
    _refuse(~(np.abs(azimuths) <= 3600.0), "has an azimuth beyond -3600 to 3600 degrees", times)
    _refuse(~(np.abs(elevations) <= 90.0), "has an elevation beyond -90 to 90 degrees", times)


def _refuse(is_bad: npt.NDArray[np.bool_], what: str, times: Times | None) -> None:
    """Refuses rows, of which the message names the first three."""
    rows = np.flatnonzero(is_bad)
    if not len(rows):
        return

    def name(row: int) -> str:
        is_timed = times is not None and row < len(times)
        return f"{row} ({times.name(row)})" if times is not None and is_timed else str(row)

    first = ", ".join(name(int(row)) for row in rows[:3])
    more = f" and {len(rows) - 3} more" if len(rows) > 3 else ""
    raise ValueError(f"suns: row {first}{more} {what}: leave it out or mend it")
