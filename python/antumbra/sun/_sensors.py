"""Points that look at the sun, and how they look.

In: points, and the faces or normals that a caller has. Out: checked arrays. Invariant: nothing is copied that fits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .._arrays import Reals, numbers, reach, rows, rows_like
from .._warning import warn_of_surfaces
from ..area import Side
from ..index import ShadowIndex
from ..scene import Scene, SceneLike, scene_of

SIDES = ("front", "back", "both")


@dataclass(frozen=True, eq=False)
class Sensors:
    """Points on faces, points with normals, or points of space that look all around."""

    points: Reals
    face_ids: npt.NDArray[np.uint32] | None
    normals: Reals | None
    side: Side
    tolerance: float | None

    def __len__(self) -> int:
        return len(self.points)

    def aligned(self) -> Sensors:
        """Returns them where numbers lie as the processor takes them: those of a message may lie anywhere."""

        def moved(array: Any) -> Any:
            return None if array is None else np.require(array, requirements=["C_CONTIGUOUS", "ALIGNED"])

        return Sensors(moved(self.points), moved(self.face_ids), moved(self.normals), self.side, self.tolerance)

    def part(self, begin: int, end: int) -> Sensors:
        """Returns some of them, without copying."""
        ids = None if self.face_ids is None else self.face_ids[begin:end]
        normals = None if self.normals is None else self.normals[begin:end]
        return Sensors(self.points[begin:end], ids, normals, self.side, self.tolerance)


def index_of(scene_or_index: SceneLike | ShadowIndex, threads: int) -> ShadowIndex:
    """Returns an index of what has surfaces. Its lights play no part."""
    if isinstance(scene_or_index, ShadowIndex):
        return scene_or_index
    return ShadowIndex(scene_of(scene_or_index), [], threads=threads)


def sensors_of(
    index: ShadowIndex, points: Any, face_ids: Any, normals: Any, side: Side, tolerance: float | None
) -> Sensors:
    """Checks points, and warns where points of space lie on surfaces."""
    sensors = checked_sensors(index.scene, points, face_ids, normals, side, tolerance)
    if sensors.face_ids is None:
        warn_of_surfaces("points", index._native.suspicious_share(sensors.points), "face_ids")
    return sensors


def checked_sensors(
    scene: Scene, points: Any, face_ids: Any, normals: Any, side: Side, tolerance: float | None
) -> Sensors:
    """Checks points against the scene that they are of."""
    at = rows("points", points)
    if side not in SIDES:
        raise ValueError(f'side is {side!r}: expected "front", "back" or "both"')
    if face_ids is not None and normals is not None:
        raise ValueError("face_ids say where points are: give them without normals")
    ids, directions = None, None
    if face_ids is not None:
        ids = numbers("face_ids", face_ids, (len(at),), scene.surface_count, "surfaces")
    elif tolerance is not None:
        raise ValueError("tolerance: only points with face_ids have one")
    elif side != "front":
        raise ValueError(f'side is "{side}": only points with face_ids have sides')
    if normals is not None:
        at, directions = rows_like("normals", normals, "points", at)
    return Sensors(at, ids, directions, side, reach(tolerance))


def unit_normals(scene: Scene, sensors: Sensors) -> npt.NDArray[np.float64] | None:
    """Returns normals of length one, shape (n, 3), zero where there is none; `None` for points that look all around.

    Raises:
        ValueError: Points lie on curved surfaces, or look to both sides.
    """
    if sensors.normals is not None:
        return units(sensors.normals.astype(np.float64))
    if sensors.face_ids is None:
        return None
    if sensors.side == "both":
        raise ValueError('side is "both": expected "front" or "back", as light is weighted by its angle to one normal')
    normals = face_normals(scene, sensors.face_ids)
    return normals if sensors.side == "front" else -normals


def face_normals(scene: SceneLike, face_ids: Any) -> npt.NDArray[np.float64]:
    """Returns normals of faces, to the side from which their corners wind counter-clockwise.

    Args:
        scene: As of `ShadowIndex`.
        face_ids: Shape (n,), integers: numbers of triangles of the scene.

    Returns:
        Normals of length one, float64, shape (n, 3); zero for a face without area.

    Raises:
        ValueError: A surface is no triangle.
        IndexError: A face does not exist.
    """
    scene = scene_of(scene)
    ids = numbers("face_ids", face_ids, (-1,), scene.surface_count, "surfaces")
    beyond = np.flatnonzero(ids >= scene.triangle_count)
    if len(beyond):
        row = int(beyond[0])
        raise ValueError(f"face_ids[{row}] is {ids[row]}, which is no triangle: give points and normals instead")
    # Once a face: a face may have many points.
    used, places = np.unique(ids, return_inverse=True)
    corners = scene.triangles()[used]
    normals: npt.NDArray[np.float64] = units(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[places]
    return normals


def units(vectors: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns vectors of length one; zero stays zero."""
    largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
    # In two steps, so that squares neither overflow nor vanish.
    scaled = np.zeros_like(vectors)
    np.divide(vectors, largest, out=scaled, where=largest > 0.0)
    lengths = np.linalg.norm(scaled, axis=1, keepdims=True)
    np.divide(scaled, lengths, out=scaled, where=lengths > 0.0)
    return scaled
