"""Pictures as arrays."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypedDict

import numpy as np
import numpy.typing as npt

from . import _antumbra
from ._arrays import as_array, vector, whole
from ._progress import Progress, reporter
from .area import AreaLight, AreaTuple, parted
from .index import Settings, settings
from .lights import Light, LightTuple, tuples_of
from .scene import Scene, SceneLike, scene_of


class PictureSettings(TypedDict):
    """What a picture depends on besides scene, lights and camera, as the extension module takes it."""

    size: tuple[int, int]
    samples: int
    max_depth: int
    seed: int
    light_samples: int
    exact_fractions: bool
    colored_shadows: bool
    bumps: bool
    bump: tuple[str, float, float] | None
    area_lights: list[AreaTuple]
    shows_occlusion: bool
    background: Sequence[float] | None
    fog: tuple[float, float, float] | None


Window: TypeAlias = tuple[int, int, int, int]
"""Columns and rows of pixels, from the top left: the first of each, then those behind the last."""


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Args:
        eye: Where it stands, world space.
        at: What is in the middle of the picture.
        up: Any vector that is not parallel to the view; by default the scene's.
        fov_degrees: Full field of view over the picture's height, above 0, below 180.
    """

    eye: Any
    at: Any
    up: Any = None
    fov_degrees: float = 45.0


@dataclass(frozen=True)
class Picture:
    """What `render` returns.

    Attributes:
        color: Linear RGB, float32, shape (height, width, 3), rows from the top.
        shadow: For each light the share of samples that it reaches, or for a light with size the share of it that
            is seen, 0 to 1, float32, shape (lights, height, width); lights without size come first. A sample that
            faces away or is outside the cone of a spot is not reached; one that hits
            nothing is.
        decided: How the queries of each pixel were decided, by name: shares, float32, shape (height, width).
        light_names: A name for each light.
        stops: The automatic exposure of scenes with light in candela and lux, else 0; of a window, its own.
        counts: Rays and queries.
        fog: With fog the light that the air adds, linear RGB, float32, shape (height, width, 3); else `None`.
        transmittance: With fog the share of the light of what is seen first that the air leaves, float32, shape
            (height, width); else `None`.
    """

    color: npt.NDArray[np.float32] = field(repr=False)
    shadow: npt.NDArray[np.float32] = field(repr=False)
    decided: dict[str, npt.NDArray[np.float32]] = field(repr=False)
    light_names: list[str]
    stops: float
    counts: dict[str, int]
    fog: npt.NDArray[np.float32] | None = field(default=None, repr=False)
    transmittance: npt.NDArray[np.float32] | None = field(default=None, repr=False)
    _read: list[Path] = field(default_factory=list, repr=False, compare=False)

    def save_png(self, path: str | os.PathLike[str], *, stops: float | None = None) -> None:
        """Writes the picture as PNG, sRGB, whole or not at all; `stops` brightens it, by default `self.stops`.

        Raises:
            ValueError: The name does not end in `.png`, or the scene was read from that file.
            OSError: The file cannot be written; a link is not written to.
        """
        name = _path_of(path, ".png")
        _antumbra.write_png(name, np.ascontiguousarray(self.color), self._stops(stops), self._read)

    def save_exr(self, path: str | os.PathLike[str]) -> None:
        """Writes the picture and its layers as OpenEXR, linear 32-bit float, whole or not at all.

        The part `beauty` holds the colors, `shadow.<light>` a light's mask, `decided-by` how queries were decided, and with
        fog `fog` and `transmittance`, as the program's `render` writes them.

        Raises:
            ValueError: The name does not end in `.exr`, or the scene was read from that file.
            OSError: The file cannot be written; a link is not written to.
        """
        name = _path_of(path, ".exr")
        color, shadow = np.ascontiguousarray(self.color), np.ascontiguousarray(self.shadow)
        ways = [self.decided[way] for way in self.decided]
        decided = np.stack(ways) if ways else np.zeros((0, *color.shape[:2]), np.float32)
        air = np.zeros((0, *color.shape[:2]), np.float32)
        if self.fog is not None and self.transmittance is not None:
            air = np.concatenate([np.moveaxis(self.fog, -1, 0), self.transmittance[np.newaxis]])
        decided, air = np.ascontiguousarray(decided), np.ascontiguousarray(air, np.float32)
        _antumbra.write_exr(name, color, self.light_names, shadow, decided, air, self._read)

    def to_srgb(self, *, stops: float | None = None) -> npt.NDArray[np.uint8]:
        """Returns the picture as sRGB bytes, those of `save_png`: uint8, shape (height, width, 3).

        Args:
            stops: Brightens by two to this power; by default `self.stops`.
        """
        return _antumbra.to_srgb(np.ascontiguousarray(self.color), self._stops(stops))

    def _stops(self, stops: float | None) -> float:
        return self.stops if stops is None else float(stops)

    @property
    def colour(self) -> npt.NDArray[np.float32]:
        """The older spelling of `color`."""
        return self.color

    def _repr_png_(self) -> bytes:
        """Returns the PNG that notebooks show."""
        with tempfile.TemporaryDirectory(prefix="antumbra-") as folder:
            path = Path(folder, "picture.png")
            self.save_png(path)
            return path.read_bytes()


def _path_of(path: str | os.PathLike[str], ending: str) -> str:
    name = os.fsdecode(path)
    if os.path.splitext(name)[1].lower() != ending:
        raise ValueError(f"path is {name!r}: expected a name that ends in {ending}")
    return name


def _fog_of(fog: float | Sequence[float]) -> tuple[float, float, float]:
    numbers = np.atleast_1d(as_array("fog", fog))
    if numbers.ndim != 1 or not 1 <= len(numbers) <= 3:
        raise ValueError(f"fog: expected a density, or density, albedo and g, found shape {numbers.shape}")
    density, albedo, g = [*map(float, numbers), *(1.0, 0.0)[len(numbers) - 1 :]]
    return density, albedo, g


def _bump_of(bumps: bool | tuple[str, float, float]) -> tuple[str, float, float] | None:
    if isinstance(bumps, bool):
        return None
    try:
        kind, height, size = bumps
        return str(kind), float(height), float(size)
    except (TypeError, ValueError):
        raise ValueError(f"bumps is {bumps!r}: expected True, False, or kind, height and size") from None


@dataclass(frozen=True, eq=False)
class Shot:
    """All that a picture follows from, checked; pickled, it can be rendered elsewhere."""

    scene: Scene
    lights: list[LightTuple] | None
    view: tuple[tuple[float, float, float], tuple[float, float, float], Sequence[float], float] | None
    picture: PictureSettings
    made: Settings
    occlusion: str | None

    def with_threads(self, threads: int) -> Shot:
        """Returns it for so many threads, 0 for one a processor."""
        return replace(self, made={**self.made, "threads": threads})

    def renderer(self, progress: Progress = None) -> _antumbra.Renderer:
        """Makes what knows the scene and its lights."""
        made, to = self.made, reporter(progress)
        return _antumbra.Renderer(self.scene._native, self.lights, self.view, self.picture, made, self.occlusion, to)


def window_of(window: Any, size: tuple[int, int]) -> Window:
    """Checks a window of a picture; `None` is all of it."""
    width, height = size
    if window is None:
        return 0, 0, width, height
    ends = as_array("window", window)
    if ends.shape != (4,):
        raise ValueError(f"window: expected first column and row, end column and row, found shape {ends.shape}")
    x0, x1 = (whole("window", end, 0, width) for end in (window[0], window[2]))
    y0, y1 = (whole("window", end, 0, height) for end in (window[1], window[3]))
    if not (x0 < x1 and y0 < y1):
        raise ValueError(f"window is {(x0, y0, x1, y1)}: expected x0 < x1 and y0 < y1, as it has no pixel")
    return x0, y0, x1, y1


@dataclass(frozen=True, eq=False)
class Pixels:
    """What a renderer returns of a window."""

    color: npt.NDArray[np.float32]
    shadow: npt.NDArray[np.float32]
    decided: npt.NDArray[np.float32]
    air: npt.NDArray[np.float32]
    light_names: list[str]
    ways: list[str]
    metered: tuple[int, int]
    counts: dict[str, int]

    @classmethod
    def of(cls, renderer: _antumbra.Renderer, window: Window, progress: Progress = None) -> Pixels:
        """Renders a window."""
        x0, y0, x1, y1 = window
        return cls(*renderer.render((x0, y0), (x1 - x0, y1 - y0), reporter(progress)))

    def picture(self, files: list[Path]) -> Picture:
        """Returns them as a picture of a scene that was read from `files`."""
        added, left = (np.moveaxis(self.air[:3], 0, -1), self.air[3]) if len(self.air) else (None, None)
        stops = _antumbra.stops_of(*self.metered)
        decided = dict(zip(self.ways, self.decided))
        return Picture(self.color, self.shadow, decided, self.light_names, stops, self.counts, added, left, files)


def shot_of(
    scene: SceneLike,
    *,
    lights: Light | AreaLight | Sequence[Light | AreaLight] | None,
    camera: Camera | None,
    size: tuple[int, int] | None,
    samples: int,
    light_samples: int | Literal["exact"],
    max_depth: int,
    seed: int,
    show: Literal["scene", "occlusion"],
    background: Any,
    fog: float | Sequence[float] | None,
    colored_shadows: bool,
    bumps: bool | tuple[str, float, float],
    method: Literal["auto", "voxel", "bvh", "grid", "voxel-1990", "naive"],
    refine: Literal["lazy", "eager", "queried"],
    resolution: int,
    memory: int,
    memory_limit: int | None,
    grid: int | Sequence[int] | None,
    threads: int,
    occlusion: str | os.PathLike[str] | None,
) -> Shot:
    """Checks what `render` takes, and fills in what it leaves out."""
    scene = scene_of(scene)
    native = scene._native
    if show not in ("scene", "occlusion"):
        raise ValueError(f'show is {show!r}: expected "scene" or "occlusion"')
    if size is None:
        from_file = native.camera[4] if native.camera is not None else None
        width, height = (min(16384, max(1, side)) for side in from_file or (512, 512))
    else:
        sides = as_array("size", size)
        if sides.shape != (2,):
            raise ValueError(f"size: expected width and height, found shape {sides.shape}")
        width, height = (whole("size", side, 1, 16384) for side in size)
    view = None
    if camera is not None:
        up = native.up if camera.up is None else vector("camera.up", camera.up)
        eye, at = vector("camera.eye", camera.eye), vector("camera.at", camera.at)
        view = (eye, at, up, float(camera.fov_degrees))
    plain, areas = (None, []) if lights is None else parted(lights, scene)
    picture: PictureSettings = {
        "size": (width, height),
        "samples": whole("samples", samples, 1, 65536),
        "max_depth": whole("max_depth", max_depth, 0, 32),
        "seed": whole("seed", seed, 0, 2**64 - 1),
        "light_samples": 64 if light_samples == "exact" else whole("light_samples", light_samples, 1, 65536),
        "exact_fractions": light_samples == "exact",
        "colored_shadows": bool(colored_shadows),
        "bumps": bumps is not False,
        "bump": _bump_of(bumps),
        "area_lights": areas,
        "shows_occlusion": show == "occlusion",
        "background": None if background is None else vector("background", background),
        "fog": None if fog is None else _fog_of(fog),
    }
    made = settings(
        method=method,
        refine=refine,
        resolution=resolution,
        memory=memory,
        memory_limit=memory_limit,
        grid=grid,
        threads=threads,
    )
    tuples = None if plain is None else tuples_of(plain)
    path = None if occlusion is None else os.fsdecode(occlusion)
    return Shot(scene, tuples, view, picture, made, path)


def render(
    scene: SceneLike,
    *,
    lights: Light | AreaLight | Sequence[Light | AreaLight] | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] | None = None,
    window: Window | None = None,
    samples: int = 1,
    light_samples: int | Literal["exact"] = 16,
    max_depth: int = 5,
    seed: int = 0,
    show: Literal["scene", "occlusion"] = "scene",
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
    threads: int = 0,
    occlusion: str | os.PathLike[str] | None = None,
    progress: Progress = None,
) -> Picture:
    """Renders a picture by Whitted ray tracing, as the program's `render` does.

    Args:
        scene: What is seen: anything that `ShadowIndex` takes.
        lights: One light or many, with size and without; by default the scene's, or a sun if it has none.
        camera: The camera; by default the scene's, or one that frames the scene.
        size: Width and height in pixels, 1 to 16384; by default the scene's, or 512 x 512.
        window: The part of the picture that is rendered, `(x0, y0, x1, y1)` in pixels from the top left, `x1` and `y1`
            excluded; by default all of it. Its pixels have the bits that they have in the whole picture.
        samples: Samples a pixel, 1 to 65536.
        light_samples: Samples of each light with size at each point, 1 to 65536; powers of two are spread best. `"exact"`
            takes the exact visible fraction where `ShadowIndex.visible_fraction` has one, and 64 samples elsewhere.
        max_depth: Longest chain of rays, the eye ray counted, 0 to 32.
        seed: Changes the samples' places.
        show: `"scene"`, or `"occlusion"`: in false colors, how shadow queries were decided.
        background: What a ray sees that hits nothing, linear RGB; by default the scene's.
        fog: A medium between all surfaces, in which light scatters once: its density, the extinction coefficient for each
            unit of length; or density and albedo (0 to 1, else 1); or these and the mean cosine of scattering (above -1,
            below 1, else 0). Stretches that lights reach are exact.
        colored_shadows: Whether see-through surfaces color the light that reaches others through them, straight on.
        bumps: Whether surfaces have the reliefs of their bump and normal maps: in their shading, and where shadows of others
            end on them. Or a relief for all surfaces: `("noise", height, size)` or `("ripples", height, size)`, in the
            scene's unit.
        method: As of `ShadowIndex`, like all that follow. The picture does not depend on them.
        refine: When values are made.
        resolution: Finest voxels.
        memory: Bytes of values.
        memory_limit: Bytes of the index.
        grid: Voxels of the uniform grid.
        threads: Threads that work; 0 for one a processor.
        occlusion: A file of `ShadowIndex.save`.
        progress: `True` for a line on the standard error stream, or a callable that is called with a stage's name, its
            steps that are done and all of them.

    The interpreter's lock is released; Ctrl-C ends the work. `antumbra.distributed.render` renders tiles on many machines.

    Raises:
        ValueError: A setting is out of range, a window has no pixel or leaves the picture, or the camera sees nothing.
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
        show=show,
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
    part = window_of(window, shot.picture["size"])
    return Pixels.of(shot.renderer(progress), part, progress).picture(shot.scene._native.files)
