"""Charts of sensors: how many have how many hours, and how many see the sun at each time of a day.

In: hours, or bits with their suns. Out: axes of matplotlib, which is imported at the first chart. Invariant: what a chart shows
are sums over all sensors, by weight. Absent here: scenes.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .._arrays import whole
from . import _bits
from ._hours import SunHours
from ._suns import Suns
from ._times import Times


def plot_hours(hours: Any, *, weights: Any = None, bins: int = 24, ax: Any = None) -> Any:
    """Draws a histogram of hours of sun.

    Args:
        hours: `SunHours`, or hours of sensors, zero or more, shape (n,). The axis ends at `SunHours.most`, else at the
            greatest.
        weights: What each sensor counts for, as its area, zero or more, shape (n,); by default all the same.
        bins: Number of bars, 1 to 10000.
        ax: Axes of matplotlib to draw on; by default those of a new figure of `pyplot`.

    Returns:
        The axes. The bars, `ax.patches`, are shares of all sensors by weight and sum to 1.

    Raises:
        ValueError: A shape does not fit, or a number is not finite or negative.
        ImportError: matplotlib is not installed.
    """
    most = hours.most if isinstance(hours, SunHours) else None
    found = _amounts("hours", hours.hours if isinstance(hours, SunHours) else hours, None)
    amounts = _weights(weights, len(found))
    end = float(found.max()) if most is None else most
    # Sums of steps may pass the sum of all by rounding. Without any hour there is one place alone.
    found = np.minimum(found, end)
    ax = _axes(ax)
    ax.hist(found, bins=whole("bins", bins, 1, 10000), range=(0.0, end or 1.0), weights=amounts / amounts.sum())
    ax.set_xlabel("hours of sun")
    ax.set_ylabel(_share_label(weights))
    return ax


def plot_day(bits: Any, suns: Suns, day: Any, *, weights: Any = None, ax: Any = None) -> Any:
    """Draws which share of the sensors sees the sun, over the times of one day.

    Args:
        bits: Answers of `sun_visibility` for these suns, as `radiation` takes them.
        suns: The suns that the bits are of, made with times.
        day: The date, as a `datetime.date`, a `datetime64`, or text such as `"2025-06-21"`: that which times show in their
            own zone.
        weights: What each sensor counts for, as of `plot_hours`.
        ax: As of `plot_hours`.

    Returns:
        The axes. Their line has a point for each row of that day, night included: hours by the clock, and shares, 0 to 1. A
        share is drawn half a step to both sides.

    Raises:
        ValueError: There are no times, no row is of that day, or a shape does not fit.
        TypeError: A dtype does not fit.
        ImportError: matplotlib is not installed.
    """
    if not isinstance(suns, Suns):
        raise TypeError(f"suns: expected Suns, as Suns.of makes them, found {type(suns).__name__}")
    times = suns._times
    if times is None:
        raise ValueError("suns: expected times, as there are no days without them")
    bits = _bits.rows_of_bits(bits, len(suns))
    count = int(bits.shape[0])
    amounts = _weights(weights, count)
    rows = _rows_of_day(times, day)
    is_of_day = np.isin(suns.rows, rows)
    lit = np.zeros(int(is_of_day.sum()), np.float64)
    for begin, end in _bits.chunks(count, len(suns), unpacked=True):
        part = np.asarray(bits[begin:end])
        if part.dtype != np.bool_:
            part = _bits.unpacked(part, len(suns))
        lit += amounts[begin:end] @ part[:, is_of_day]
    of_row = np.zeros(suns.count, np.float64)
    of_row[suns.rows[is_of_day]] = lit / amounts.sum()
    clock = (times.shown[rows] - times.days[rows]) / np.timedelta64(1, "h")
    ax = _axes(ax)
    ax.plot(clock, of_row[rows], drawstyle="steps-mid", marker=".")
    ax.set_xlim(0.0, 24.0)
    ax.set_xticks(range(0, 25, 3))
    ax.set_ylim(0.0, 1.02)
    ax.set_xlabel(f"hour of {times.days[rows[0]]}")
    ax.set_ylabel(_share_label(weights) + " in the sun")
    return ax


def _rows_of_day(times: Times, day: Any) -> npt.NDArray[np.int64]:
    """Returns the rows of a date, in the order of their moments."""
    try:
        date = np.datetime64(day, "D")
    except (TypeError, ValueError):
        raise ValueError(f"day is {day!r}: expected a date, such as 2025-06-21") from None
    rows = np.flatnonzero(times.days == date)
    if not len(rows):
        raise ValueError(f"day is {date}: expected one of the times, which are from {times.days.min()} to {times.days.max()}")
    return rows[np.argsort(times.moments[rows], kind="stable")]


def _amounts(name: str, values: Any, count: int | None) -> npt.NDArray[np.float64]:
    """Returns numbers, one a sensor, zero or more."""
    found = np.asarray(values)
    if found.ndim != 1 or found.dtype.kind not in "iuf" or count is not None and len(found) != count or not len(found):
        wanted = "(n,), n not zero" if count is None else f"({count},)"
        raise ValueError(f"{name}: expected numbers, shape {wanted}, found shape {found.shape} and dtype {found.dtype}")
    amounts = found.astype(np.float64)
    bad = np.flatnonzero(~(np.isfinite(amounts) & (amounts >= 0.0)))
    if len(bad):
        raise ValueError(f"{name}[{bad[0]}] is {amounts[bad[0]]}: expected a finite number, zero or more")
    return amounts


def _weights(weights: Any, count: int) -> npt.NDArray[np.float64]:
    """Returns what each sensor counts for, of which the sum is above zero."""
    if not count:
        raise ValueError("bits: expected sensors, found none")
    if weights is None:
        return np.ones(count)
    amounts = _amounts("weights", weights, count)
    total = float(amounts.sum())
    if not 0.0 < total < np.inf:
        raise ValueError(f"weights: expected a finite sum above zero, found {total}")
    return amounts


def _share_label(weights: Any) -> str:
    return "share of sensors" if weights is None else "share of weights"


def _axes(ax: Any) -> Any:
    """Returns axes to draw on."""
    if ax is not None:
        return ax
    try:
        pyplot = importlib.import_module("matplotlib.pyplot")
    except ImportError as error:
        raise ImportError('charts need the package matplotlib: pip install "antumbra[plot]"') from error
    _, made = pyplot.subplots(layout="constrained")
    return made
