"""The extension module behind the package `antumbra`. Private: it takes what the package has checked."""

from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias, final

import numpy as np
import numpy.typing as npt

from ._arrays import Reals
from ._progress import Reporter
from ._shares import FractionSettings
from .area import AreaTuple
from .index import SavedLight, Settings, Stats
from .lights import LightTuple
from .picture import PictureSettings

__all__ = [
    "Renderer",
    "Scene",
    "ShadowIndex",
    "all_hits",
    "ambient_occlusion",
    "check_area_light",
    "lit_intervals",
    "lit_intervals_along",
    "lit_towards",
    "nearest_hits",
    "run",
    "sky_view_factor",
    "stops_of",
    "to_srgb",
    "towards_sun",
    "transmittance",
    "version",
    "visible_fraction",
    "weighted_sums",
    "write_exr",
    "write_png",
]

_Vector: TypeAlias = Sequence[float]
_Camera: TypeAlias = tuple[_Vector, _Vector, _Vector, float]

@final
class Scene:
    @staticmethod
    def load(path: str, up: str | None, memory_limit: int | None) -> Scene: ...
    @staticmethod
    def from_arrays(vertices: Reals, faces: npt.NDArray[np.uint32], up: _Vector) -> Scene: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def files(self) -> list[Path]: ...
    @property
    def surface_count(self) -> int: ...
    @property
    def triangle_count(self) -> int: ...
    @property
    def bounds(self) -> list[list[float]] | None: ...
    @property
    def lights(self) -> list[LightTuple]: ...
    @property
    def camera(self) -> tuple[list[float], list[float], list[float], float, list[int] | None] | None: ...
    @property
    def is_up_assumed(self) -> bool: ...
    @property
    def up(self) -> list[float]: ...
    def triangles(self) -> npt.NDArray[np.float64]: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def of_bytes(bytes: bytes) -> Scene: ...

@final
class Renderer:
    def __new__(
        cls,
        scene: Scene,
        lights: list[LightTuple] | None,
        camera: _Camera | None,
        picture: PictureSettings,
        settings: Settings,
        occlusion: str | None,
        progress: Reporter | None,
    ) -> Renderer: ...
    def render(
        self, first: tuple[int, int], size: tuple[int, int], progress: Reporter | None
    ) -> tuple[
        npt.NDArray[np.float32],
        npt.NDArray[np.float32],
        npt.NDArray[np.float32],
        npt.NDArray[np.float32],
        list[str],
        list[str],
        tuple[int, int],
        dict[str, int],
    ]: ...

@final
class ShadowIndex:
    def __new__(
        cls,
        scene: Scene,
        lights: list[LightTuple],
        settings: Settings,
        occlusion: str | None,
        progress: Reporter | None,
    ) -> ShadowIndex: ...
    @property
    def lights(self) -> list[LightTuple]: ...
    def occluded(
        self,
        points: Reals,
        lights: list[int],
        normals: Reals | None,
        face_ids: npt.NDArray[np.uint32] | None,
        on_surface: bool,
        tolerance: float | None,
        was_single: bool,
        is_packed: bool,
        threads: int,
        progress: Reporter | None,
    ) -> npt.NDArray[np.uint8]: ...
    def occluded_segments(
        self,
        a: Reals,
        b: Reals,
        face_ids: npt.NDArray[np.uint32] | None,
        tolerance: float | None,
        threads: int,
        progress: Reporter | None,
    ) -> npt.NDArray[np.uint8]: ...
    def occluded_rays(
        self,
        origins: Reals,
        directions: Reals,
        face_ids: npt.NDArray[np.uint32] | None,
        tolerance: float | None,
        threads: int,
        progress: Reporter | None,
    ) -> npt.NDArray[np.uint8]: ...
    def suspicious_share(self, points: Reals) -> tuple[int, int] | None: ...
    def save(self, path: str) -> tuple[int, int]: ...
    @property
    def saved_lights(self) -> list[SavedLight]: ...
    def volume(self, resolution: int) -> tuple[npt.NDArray[np.uint8], list[float], float] | None: ...
    def stats(self) -> Stats: ...

def lit_intervals_along(
    index: ShadowIndex, origins: Reals, ends: Reals, light: LightTuple, threads: int
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]: ...
def lit_towards(
    index: ShadowIndex,
    points: Reals,
    directions: npt.NDArray[np.float64],
    normals: Reals | None,
    face_ids: npt.NDArray[np.uint32] | None,
    side: str,
    tolerance: float | None,
    part: tuple[int, int],
    threads: int,
) -> npt.NDArray[np.uint8]: ...
def weighted_sums(
    bits: npt.NDArray[np.uint8], weights: npt.NDArray[np.float64], threads: int
) -> npt.NDArray[np.float64]: ...
def transmittance(
    index: ShadowIndex,
    points: Reals,
    lights: list[int],
    face_ids: npt.NDArray[np.uint32] | None,
    on_surface: bool,
    tolerance: float | None,
    was_single: bool,
    threads: int,
) -> npt.NDArray[np.float64]: ...
def nearest_hits(
    index: ShadowIndex,
    origins: Reals,
    directions: Reals,
    leaves: npt.NDArray[np.uint32] | None,
    threads: int,
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
def all_hits(
    index: ShadowIndex,
    origins: Reals,
    directions: Reals,
    leaves: npt.NDArray[np.uint32] | None,
    threads: int,
) -> tuple[
    npt.NDArray[np.int64], npt.NDArray[np.int64], npt.NDArray[np.float64], npt.NDArray[np.float64]
]: ...
def stops_of(log_sum: int, count: int) -> float: ...
def to_srgb(colors: npt.NDArray[np.float32], stops: float) -> npt.NDArray[np.uint8]: ...
def write_exr(
    path: str,
    colors: npt.NDArray[np.float32],
    light_names: Sequence[str],
    shadow: npt.NDArray[np.float32],
    decided: npt.NDArray[np.float32],
    air: npt.NDArray[np.float32],
    read: Sequence[Path],
) -> None: ...
def check_area_light(light: AreaTuple) -> None: ...
def visible_fraction(
    index: ShadowIndex,
    points: Reals,
    face_ids: npt.NDArray[np.uint32] | None,
    normals: Reals | None,
    light: AreaTuple,
    is_exact: bool,
    settings: FractionSettings,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_] | None]: ...
def ambient_occlusion(
    index: ShadowIndex,
    points: Reals,
    face_ids: npt.NDArray[np.uint32] | None,
    normals: Reals | None,
    distance: float | None,
    settings: FractionSettings,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_] | None]: ...
def sky_view_factor(
    index: ShadowIndex,
    points: Reals,
    face_ids: npt.NDArray[np.uint32] | None,
    normals: Reals | None,
    up: _Vector,
    settings: FractionSettings,
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_] | None]: ...
def lit_intervals(
    index: ShadowIndex, point: _Vector, face_id: int | None, light: AreaTuple, side: str
) -> list[list[float]] | None: ...
def write_png(path: str, colors: npt.NDArray[np.float32], stops: float, read: Sequence[Path]) -> None: ...
def towards_sun(azimuth_degrees: float, elevation_degrees: float, up: _Vector) -> list[float]: ...
def run(command_line: list[str]) -> int: ...
def version() -> str: ...
