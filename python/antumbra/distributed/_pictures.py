"""Pictures in tiles, on threads or on a Dask cluster.

In: what `antumbra.render` takes. Out: a `Picture`. Invariant: each pixel has the bits that it has in a picture of one process.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .. import _antumbra
from .._arrays import whole
from .._progress import Progress, reporter
from ..area import AreaLight
from ..lights import Light
from ..picture import Camera, Picture, Pixels, Shot, Window, shot_of
from ..scene import SceneLike
from ._run import answers_of, check_workers

TILE = 256
"""Pixels of a tile's side: its colors and layers take a few mebibytes on their way."""


@dataclass(frozen=True, eq=False)
class TileWork:
    """A picture whose tiles are rendered apart."""

    shot: Shot

    def begin(self, threads: int) -> _antumbra.Renderer:
        return self.shot.with_threads(threads).renderer()

    def answer(self, made: _antumbra.Renderer, part: Window, threads: int) -> Pixels:
        return Pixels.of(made, part)


def render(
    scene: SceneLike,
    *,
    lights: Light | AreaLight | Sequence[Light | AreaLight] | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] | None = None,
    samples: int = 1,
    light_samples: int | Literal["exact"] = 16,
    max_depth: int = 5,
    seed: int = 0,
    background: Any = None,
    fog: float | Sequence[float] | None = None,
    colored_shadows: bool = True,
    bumps: bool | tuple[str, float, float] = True,
    method: Literal["auto", "voxel", "bvh", "grid", "voxel-1990", "naive"] = "auto",
    refine: Literal["lazy", "eager", "queried"] = "lazy",
    resolution: int = 2048,
    memory: int = 512 << 20,
    memory_limit: int | None = None,
    grid: int | Sequence[int] | None = None,
    occlusion: str | os.PathLike[str] | None = None,
    client: Any = None,
    workers: int | None = None,
    tile: int = TILE,
    threads: int = 0,
    progress: Progress = None,
) -> Picture:
    """Renders a picture as `antumbra.render` does, tile by tile.

    Each worker gets the scene once and makes its own index, or reads it from `occlusion`; each tile is a window of the picture.
    A tile whose worker is killed is rendered by another. The picture is in the memory of this process.

    Args:
        scene: As of `antumbra.render`, like all that are not named below.
        lights: Lights, with size and without.
        camera: The camera.
        size: Width and height of the whole picture in pixels.
        samples: Samples a pixel.
        light_samples: Samples of each light with size.
        max_depth: Longest chain of rays.
        seed: Changes the samples' places.
        background: What a ray sees that hits nothing.
        fog: A medium between all surfaces.
        colored_shadows: Whether see-through surfaces color light.
        bumps: Whether surfaces have reliefs.
        method: As of `ShadowIndex`, like all until `grid`; the picture does not depend on them.
        refine: When values are made.
        resolution: Finest voxels.
        memory: Bytes of values, on each worker.
        memory_limit: Bytes of the index, on each worker.
        grid: Voxels of the uniform grid.
        occlusion: A file of `ShadowIndex.save`, at a path that workers see, too.
        client: A `distributed.Client`; `None` for this process, or `workers`.
        workers: As of `sun_visibility`.
        tile: Pixels of a tile's side, 8 to 16384.
        threads: Threads of a tile; 0 for one a processor in this process, and one on a worker.
        progress: As of `ShadowIndex`: called with the pixels that are done.

    Returns:
        The picture of `antumbra.render`: colors, shadows, fog and exposure, bit by bit. Which queries a value decided, in `decided`
        and `counts`, depends on what each worker's index had learned.

    Raises:
        ValueError: As of `antumbra.render`.
        ImportError: Dask is needed and not installed.
    """
    shot = shot_of(
        scene,
        lights=lights,
        camera=camera,
        size=size,
        samples=samples,
        light_samples=light_samples,
        max_depth=max_depth,
        seed=seed,
        show="scene",
        background=background,
        fog=fog,
        colored_shadows=colored_shadows,
        bumps=bumps,
        method=method,
        refine=refine,
        resolution=resolution,
        memory=memory,
        memory_limit=memory_limit,
        grid=grid,
        threads=threads,
        occlusion=occlusion,
    )
    workers = check_workers(client, workers)
    width, height = shot.picture["size"]
    windows = list(tiles(width, height, whole("tile", tile, 8, 16384)))
    to = reporter(progress)
    if to is not None:
        to("pixels", 0, width * height)
    merged: _Merged | None = None
    parts = iter(enumerate(windows))
    with answers_of(TileWork(shot), parts, len(windows), client, workers, shot.made["threads"]) as answers:
        for number, pixels in answers:
            if merged is None:
                merged = _Merged(pixels, width, height)
            merged.add(windows[number], pixels)
            if to is not None:
                to("pixels", merged.done, width * height)
    assert merged is not None
    return merged.pixels().picture(shot.scene._native.files)


def tiles(width: int, height: int, side: int) -> Iterator[Window]:
    """Cuts a picture into windows, row by row."""
    for y in range(0, height, side):
        for x in range(0, width, side):
            yield x, y, min(x + side, width), min(y + side, height)


class _Merged:
    """A picture that grows, tile by tile."""

    def __init__(self, first: Pixels, width: int, height: int) -> None:
        def planes(of: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
            return np.zeros((len(of), height, width), np.float32)

        self._names, self._ways = first.light_names, first.ways
        self._color = np.zeros((height, width, 3), np.float32)
        self._shadow, self._decided, self._air = planes(first.shadow), planes(first.decided), planes(first.air)
        self._metered = (0, 0)
        self._counts: Counter[str] = Counter()
        self.done = 0

    def add(self, window: Window, pixels: Pixels) -> None:
        x0, y0, x1, y1 = window
        self._color[y0:y1, x0:x1] = pixels.color
        for into, of in ((self._shadow, pixels.shadow), (self._decided, pixels.decided), (self._air, pixels.air)):
            into[:, y0:y1, x0:x1] = of
        self._metered = (self._metered[0] + pixels.metered[0], self._metered[1] + pixels.metered[1])
        self._counts.update(pixels.counts)
        self.done += (x1 - x0) * (y1 - y0)

    def pixels(self) -> Pixels:
        layers = (self._color, self._shadow, self._decided, self._air)
        return Pixels(*layers, self._names, self._ways, self._metered, dict(self._counts))
