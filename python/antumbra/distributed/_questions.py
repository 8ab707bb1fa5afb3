"""Questions that are answered chunk by chunk: what one chunk of sensors asks, on whatever machine.

In: an index, a part of the sensors. Out: an array with a row a sensor. Invariant: an answer depends on the question and the
chunk, never on who answers. Questions are pickled. Absent here: chunks, workers, stores.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, fields
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from ..area import AreaLight
from ..index import ShadowIndex
from ..scene import Scene
from ..sun import _bits
from ..sun._sensors import Sensors, unit_normals


class Question(Protocol):
    """A question that all sensors ask."""

    @property
    def name(self) -> str:
        """Name of the answers' array."""
        ...

    @property
    def dtype(self) -> str:
        """Data type of the answers."""
        ...

    @property
    def columns(self) -> int | None:
        """Numbers a sensor; `None` for one, without an axis of its own."""
        ...

    def answer(self, index: ShadowIndex, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        """Answers a chunk that begins with the sensor `begin` of all."""
        ...


@dataclass(frozen=True, eq=False)
class SunBits:
    """Which suns are seen, packed."""

    directions: npt.NDArray[np.float64] = field(repr=False)
    name: str = "sun_visibility"
    dtype: str = "uint8"

    @property
    def columns(self) -> int | None:
        return _bits.width(len(self.directions))

    def answer(self, index: ShadowIndex, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        return _bits.lit_bits(index, sensors, self.directions, 0, len(sensors), threads)


@dataclass(frozen=True, eq=False)
class SunSums:
    """Sums of weights of the suns that are seen."""

    directions: npt.NDArray[np.float64] = field(repr=False)
    weights: npt.NDArray[np.float64] = field(repr=False)
    name: str = "sun_hours"
    dtype: str = "float64"
    columns: int | None = None

    def answer(self, index: ShadowIndex, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        bits = _bits.lit_bits(index, sensors, self.directions, 0, len(sensors), threads)
        return _bits.weighted_sums(bits, self.weights[:, None], threads)[:, 0]


@dataclass(frozen=True, eq=False)
class SkyShare:
    """Shares of the sky's light."""

    directions: npt.NDArray[np.float64] = field(repr=False)
    fluxes: npt.NDArray[np.float64] = field(repr=False)
    up: tuple[float, float, float]
    name: str = "sky_view_factor"
    dtype: str = "float64"
    columns: int | None = None

    def answer(self, index: ShadowIndex, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        facing = unit_normals(index.scene, sensors)
        if facing is None:
            facing = np.broadcast_to(np.array(self.up), sensors.points.shape)
        bits = _bits.lit_bits(index, sensors, self.directions, 0, len(sensors), threads)
        fluxes = _bits.weighted_sums(bits, self.fluxes, threads)
        found: npt.NDArray[np.float64] = np.einsum("nc,nc->n", fluxes, facing)
        return np.clip(found / np.pi, 0.0, 1.0, out=found)


@dataclass(frozen=True, eq=False)
class LightShare:
    """Shares of a light with size that are seen, as for a light map."""

    light: AreaLight
    samples: int | str
    seed: int
    name: str = "visible_fraction"
    dtype: str = "float64"
    columns: int | None = None

    def answer(self, index: ShadowIndex, sensors: Sensors, begin: int, threads: int) -> npt.NDArray[Any]:
        how: dict[str, Any] = {"samples": self.samples, "side": sensors.side, "tolerance": sensors.tolerance}
        # Rows of a chunk are numbered from zero: another seed keeps chunks from having the same samples.
        seed = (self.seed + begin) % 2**64
        found = index.visible_fraction(
            sensors.points, self.light, sensors.face_ids, normals=sensors.normals, seed=seed, threads=threads, **how
        )
        return found.astype(np.float64)


@dataclass(frozen=True, eq=False)
class ChunkWork:
    """A question of a scene, cut into chunks of sensors: a part is the number of its first sensor, and its sensors."""

    scene: Scene
    question: Question

    def begin(self, threads: int) -> ShadowIndex:
        return ShadowIndex(self.scene, [], threads=threads)

    def answer(self, made: ShadowIndex, part: tuple[int, Sensors], threads: int) -> npt.NDArray[Any]:
        begin, sensors = part
        return answer_chunk(self.question, made, sensors.aligned(), begin, threads)


def answer_chunk(
    question: Question, index: ShadowIndex, sensors: Sensors, begin: int, threads: int
) -> npt.NDArray[Any]:
    """Answers a chunk; an error says where the chunk begins, as it names rows of the chunk alone."""
    try:
        return question.answer(index, sensors, begin, threads)
    except ValueError as error:
        raise ValueError(f"chunk of {len(sensors)} sensors from {begin} on: {error}") from error


def fingerprint(scene: Scene, question: Question, sensors: Sensors, chunk: int) -> str:
    """Returns what tells a study from others: a hash of all that answers follow from."""
    found = hashlib.sha256()
    parts: list[Any] = [scene._native.to_bytes(), type(question).__name__, chunk, sensors.side, sensors.tolerance]
    parts += [getattr(question, of.name) for of in fields(question)]  # type: ignore[arg-type]
    parts += [sensors.points, sensors.face_ids, sensors.normals]
    for part in parts:
        if isinstance(part, np.ndarray):
            found.update(f"{part.dtype} {part.shape}".encode())
            found.update(np.ascontiguousarray(part).data if part.size else b"")
        elif isinstance(part, bytes):
            found.update(f"bytes {len(part)}".encode())
            found.update(part)
        else:
            found.update(repr(part).encode())
        found.update(b"\0")
    return found.hexdigest()
