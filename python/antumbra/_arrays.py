"""What callers give, as arrays that the extension module takes.

In: arrays of NumPy, whatever speaks DLPack, nested lists. Out: arrays in C order, aligned, of a dtype that fits.
Invariant: nothing is copied that fits as it is; what is refused is named with its shape, dtype, value and index.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Lights: TypeAlias = int | Sequence[int] | npt.NDArray[np.integer[Any]] | None
"""A light's place, a sequence of places, or `None` for all lights."""

Reals: TypeAlias = npt.NDArray[np.float32] | npt.NDArray[np.float64]
"""Numbers in either precision."""

LARGEST = 2.0**100
"""The largest magnitude of a coordinate."""

MOST_THREADS = 1024


def as_array(name: str, value: Any) -> npt.NDArray[Any]:
    """Returns what `value` holds as an array, without copying arrays."""
    if isinstance(value, np.ndarray):
        if np.ma.is_masked(value):
            raise ValueError(f"{name}: some entries are masked, and have no value: fill them or leave them out")
        return value
    if hasattr(value, "__dlpack__"):
        try:
            return np.from_dlpack(value)
        except (BufferError, RuntimeError, TypeError, ValueError) as error:
            raise TypeError(
                f"{name}: NumPy cannot take this {type(value).__name__} by DLPack ({error}); "
                "give one in the memory of the CPU, without a gradient"
            ) from error
    try:
        return np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: expected an array, found {type(value).__name__} ({error})") from error


def rows(name: str, value: Any) -> Reals:
    """Returns points or vectors: shape (n, 3), float32 or float64. Integers become float64."""
    array = as_array(name, value)
    if array.ndim != 2 or array.shape[1] != 3:
        advice = "; give an empty array shape (0, 3)" if array.shape == (0,) else ""
        raise ValueError(f"{name}: expected shape (n, 3), found {array.shape}{advice}")
    if array.dtype in (np.float32, np.float64):
        return np.require(array, requirements=["C_CONTIGUOUS", "ALIGNED"])
    if array.dtype.kind in "iuf" and np.can_cast(array.dtype, np.float64, "safe"):
        return np.require(array, np.float64, ["C_CONTIGUOUS", "ALIGNED"])
    raise TypeError(f"{name}: expected dtype float32 or float64, found {array.dtype}")


def rows_like(name: str, value: Any, first_name: str, first: Reals) -> tuple[Reals, Reals]:
    """Returns `first` and as many rows beside it, both in float64 where they differ in dtype."""
    array = rows(name, value)
    if array.shape != first.shape:
        raise ValueError(f"{name}: expected shape {first.shape} as that of {first_name}, found {array.shape}")
    if array.dtype == first.dtype:
        return first, array
    return first.astype(np.float64, copy=False), array.astype(np.float64, copy=False)


def numbers(name: str, value: Any, shape: tuple[int, ...], limit: int, what: str) -> npt.NDArray[np.uint32]:
    """Returns numbers of things of which there are `limit`, as uint32."""
    array = as_array(name, value)
    if array.ndim != len(shape) or any(due not in (-1, n) for due, n in zip(shape, array.shape)):
        due = "(" + ", ".join("n" if n < 0 else str(n) for n in shape) + ("," if len(shape) == 1 else "") + ")"
        raise ValueError(f"{name}: expected shape {due}, found {array.shape}")
    if array.dtype.kind not in "iu":
        raise TypeError(f"{name}: expected integers, found dtype {array.dtype}")
    if array.dtype != np.uint32 and array.size and (array.min() < 0 or array.max() >= limit):
        place = tuple(int(i) for i in np.argwhere((array < 0) | (array >= limit))[0])
        where = ", ".join(map(str, place))
        raise IndexError(f"{name}[{where}] is {array[place]}: expected less than {limit}, the number of {what}")
    return np.require(array, np.uint32, ["C_CONTIGUOUS", "ALIGNED"])


def vector(name: str, value: Any) -> tuple[float, float, float]:
    """Returns three numbers, finite and at most 2^100 in magnitude."""
    array = as_array(name, value)
    if array.shape != (3,) or array.dtype.kind not in "iuf":
        raise ValueError(f"{name}: expected three numbers, found shape {array.shape} and dtype {array.dtype}")
    x, y, z = (float(number) for number in array)
    if not all(abs(number) <= LARGEST for number in (x, y, z)):
        raise ValueError(f"{name} is ({x}, {y}, {z}): expected finite numbers, at most 2^100 in magnitude")
    return x, y, z


def whole(name: str, value: Any, least: int, most: int) -> int:
    """Returns a whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: expected a whole number, found {type(value).__name__}") from None
    if not least <= number <= most:
        raise ValueError(f"{name} is {number}: expected {least} to {most}")
    return number


def reach(value: Any) -> float | None:
    """Returns a tolerance, infinite for any distance, or `None`."""
    if value is None:
        return None
    if isinstance(value, (bool, np.bool_, np.ndarray)) or not hasattr(value, "__float__"):
        raise TypeError(f"tolerance: expected a number, found {type(value).__name__}")
    distance = float(value)
    if not distance >= 0.0:
        raise ValueError(f"tolerance {distance:g}: expected zero or more, or infinity for any distance")
    return distance


def thread_count(value: Any) -> int:
    """Returns a number of threads; 0 is one a processor."""
    return whole("threads", value, 0, MOST_THREADS)


def places(name: str, value: Any, count: int, what: str) -> tuple[list[int], bool]:
    """Returns places among `count` things, and whether it was one place, not a sequence of them."""
    is_one = not isinstance(value, (Sequence, np.ndarray)) or (isinstance(value, np.ndarray) and value.ndim == 0)
    found = []
    for number, place in enumerate([value] if is_one else value):
        where = name if is_one else f"{name}[{number}]"
        try:
            place = operator.index(place)
        except TypeError:
            kind = type(place).__name__
            raise TypeError(f"{where}: expected a whole number or a sequence of them, found {kind}") from None
        if not 0 <= place < count:
            raise IndexError(f"{where} is {place}: expected less than {count}, the number of {what}")
        found.append(place)
    return found, is_one
