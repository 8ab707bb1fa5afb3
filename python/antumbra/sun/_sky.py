"""Patches of the sky, and which share of the sky's light a sensor gets.

In: a subdivision; a scene and sensors. Out: directions and weights of patches; shares. Invariant: the weights of all patches of
an open sky add up to level ground's share, which is 1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .._arrays import thread_count, whole
from .._progress import Progress, reporter
from ..area import Side
from ..index import ShadowIndex
from ..scene import SceneLike
from . import _bits
from ._sensors import index_of, sensors_of, unit_normals
from ._suns import Up, up_of

ROWS = (30, 30, 24, 24, 18, 12, 6)
"""Patches of Tregenza's rows, from the horizon up; one more is the zenith."""

MOST_SUBDIVISION = 16


@dataclass(frozen=True, eq=False)
class SkyPatches:
    """Patches that cover the sky: rows from the horizon up, each clockwise from north, and last the zenith.

    Attributes:
        directions: Towards the middle of each patch, float64, shape (patches, 3).
        solid_angles: Steradians, float64, shape (patches,). They add up to 2 pi.
        fluxes: Integrals of the direction over each patch, float64, shape (patches, 3): the product with a normal is what an
            equally bright patch gives to a surface that faces all of it.
    """

    directions: npt.NDArray[np.float64] = field(repr=False)
    solid_angles: npt.NDArray[np.float64] = field(repr=False)
    fluxes: npt.NDArray[np.float64] = field(repr=False)

    def __len__(self) -> int:
        return len(self.directions)


def sky_patches(subdivision: int = 1, *, up: Up = "z") -> SkyPatches:
    """Returns patches of the sky.

    Args:
        subdivision: 1 for Tregenza's 145 patches; m for Reinhart's MF:m, 144 m^2 + 1 patches, so 577 for 2 and 2305
            for 4, as the program `gendaymtx` of Radiance divides the sky. 1 to 16.
        up: Axis that points up, `"z"` or `"y"`; the first patch of a row is in the north, which is +y or -z.

    Raises:
        ValueError: A number is out of range.
    """
    subdivision = whole("subdivision", subdivision, 1, MOST_SUBDIVISION)
    if up not in ("z", "y"):
        raise ValueError(f'up is {up!r}: expected "z" or "y"')
    row_count = len(ROWS) * subdivision
    # The zenith's patch reaches down by half a row.
    height = np.pi / 2 / (row_count + 0.5)
    counts = np.repeat(ROWS, subdivision) * subdivision
    low = np.repeat(height * np.arange(row_count), counts)
    high = low + height
    breadth = 2 * np.pi / np.repeat(counts, counts)
    azimuth = breadth * np.concatenate([np.arange(count) for count in counts])
    west, east = azimuth - breadth / 2, azimuth + breadth / 2
    middle = low + height / 2
    directions = _axes(
        np.cos(middle) * np.sin(azimuth), np.cos(middle) * np.cos(azimuth), np.sin(middle), up, zenith=1.0
    )
    cap = height * row_count
    solid_angles = np.append(breadth * (np.sin(high) - np.sin(low)), 2 * np.pi * (1 - np.sin(cap)))
    # The direction's components, times the cosine of a ring of elevation, integrated.
    level = (high - low) / 2 + (np.sin(2 * high) - np.sin(2 * low)) / 4
    fluxes = _axes(
        level * (np.cos(west) - np.cos(east)),
        level * (np.sin(east) - np.sin(west)),
        breadth * (np.sin(high) ** 2 - np.sin(low) ** 2) / 2,
        up,
        zenith=float(np.pi * np.cos(cap) ** 2),
    )
    return SkyPatches(directions, solid_angles, fluxes)


def _axes(
    east: npt.NDArray[np.float64],
    north: npt.NDArray[np.float64],
    height: npt.NDArray[np.float64],
    up: Up,
    *,
    zenith: float,
) -> npt.NDArray[np.float64]:
    """Returns vectors of a scene, with one more in the zenith."""
    east, north, height = np.append(east, 0.0), np.append(north, 0.0), np.append(height, zenith)
    return np.stack([east, north, height] if up == "z" else [east, height, -north], axis=-1)


def sky_view_factor(
    scene_or_index: SceneLike | ShadowIndex,
    points: Any,
    face_ids: Any = None,
    *,
    normals: Any = None,
    side: Side = "front",
    tolerance: float | None = None,
    subdivision: int = 1,
    up: Up | None = None,
    threads: int = 0,
    progress: Progress = None,
) -> npt.NDArray[np.float64]:
    """Answers for each sensor which share it gets of the light of an equally bright sky: 1 on open level ground.

    Whether a patch of the sky is seen is decided exactly in its middle, and a patch counts with its exact integral of the
    cosine to the sensor's normal. Sensors have the same directions, so neighbors have no noise between them;
    `ShadowIndex.sky_view_factor` draws directions for each point instead.

    Args:
        scene_or_index: As of `sun_visibility`, like all that are not named below.
        points: Sensors, shape (n, 3). Points of space without normals are level ground.
        face_ids: Surfaces that the sensors lie on.
        normals: Normals of points of space.
        side: `"front"` or `"back"`.
        tolerance: How far points may be from their faces.
        subdivision: As of `sky_patches`: 1 for Tregenza's 145 patches, 4 for Reinhart's 2305.
        up: Axis that points up; by default the scene's, with a warning where its file does not say it.
        threads: Threads that work.
        progress: As of `ShadowIndex`.

    Returns:
        The share, 0 to 1, float64, shape (n,).

    Raises:
        ValueError: As of `sun_visibility`; or sensors have no one normal: they look to both sides, or lie on curved
            surfaces.
    """
    threads = thread_count(threads)
    index = index_of(scene_or_index, threads)
    sensors = sensors_of(index, points, face_ids, normals, side, tolerance)
    up = up or up_of(index.scene)
    sky = sky_patches(subdivision, up=up)
    facing = unit_normals(index.scene, sensors)
    if facing is None:
        level = (0.0, 0.0, 1.0) if up == "z" else (0.0, 1.0, 0.0)
        facing = np.broadcast_to(np.array(level), sensors.points.shape)
    to = reporter(progress)
    found = np.empty(len(sensors), np.float64)
    for begin, end in _bits.chunks(len(sensors), len(sky)):
        bits = _bits.lit_bits(index, sensors, sky.directions, begin, end, threads)
        fluxes = _bits.weighted_sums(bits, sky.fluxes, threads)
        np.einsum("nc,nc->n", fluxes, facing[begin:end], out=found[begin:end])
        _bits.report(to, end, len(sensors))
    # Rounding, and patches that straddle a sensor's plane, may lead beyond.
    return np.clip(found / np.pi, 0.0, 1.0, out=found)
