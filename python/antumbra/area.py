"""Lights with size, and which share of them a point sees."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeAlias, overload

import numpy as np

from . import _antumbra
from ._arrays import vector
from .lights import Vector, _color, _direction, _White, towards_sun
from .scene import Scene

AreaTuple: TypeAlias = tuple[
    str, str, list[tuple[float, float, float]], float, bool, tuple[float, float, float], bool
]
"""A light with size as the extension module has it: kind, name, vectors, radius or degrees, whether both sides
shine, color, whether it falls off."""


class _Area:
    """What lights with size share: they are checked where they are made."""

    def _tuple(self) -> AreaTuple:
        raise NotImplementedError

    def _tuple_in(self, scene: Scene) -> AreaTuple:
        """Returns the light as it is in a scene, which may say which way is up."""
        return self._tuple()

    def _check(self) -> None:
        object.__setattr__(self, "color", _color(getattr(self, "color"), None))
        _antumbra.check_area_light(self._tuple())


@dataclass(frozen=True)
class RectLight(_Area):
    """A rectangle of light, or another parallelogram.

    Args:
        center: Its middle, world space.
        edge1: One whole edge, from corner to corner.
        edge2: The other. The light shines to the side of the cross product `edge1 x edge2`.
        two_sided: Whether it shines to both sides.
        color: Linear RGB, not negative: what a surface has that faces all of it, straight in front of it.
        falls_off: Whether it is physical instead: the color is the radiance of its surface.
        name: For layers of pictures.
    """

    center: Vector
    edge1: Vector
    edge2: Vector
    two_sided: bool = False
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        for field in ("center", "edge1", "edge2"):
            object.__setattr__(self, field, vector(field, getattr(self, field)))
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [self.center, self.edge1, self.edge2]
        return ("rectangle", self.name, vectors, 0.0, bool(self.two_sided), _color(self.color, None), self.falls_off)


@dataclass(frozen=True)
class PolygonLight(_Area):
    """A flat, convex polygon of light; three corners make a triangle.

    Args:
        corners: Shape (n, 3), world space. The light shines to the side from which they wind counter-clockwise.
        two_sided: Whether it shines to both sides.
        color: As of `RectLight`.
        falls_off: As of `RectLight`.
        name: For layers of pictures.
    """

    corners: Sequence[Vector]
    two_sided: bool = False
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        corners = tuple(vector(f"corners[{number}]", corner) for number, corner in enumerate(self.corners))
        object.__setattr__(self, "corners", corners)
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = list(self.corners)
        return ("polygon", self.name, vectors, 0.0, bool(self.two_sided), _color(self.color, None), self.falls_off)


@dataclass(frozen=True)
class DiskLight(_Area):
    """A flat round disk of light.

    Args:
        center: Its middle, world space.
        normal: The side that it shines to, any length but zero.
        radius: Above 0.
        two_sided: Whether it shines to both sides.
        color: As of `RectLight`.
        falls_off: As of `RectLight`.
        name: For layers of pictures.
    """

    center: Vector
    normal: Vector
    radius: float
    two_sided: bool = False
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center))
        object.__setattr__(self, "normal", _direction("normal", self.normal))
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [self.center, self.normal]
        radius = float(self.radius)
        return ("disk", self.name, vectors, radius, bool(self.two_sided), _color(self.color, None), self.falls_off)


@dataclass(frozen=True)
class SphereLight(_Area):
    """A ball of light, which shines outwards.

    Args:
        center: Its middle, world space.
        radius: Above 0.
        color: As of `RectLight`, without "straight in front".
        falls_off: As of `RectLight`.
        name: For layers of pictures.
    """

    center: Vector
    radius: float
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center))
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [self.center]
        return ("sphere", self.name, vectors, float(self.radius), False, _color(self.color, None), self.falls_off)


@dataclass(frozen=True)
class SegmentLight(_Area):
    """A straight line of light without thickness, which shines all around.

    Args:
        start: One end, world space.
        end: The other.
        color: As of `RectLight`, straight in front meaning across the line.
        falls_off: As of `RectLight`, for a line of a thickness of one.
        name: For layers of pictures.
    """

    start: Vector
    end: Vector
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", vector("start", self.start))
        object.__setattr__(self, "end", vector("end", self.end))
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [self.start, self.end]
        return ("segment", self.name, vectors, 0.0, False, _color(self.color, None), self.falls_off)


@dataclass(frozen=True, init=False)
class SunDisc(_Area):
    """A round patch of directions, as the sun is: `SunDisc(180, 45)`, or `SunDisc(direction=(1, 0, 1))`.

    **With z up, north is +y and east is +x. With y up, north is -z and east is +x.**

    Args:
        azimuth: Degrees clockwise from north, seen from above, as of `Sun`: 90 is east, 180 is south.
        elevation: Degrees above the horizon, -90 to 90.
        diameter_degrees: Above 0, below 180; 0.53 is the sun seen from the Earth.
        color: Linear RGB, not negative: what a surface has that faces all of it.
        name: For layers of pictures.
        up: The axis that points up in the scene, `"z"` or `"y"`.
        direction: In place of azimuth and elevation: from the scene **towards the light**, any length but zero.
    """

    direction: Vector
    diameter_degrees: float = 0.53
    color: Vector = _White
    name: str = ""

    @overload
    def __init__(
        self,
        azimuth: float,
        elevation: float,
        diameter_degrees: float = 0.53,
        color: Vector = _White,
        name: str = "",
        *,
        up: Literal["z", "y"] = "z",
    ) -> None: ...

    @overload
    def __init__(
        self, *, direction: Vector, diameter_degrees: float = 0.53, color: Vector = _White, name: str = ""
    ) -> None: ...

    def __init__(
        self,
        azimuth: float | None = None,
        elevation: float | None = None,
        diameter_degrees: float = 0.53,
        color: Vector = _White,
        name: str = "",
        *,
        up: Literal["z", "y"] = "z",
        direction: Vector | None = None,
    ) -> None:
        if azimuth is not None and np.ndim(azimuth) != 0:
            raise TypeError(f"azimuth is {azimuth!r}: expected degrees; a vector is given as direction=")
        if direction is None:
            if azimuth is None or elevation is None:
                raise TypeError("SunDisc: expected azimuth and elevation, or direction=")
            direction = towards_sun(azimuth, elevation, up)
        elif azimuth is not None or elevation is not None:
            raise TypeError("SunDisc: expected azimuth and elevation, or direction=, not both")
        object.__setattr__(self, "direction", _direction("direction", direction))
        object.__setattr__(self, "diameter_degrees", diameter_degrees)
        object.__setattr__(self, "color", color)
        object.__setattr__(self, "name", name)
        self._check()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [self.direction]
        return ("sun", self.name, vectors, float(self.diameter_degrees), False, _color(self.color, None), False)


@dataclass(frozen=True)
class Sky(_Area):
    """The half of all directions around up, equally bright.

    Args:
        color: Linear RGB, not negative: what open ground has.
        up: Which way is up, any length but zero; by default the scene's up.
        name: For layers of pictures.
    """

    color: Vector = _White
    up: Vector | None = None
    name: str = ""

    def __post_init__(self) -> None:
        if self.up is not None:
            object.__setattr__(self, "up", _direction("up", self.up))
        self._check()

    def _tuple_in(self, scene: Scene) -> AreaTuple:
        sky = self if self.up is not None else replace(self, up=scene._up_for("the sky"))
        return sky._tuple()

    def _tuple(self) -> AreaTuple:
        vectors: list[Any] = [(0.0, 0.0, 1.0) if self.up is None else self.up]
        return ("sky", self.name, vectors, 0.0, False, _color(self.color, None), False)


AreaLight: TypeAlias = RectLight | PolygonLight | DiskLight | SphereLight | SegmentLight | SunDisc | Sky
"""Any of the lights with size."""

Side: TypeAlias = Literal["front", "back", "both"]
"""The side of its surface that a point looks from."""


def area_tuple_of(light: Any, scene: Scene) -> AreaTuple:
    """Returns a light of a scene as the extension module takes it."""
    if not isinstance(light, _Area):
        raise TypeError(f"light: expected a light with size, such as RectLight, found {type(light).__name__}")
    return light._tuple_in(scene)


def parted(lights: Any, scene: Scene) -> tuple[list[Any], list[AreaTuple]]:
    """Parts lights of a scene, or one, into those without size, and the others as the extension module takes them."""
    if not isinstance(lights, Iterable):
        lights = [lights]
    areas = [light._tuple_in(scene) for light in lights if isinstance(light, _Area)]
    return [light for light in lights if not isinstance(light, _Area)], areas
