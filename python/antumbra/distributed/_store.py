"""Answers in a Zarr store, chunk by chunk, with a marker for each chunk that is finished.

In: rows of answers. Out: an array on disk, or wherever Zarr writes. Invariant: a marker is written after its chunk, so what is
marked is whole; a store of another study is never written to.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import numpy.typing as npt

from ._questions import Question

FINGERPRINT = "antumbra_study"
"""Attribute that says which study a store holds."""

MARKERS = "finished_chunks"


class Store:
    """A study's answers, as far as they are known.

    Args:
        place: A path, a URL, or a store of Zarr.
        question: What is asked.
        count: Number of sensors.
        chunk: Sensors of a chunk.
        fingerprint: What tells this study from others.

    Raises:
        ImportError: Zarr is not installed.
        ValueError: Something else is in the store.
    """

    def __init__(self, place: Any, question: Question, count: int, chunk: int, fingerprint: str) -> None:
        zarr = _zarr()
        group = zarr.open_group(place, mode="a")
        found = group.attrs.get(FINGERPRINT)
        if found is None and (len(group.attrs) or any(True for _ in group)):
            raise ValueError(f"store {place}: expected an empty one or one of this study, found something else")
        if found is not None and found != fingerprint:
            raise ValueError(
                f"store {place}: it holds another study: other sensors, suns, surfaces, settings, chunks, or another version"
            )
        if found is None:
            group.attrs[FINGERPRINT] = fingerprint
        columns = question.columns
        shape = (count,) if columns is None else (count, columns)
        names = ("sensor",) if columns is None else ("sensor", "byte")
        self._chunk = chunk
        self._group = group
        # Whoever was stopped while it made the store may have left out either.
        self.answers = _array(group, question.name, shape, (chunk, *shape[1:]), question.dtype, names)
        self._markers = _array(group, MARKERS, (-(-count // chunk),), (1,), "uint8", ("chunk",))

    def note(self, attributes: dict[str, Any], arrays: dict[str, npt.NDArray[Any]]) -> None:
        """Keeps what a reader needs beside the answers."""
        self.answers.attrs.update(attributes)
        for name, values in arrays.items():
            if name not in self._group:
                array = _array(self._group, name, values.shape, values.shape, str(values.dtype), ("sun",))
                array[...] = values

    def missing(self) -> npt.NDArray[np.int64]:
        """Returns the numbers of chunks that are not finished."""
        return np.flatnonzero(self._markers[...] == 0).astype(np.int64)

    def write(self, chunk: int, rows: npt.NDArray[Any]) -> None:
        """Writes a chunk, then its marker."""
        begin = chunk * self._chunk
        self.answers[begin : begin + len(rows)] = rows
        self._markers[chunk] = 1


def _array(
    group: Any, name: str, shape: tuple[int, ...], chunks: tuple[int, ...], dtype: str, names: tuple[str, ...]
) -> Any:
    if name in group:
        return group[name]
    least = tuple(max(1, length) for length in chunks)
    return group.create_array(name, shape=shape, chunks=least, dtype=dtype, dimension_names=names)


def _zarr() -> Any:
    try:
        return importlib.import_module("zarr")
    except ImportError as error:
        raise ImportError('store needs the package zarr: pip install "antumbra[dask]"') from error
