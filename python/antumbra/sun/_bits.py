"""Bits of sensors and suns, a chunk of sensors at a time.

In: an index, sensors, directions. Out: packed rows, or sums of weights over their bits. Invariant: memory beside a result
is that of one chunk. Which engine answers is decided here alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _antumbra
from .._progress import Reporter
from ..index import ShadowIndex
from ._sensors import Sensors

CHUNK_BYTES = 64 << 20
"""Bytes of a chunk's bits, twice: as the engine's words and as rows. An unpacked chunk takes four times this at most."""


def width(sun_count: int) -> int:
    """Returns the bytes of a sensor's bits."""
    return (sun_count + 7) // 8


def chunks(sensor_count: int, sun_count: int, *, unpacked: bool = False) -> Iterator[tuple[int, int]]:
    """Returns ranges of sensors whose bits, or bytes, are in memory at once."""
    # Eight bytes of one bit each are what an eighth of the sensors, packed, would take; two of them are at work.
    each = sun_count * 2 if unpacked else 2 * (width(sun_count) + 8)
    length = max(1, min(sensor_count, CHUNK_BYTES // max(each, 1)))
    for begin in range(0, sensor_count, length):
        yield begin, min(sensor_count, begin + length)


def lit_bits(
    index: ShadowIndex,
    sensors: Sensors,
    directions: npt.NDArray[np.float64],
    begin: int,
    end: int,
    threads: int,
) -> npt.NDArray[np.uint8]:
    """Returns bits of the sensors from `begin` to `end`, uint8, shape (end - begin, bytes): the first sun in the lowest
    bit, 1 where nothing opaque is before it and the sensor faces it."""
    return _antumbra.lit_towards(
        index._native,
        sensors.points,
        np.require(directions, np.float64, ["C_CONTIGUOUS", "ALIGNED"]),
        sensors.normals,
        sensors.face_ids,
        sensors.side,
        sensors.tolerance,
        (begin, end),
        threads,
    )


def weighted_sums(
    bits: npt.NDArray[np.uint8], weights: npt.NDArray[np.float64], threads: int
) -> npt.NDArray[np.float64]:
    """Returns sums of the weights of bits that are 1: float64, shape (sensors, columns).

    Args:
        bits: Packed rows, shape (sensors, bytes).
        weights: Shape (suns, columns).
        threads: Threads that work.
    """
    return _antumbra.weighted_sums(
        np.require(bits, np.uint8, ["C_CONTIGUOUS", "ALIGNED"]),
        np.require(weights, np.float64, ["C_CONTIGUOUS", "ALIGNED"]),
        threads,
    )


def unpacked(bits: npt.NDArray[np.uint8], sun_count: int) -> npt.NDArray[np.bool_]:
    """Returns a bool a sensor and sun."""
    return np.unpackbits(bits, axis=1, count=sun_count, bitorder="little").view(np.bool_)


def packed(bits: Any) -> npt.NDArray[np.uint8]:
    """Returns bools, shape (sensors, suns), as packed rows."""
    return np.packbits(bits, axis=1, bitorder="little")


def rows_of_bits(bits: Any, sun_count: int) -> Any:
    """Checks answers as a caller has them: bools or packed rows of NumPy, xarray or Zarr, which are not read yet."""
    if hasattr(bits, "dims") and hasattr(bits, "values"):
        bits = bits.values
    if not (hasattr(bits, "shape") and hasattr(bits, "dtype")):
        bits = np.asarray(bits)
    expected = {"bool": sun_count, "uint8": width(sun_count)}.get(str(bits.dtype))
    if expected is None:
        raise TypeError(f"bits: expected dtype bool, or uint8 for packed ones, found {bits.dtype}")
    if len(bits.shape) != 2 or bits.shape[1] != expected:
        raise ValueError(f"bits: expected shape (n, {expected}) for {sun_count} suns and dtype {bits.dtype}, found {bits.shape}")
    return bits


def report(to: Reporter | None, done: int, count: int) -> None:
    """Says how many sensors are done."""
    if to is not None:
        to("suns", done, count)
