"""Hours of sun: how long each sensor sees the sun, and when.

In: a scene, sensors, suns with times or steps. Out: `SunHours`. Invariant: bits are not kept; memory beside the result is that
of one chunk of sensors.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

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
from ._times import HOUR, Times, step_lengths


@dataclass(frozen=True, eq=False)
class SunHours:
    """Hours of sun of sensors.

    Attributes:
        hours: Hours in which a sensor sees the sun, float64, shape (n,).
        most: Hours in which the sun is above the horizon.
        suns: The suns, and how many were left out.
        days: Dates of the times, datetime64 in days, shape (days,); `None` unless spans or first and last suns are
            asked for. Days without a sun above the horizon are among them.
        longest: Hours of the longest span without a break of each day, float32, shape (n, days), or `None`.
        first: Row of the input whose sun is the first that a sensor sees on a day, a masked array of int32, shape
            (n, days), masked where it sees none; or `None`.
        last: The same for the last.
    """

    hours: npt.NDArray[np.float64] = field(repr=False)
    most: float
    suns: Suns
    days: npt.NDArray[np.datetime64] | None = field(default=None, repr=False)
    longest: npt.NDArray[np.float32] | None = field(default=None, repr=False)
    first: np.ma.MaskedArray[Any, np.dtype[np.int32]] | None = field(default=None, repr=False)
    last: np.ma.MaskedArray[Any, np.dtype[np.int32]] | None = field(default=None, repr=False)


def sun_hours(
    scene_or_index: SceneLike | ShadowIndex,
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
    spans: bool = False,
    first_and_last: bool = False,
    threads: int = 0,
    progress: Progress = None,
) -> SunHours:
    """Answers for each sensor how many hours it sees the sun.

    A row of the suns stands for one step. The step follows from times as their most frequent distance, of which all distances are
    multiples: rows may be missing, and stand for nothing then. Two rows may show one time, as local times in autumn.

    Args:
        scene_or_index: As of `sun_visibility`, like all that are not named below.
        points: Sensors, shape (n, 3).
        face_ids: Surfaces that the sensors lie on.
        normals: Normals of points of space.
        side: Side of the surface.
        tolerance: How far points may be from their faces.
        suns: The suns, with or without those of the night.
        times: Times of the suns.
        step_hours: Hours that each row stands for, one number or shape (rows,), in place of those that times say.
        north: Degrees from the scene's north axis to north.
        up: Axis that points up.
        refraction: Which elevations of a table are taken.
        spans: Whether to find the longest span without a break of each day. Needs times. A span ends where a sun is not
            seen, is below the horizon, or has no row; a day is the date that a time shows in its own zone.
        first_and_last: Whether to find the first and the last sun of each day. Needs times.
        threads: Threads that work.
        progress: As of `ShadowIndex`.

    Memory is that of the result, of the index, and at most 512 MiB.

    Raises:
        ValueError: As of `sun_visibility`; or times do not say how long a row stands for; or times that are needed are
            missing or go back.
    """
    threads = thread_count(threads)
    index = index_of(scene_or_index, threads)
    sensors = sensors_of(index, points, face_ids, normals, side, tolerance)
    used = suns_in(index.scene, suns, times, north, up, refraction)
    lengths = step_lengths(used._times, used.count, step_hours)
    calendar = Calendar(used, lengths) if spans or first_and_last else None
    to = reporter(progress)
    hours = np.empty(len(sensors), np.float64)
    weights = lengths[used.rows][:, None]
    most = float(weights.sum())
    if calendar is None:
        for begin, end in _bits.chunks(len(sensors), len(used)):
            bits = _bits.lit_bits(index, sensors, used.directions, begin, end, threads)
            hours[begin:end] = _bits.weighted_sums(bits, weights, threads)[:, 0]
            _bits.report(to, end, len(sensors))
        return SunHours(hours, most, used)
    shape = (len(sensors), len(calendar.days))
    longest = np.empty(shape, np.float32) if spans else None
    first = np.ma.array(np.zeros(shape, np.int32), mask=True) if first_and_last else None
    last = np.ma.array(np.zeros(shape, np.int32), mask=True) if first_and_last else None
    for begin, end in _bits.chunks(len(sensors), len(used), unpacked=True):
        bits = _bits.lit_bits(index, sensors, used.directions, begin, end, threads)
        hours[begin:end] = _bits.weighted_sums(bits, weights, threads)[:, 0]
        # A row a sun: what follows walks through time.
        lit = np.ascontiguousarray(_bits.unpacked(bits, len(used)).T)
        if longest is not None:
            longest[begin:end] = calendar.longest(lit).T
        if first is not None and last is not None:
            for name, out in (("first", first), ("last", last)):
                rows, has_sun = calendar.seen(lit, name)
                out[begin:end] = np.ma.array(rows.T, mask=~has_sun.T)
        _bits.report(to, end, len(sensors))
    return SunHours(hours, most, used, calendar.days, longest, first, last)


class Calendar:
    """Suns in their days."""

    def __init__(self, suns: Suns, lengths: npt.NDArray[np.float64]) -> None:
        times = suns._times
        if times is None:
            raise ValueError("spans, first_and_last: expected times, as there are no days without them")
        back = np.flatnonzero(np.diff(times.moments).astype(np.int64) < 0)
        if len(back):
            row = int(back[0]) + 1
            raise ValueError(f"times[{row}] is {times.name(row)}, earlier than the one before it: expected times in order")
        self.days: npt.NDArray[np.datetime64] = np.unique(times.days)
        self._lengths = lengths[suns.rows]
        self._rows = suns.rows.astype(np.int32)
        day_of = np.searchsorted(self.days, times.days[suns.rows])
        # Suns of each day lie together, as times are in order.
        self._begins = np.searchsorted(day_of, np.arange(len(self.days)), side="left")
        self._ends = np.searchsorted(day_of, np.arange(len(self.days)), side="right")
        self._follows = follows(suns, times, self._lengths)

    def longest(self, lit: npt.NDArray[np.bool_]) -> npt.NDArray[np.float32]:
        """Returns hours of the longest span of each day, shape (days, sensors), of bools of shape (suns, sensors)."""
        best = np.zeros((len(self.days), lit.shape[1]), np.float32)
        for day, (begin, end) in enumerate(zip(self._begins, self._ends)):
            span = np.zeros(lit.shape[1], np.float64)
            most = np.zeros(lit.shape[1], np.float64)
            for sun in range(begin, end):
                if not self._follows[sun]:
                    span[:] = 0.0
                span += self._lengths[sun]
                span *= lit[sun]
                np.maximum(most, span, out=most)
            best[day] = most
        return best

    def seen(self, lit: npt.NDArray[np.bool_], which: str) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]:
        """Returns rows of the first or the last sun of each day, and where there is one, shape (days, sensors)."""
        rows = np.zeros((len(self.days), lit.shape[1]), np.int32)
        has_sun = np.zeros(rows.shape, np.bool_)
        for day, (begin, end) in enumerate(zip(self._begins, self._ends)):
            if begin == end:
                continue
            of_day = lit[begin:end]
            has_sun[day] = of_day.any(axis=0)
            if which == "first":
                rows[day] = self._rows[begin + of_day.argmax(axis=0)]
            else:
                rows[day] = self._rows[end - 1 - of_day[::-1].argmax(axis=0)]
        return rows, has_sun


def follows(suns: Suns, times: Times, lengths: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Returns which suns continue the one before them: no night and no missing row lies between."""
    is_next = np.diff(suns.rows) == 1
    apart = np.diff(times.moments[suns.rows]).astype(np.int64) / HOUR
    # Lengths are given in hours, which are not exact: an hour is 3600 * 10^6 microseconds.
    is_close = apart <= lengths[:-1] + 1e-9
    return np.concatenate([[False], is_next & is_close])
