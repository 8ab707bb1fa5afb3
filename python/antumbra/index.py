"""The shadow index: a scene and lights, ready for many questions."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from . import _antumbra
from ._arrays import thread_count, whole
from ._progress import Progress, reporter
from ._questions import Questions
from ._shares import Shares
from .lights import Light, LightTuple, light_of, tuples_of
from .scene import Scene, SceneLike, scene_of

MOST_VALUE_BYTES = 4 << 30


SavedLight: TypeAlias = Literal["loaded", "absent", "no room"]
"""What a file had of a light: values that were loaded; none, as the light is new or was moved; more than `memory`."""


@dataclass(frozen=True)
class Volume:
    """What values know of points of space, in cubes.

    Attributes:
        values: uint8, shape (x, y, z, lights): `LIT` where all points of a cube are lit, `SHADOWED` where none is,
            `MIXED` where both occur or it is not known.
        lowest: The lowest corner of the first cube, world space, shape (3,).
        edge: The edge of a cube.
    """

    LIT = 0
    SHADOWED = 1
    MIXED = 2

    values: npt.NDArray[np.uint8] = field(repr=False)
    lowest: npt.NDArray[np.float64]
    edge: float


class Stats(TypedDict):
    """What an index is, and how the queries of `occluded` and its kin were decided so far."""

    method: str
    surfaces: int
    lights: int
    grid: list[int]
    prepare_seconds: float
    value_bytes: int
    table_bytes: int
    memory_bytes: int
    evictions: int
    lights_without_room: int
    queries: int
    facing_away: int
    first_pass: int
    intermediate: int
    blocker_list: int
    rays: int
    shadowed: int


class Settings(TypedDict):
    """How an index is made, as the extension module takes it."""

    method: str
    refine: str
    resolution: int
    space_resolution: int
    memory: int
    memory_limit: int | None
    grid: list[int] | None
    threads: int


def settings(
    *,
    method: str = "auto",
    refine: str = "lazy",
    resolution: int = 2048,
    memory: int = 512 << 20,
    memory_limit: int | None = None,
    grid: int | Sequence[int] | None = None,
    threads: int = 0,
) -> Settings:
    """Checks settings; `ShadowIndex` says what they mean."""
    if not isinstance(method, str):
        raise TypeError(f"method: expected a str, found {type(method).__name__}")
    if not isinstance(refine, str):
        raise TypeError(f"refine: expected a str, found {type(refine).__name__}")
    resolution = whole("resolution", resolution, 4, 4096)
    if grid is not None:
        axes = list(grid) if isinstance(grid, (Sequence, np.ndarray)) else [grid] * 3
        if len(axes) != 3:
            raise ValueError(f"grid: expected one number or three, found {len(axes)}")
        grid = [whole("grid", n, 1, 2048) for n in axes]
    return {
        "method": method,
        "refine": refine,
        "resolution": resolution,
        "space_resolution": resolution,
        "memory": whole("memory", memory, 0, MOST_VALUE_BYTES),
        "memory_limit": None if memory_limit is None else whole("memory_limit", memory_limit, 0, 2**63),
        "grid": grid,
        "threads": thread_count(threads),
    }


class ShadowIndex(Questions, Shares):
    """A static scene's surfaces and lights, ready for shadow queries.

    Args:
        scene: The surfaces: a `Scene`, a pair of vertices (n, 3) and faces (m, 3), a `trimesh.Trimesh` or a
            `trimesh.Scene`.
        lights: One light or many; queries name them by their place here. By default the scene's.
        method: How queries are answered. `"auto"`, the default, traces shadow rays, and makes an exact shadow map of each
            light where that pays. `"voxel"` keeps values in voxels, and lists of the few surfaces that may block; it alone
            has a `volume`. Both can be saved, and are pickled with what they know. `"bvh"` traces a ray for each query;
            `"grid"` walks a grid; `"voxel-1990"` is the method of the paper; `"naive"` tests every surface: the reference.
            All give the same answers.
        refine: When `"auto"` computes its maps, and `"voxel"` its values: `"lazy"`, while queries are answered, where it is
            predicted to save time; `"eager"`, all of them now; `"queried"`, at the first query of each place.
        resolution: Finest voxels of `"voxel"` along the longest axis, 4 to 4096, a power of two or rounded up
            to one; half of it for points of space.
        memory: Bytes at most for all that lights know of `"voxel"` or `"auto"`, with what is needed to make it, up to 4 GiB.
            Where that is too little, values are dropped and made again, or rays answer (`evictions` and
            `lights_without_room` in `stats`). Each light takes 400 bytes of it. Surfaces, tree and grid come
            beside.
        memory_limit: Bytes at most for grid, tree and values, by prediction; what lights know takes what they
            leave. `None` for no limit.
        grid: Voxels of the uniform grid along each axis, one number or three, 1 to 2048; by default by a rule.
        threads: Threads that build it; 0 for one a processor.
        occlusion: A file that `save` wrote for the same surfaces, with the same `resolution`: what it has of each
            light is loaded; other lights are computed as without a file (`saved_lights`).
        progress: `True` for a line on the standard error stream, or a callable that is called with a stage's name, its
            steps that are done and all of them. It may raise to end the work.

    | to query | call |
    |---|---|
    | points on faces whose numbers you know | `occluded_on_faces` |
    | points on surfaces that are not named | `occluded_near` |
    | points of space | `occluded_at` |
    | pairs of points, rays | `occluded_segments`, `occluded_rays` |

    Raises:
        MemoryError: More than `memory_limit` would be needed.
        OSError: The file cannot be read.
        ValueError: A setting is out of range, or the file is refused: it is damaged, or of other surfaces.

    An index may be queried by several Python threads at once. Its answers never change, so its copies are the index
    itself; a pickle holds the scene, the lights, the settings and the values that are known.

    Ctrl-C ends building and every long call; an index can be queried again after that.
    """

    _settings: Settings

    def __init__(
        self,
        scene: SceneLike,
        lights: Light | Sequence[Light] | None = None,
        *,
        method: Literal["auto", "voxel", "bvh", "grid", "voxel-1990", "naive"] = "auto",
        refine: Literal["lazy", "eager", "queried"] = "lazy",
        resolution: int = 2048,
        memory: int = 512 << 20,
        memory_limit: int | None = None,
        grid: int | Sequence[int] | None = None,
        threads: int = 0,
        occlusion: str | os.PathLike[str] | None = None,
        progress: Progress = None,
    ) -> None:
        scene = scene_of(scene)
        made = settings(
            method=method,
            refine=refine,
            resolution=resolution,
            memory=memory,
            memory_limit=memory_limit,
            grid=grid,
            threads=threads,
        )
        tuples = scene._native.lights if lights is None else tuples_of(lights)
        path = None if occlusion is None else os.fsdecode(occlusion)
        self._native = _antumbra.ShadowIndex(scene._native, tuples, made, path, reporter(progress))
        self._scene = scene
        self._settings = made

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        scene: SceneLike,
        lights: Light | Sequence[Light] | None = None,
        *,
        method: Literal["auto", "voxel"] = "auto",
        refine: Literal["lazy", "eager", "queried"] = "lazy",
        resolution: int = 2048,
        memory: int = 512 << 20,
        memory_limit: int | None = None,
        grid: int | Sequence[int] | None = None,
        threads: int = 0,
        progress: Progress = None,
    ) -> ShadowIndex:
        """Returns an index with the values of a file: `ShadowIndex(scene, lights, occlusion=path, ...)`.

        Args:
            path: A file that `save` wrote for the same surfaces, with the same `resolution`.
            scene: As of the class, like all that follow.
            lights: The lights.
            method: The one whose knowledge is in the file; `"auto"` takes either.
            refine: When values are computed that the file does not have.
            resolution: Finest voxels.
            memory: Bytes of values.
            memory_limit: Bytes of the index.
            grid: Voxels of the uniform grid.
            threads: Threads that work.
            progress: Receiver of the progress, as of the class.
        """
        return cls(
            scene,
            lights,
            method=method,
            refine=refine,
            resolution=resolution,
            memory=memory,
            memory_limit=memory_limit,
            grid=grid,
            threads=threads,
            occlusion=path,
            progress=progress,
        )

    def save(self, path: str | os.PathLike[str], *, progress: Progress = None) -> int:
        """Writes what is known of all lights to a file, for `occlusion`, whole or not at all.

        Only the methods `"auto"` and `"voxel"` know something. With `refine="eager"` it is everything, else what the queries so
        far have paid for. Queries may be answered meanwhile. Only a file of such values is replaced, or an empty one.

        Args:
            path: The file.
            progress: As of the class: here before and after the writing.

        Returns:
            The bytes of the file.

        Raises:
            OSError: The file cannot be written; a link is not written to.
            ValueError: The method keeps no values, or something else is at the path.
        """
        report = reporter(progress)
        if report is not None:
            report("saving", 0, 1)
        bytes_written = self._native.save(os.fsdecode(path))[0]
        if report is not None:
            report("saving", 1, 1)
        return bytes_written

    @property
    def saved_lights(self) -> list[SavedLight]:
        """What the file of the index had of each light; empty without a file."""
        return self._native.saved_lights

    def volume(self, resolution: int = 64) -> Volume | None:
        """Returns what values know of points of space near the scene, in cubes: most with `refine="eager"`.

        Args:
            resolution: Cubes along the longest axis, 1 to 1024, rounded up to a power of two.

        Returns:
            `None` if the method keeps no values or the scene is empty.
        """
        found = self._native.volume(whole("resolution", resolution, 1, 1024))
        if found is None:
            return None
        values, lowest, edge = found
        return Volume(values, np.array(lowest), edge)

    @property
    def scene(self) -> Scene:
        """The surfaces."""
        return self._scene

    @property
    def lights(self) -> list[Light]:
        """The lights, in the order of their numbers."""
        return [light_of(parts) for parts in self._native.lights]

    def stats(self) -> Stats:
        """Returns what the index is and how queries were decided so far.

        `first_pass`, `intermediate`, `blocker_list` and `rays` count queries by what decided them, `facing_away`
        those that normals decided; `shadowed` counts blocked ones. `value_bytes` and `table_bytes` is what
        values take, `prepare_seconds` how long the index took to build.
        """
        return self._native.stats()

    def __copy__(self) -> ShadowIndex:
        return self

    def __deepcopy__(self, memo: Any) -> ShadowIndex:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _index_of_parts, (self._scene, self._native.lights, self._settings, self._known())

    def _known(self) -> bytes | None:
        """Returns what `save` writes; `None` for methods that keep nothing."""
        if self._settings["method"] not in ("auto", "voxel"):
            return None
        with tempfile.TemporaryDirectory(prefix="antumbra-") as folder:
            path = os.path.join(folder, "known.antumbra")
            self._native.save(path)
            with open(path, "rb") as file:
                return file.read()

    def __repr__(self) -> str:
        stats = self.stats()
        return f"<antumbra.ShadowIndex: {stats['surfaces']} surfaces, {stats['lights']} lights, {stats['method']}>"


def _index_of_parts(scene: Scene, lights: list[LightTuple], made: Settings, known: bytes | None) -> ShadowIndex:
    """Makes an index from what its pickle holds."""
    index = ShadowIndex.__new__(ShadowIndex)
    index._scene, index._settings = scene, made
    if known is None:
        index._native = _antumbra.ShadowIndex(scene._native, lights, made, None, None)
        return index
    with tempfile.TemporaryDirectory(prefix="antumbra-") as folder:
        path = os.path.join(folder, "known.antumbra")
        with open(path, "wb") as file:
            file.write(known)
        index._native = _antumbra.ShadowIndex(scene._native, lights, made, path, None)
    return index
