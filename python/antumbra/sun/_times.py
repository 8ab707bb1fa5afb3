"""Times of suns: how long each sun stands for, and to which day it belongs.

In: times as callers have them, of pandas, NumPy or the standard library, with or without a time zone. Out: hours and days.
Invariant: nothing is converted that a caller gets back; a day is the date that a time shows in its own zone. Absent here:
where the sun is.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import timezone
from typing import Any

import numpy as np
import numpy.typing as npt

HOUR = np.timedelta64(1, "h") / np.timedelta64(1, "us")
"""Microseconds of an hour."""


@dataclass(frozen=True, eq=False)
class Times:
    """Times of suns, row by row.

    Attributes:
        given: The times as they came.
        moments: Moments of time, datetime64 in microseconds, shape (n,): in UTC where a time zone is known, else as given.
        shown: What the times show in their own zone, datetime64 in microseconds, shape (n,).
    """

    given: Any
    moments: npt.NDArray[np.datetime64]
    shown: npt.NDArray[np.datetime64]

    @property
    def days(self) -> npt.NDArray[np.datetime64]:
        """Dates that the times show, datetime64 in days, shape (n,)."""
        return self.shown.astype("datetime64[D]")

    def __len__(self) -> int:
        return len(self.moments)

    def name(self, row: int) -> str:
        """Returns the time of a row for a message."""
        return str(self.given[row])


def times_of(given: Any) -> Times:
    """Takes times as they come.

    Raises:
        TypeError: They are no times.
        ValueError: One is missing.
    """
    moments, shown = _moments_and_shown(given)
    if moments.ndim != 1:
        raise ValueError(f"times: expected shape (n,), found {moments.shape}")
    missing = np.flatnonzero(np.isnat(moments))
    if len(missing):
        raise ValueError(f"times[{missing[0]}] is missing (NaT); {len(missing)} of {len(moments)} are")
    return Times(given, moments, shown)


def _moments_and_shown(given: Any) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
    if hasattr(given, "tz_convert") and getattr(given, "tz", None) is not None:
        return _micro(given.tz_convert("UTC").tz_localize(None)), _micro(given.tz_localize(None))
    if hasattr(given, "dt") and getattr(given.dt, "tz", None) is not None:
        # A series of pandas.
        return _micro(given.dt.tz_convert("UTC").dt.tz_localize(None)), _micro(given.dt.tz_localize(None))
    array = np.asarray(given)
    if array.dtype.kind == "M":
        return _micro(array), _micro(array)
    if array.dtype == object and array.ndim == 1 and all(hasattr(time, "utcoffset") for time in array):
        zoned = [time.utcoffset() is not None for time in array]
        if any(zoned) and not all(zoned):
            row = zoned.index(not zoned[0])
            raise ValueError(f"times[{row}] is {array[row]}: expected a time zone for all times, or for none")
        shown = _micro([time.replace(tzinfo=None) for time in array])
        if not any(zoned):
            return shown, shown
        return _micro([time.astimezone(timezone.utc).replace(tzinfo=None) for time in array]), shown
    raise TypeError(f"times: expected times of pandas, datetime64 or datetime, found dtype {array.dtype}")


def _micro(times: Any) -> npt.NDArray[Any]:
    return np.asarray(times, dtype="datetime64[us]")


def step_lengths(times: Times | None, count: int, step_hours: Any) -> npt.NDArray[np.float64]:
    """Returns the hours that each row stands for, shape (n,).

    Raises:
        ValueError: The times do not say it, or a number is not finite or negative.
    """
    if step_hours is not None:
        lengths = np.asarray(step_hours, dtype=np.float64)
        if lengths.ndim == 0:
            lengths = np.full(count, lengths)
        if lengths.shape != (count,):
            raise ValueError(f"step_hours: expected one number or shape ({count},), found {lengths.shape}")
        bad = np.flatnonzero(~(np.isfinite(lengths) & (lengths >= 0.0)))
        if len(bad):
            raise ValueError(f"step_hours[{bad[0]}] is {lengths[bad[0]]}: expected a finite number, zero or more")
        return lengths
    if times is None:
        raise ValueError("step_hours: expected the hours that each sun stands for, as there are no times that say it")
    return np.full(count, step_of(times) / HOUR)


def step_of(times: Times) -> float:
    """Returns the one step of times in microseconds: the most frequent distance of neighbors.

    Rows may be left out, as nights or a missing hour: distances are multiples of the step. Two rows may show one time, as
    local times do in autumn.

    Raises:
        ValueError: There is one time only, times go back, or their distances are no multiples of one step.
    """
    distances = np.diff(times.moments).astype(np.int64)
    back = np.flatnonzero(distances < 0)
    if len(back):
        row = int(back[0]) + 1
        raise ValueError(
            f"times[{row}] is {times.name(row)}, earlier than {times.name(row - 1)} before it: give times in order, with "
            "their time zone, or step_hours="
        )
    found, counts = np.unique(distances[distances > 0], return_counts=True)
    if not len(found):
        raise ValueError("step_hours: expected it, as a single time does not say how long its sun stands for")
    step = found[np.argmax(counts)]
    odd = np.flatnonzero(distances % step)
    if len(odd):
        row = int(odd[0]) + 1
        raise ValueError(
            f"times[{row}] is {times.name(row)}, {distances[row - 1] / HOUR:g} h after the one before: expected a multiple of "
            f"the step of {step / HOUR:g} h; give step_hours="
        )
    return float(step)
