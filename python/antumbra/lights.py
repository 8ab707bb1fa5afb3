"""Lights: where light comes from, and how much, which only pictures depend on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from . import _antumbra
from ._arrays import vector
from ._warning import warn

Vector: TypeAlias = Sequence[float] | Any
"""Three numbers: a sequence or an array of shape (3,)."""

_White = (1.0, 1.0, 1.0)

LightTuple: TypeAlias = tuple[
    str, str, Sequence[float], Sequence[float], Sequence[float], Sequence[float], bool
]
"""A light as the extension module has it."""


def _color(color: Any, colour: Any) -> tuple[float, float, float]:
    """Checks a color, in either spelling."""
    found = vector("color", color if colour is None else colour)
    if min(found) < 0.0:
        raise ValueError(f"color is {found}: expected no negative number")
    return found


class _Colored:
    """What has a color."""

    color: Vector

    @property
    def colour(self) -> Vector:
        """The older spelling of `color`."""
        return self.color


def _direction(name: str, value: Any) -> tuple[float, float, float]:
    direction = vector(name, value)
    if not any(direction):
        raise ValueError(f"{name} is {direction}: expected a direction, which is not zero")
    return direction


def towards_sun(azimuth_degrees: Any, elevation_degrees: Any, up: Any) -> list[float]:
    """Returns the direction towards a place of the sky, and warns of one below the horizon."""
    axes = {"z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0)}
    if up not in axes:
        raise ValueError(f'up is {up!r}: expected "z" or "y"')
    for name, value in (("azimuth", azimuth_degrees), ("elevation", elevation_degrees)):
        if np.ndim(value) > 0:
            raise TypeError(f"{name}: expected one number, found shape {np.shape(value)}: make a sun for each")
    azimuth, elevation = float(azimuth_degrees), float(elevation_degrees)
    if not abs(azimuth) <= 3600.0:
        raise ValueError(f"the azimuth is {azimuth} degrees: expected -3600 to 3600")
    if not abs(elevation) <= 90.0:
        raise ValueError(f"the elevation is {elevation} degrees: expected -90 to 90")
    if elevation < 0.0:
        warn(f"the sun is {-elevation:.6g} degrees below the horizon: it shines from below. Leave out suns of the night")
    return _antumbra.towards_sun(azimuth, elevation, axes[up])


@dataclass(frozen=True, init=False)
class PointLight(_Colored):
    """A point that shines in all directions.

    Args:
        position: World space, three numbers.
        color: Linear RGB, not negative, by default white; plays no part in shadow answers.
        falls_off: Whether it weakens with the square of the distance; plays no part in shadow answers.
        name: For layers of pictures.
    """

    position: Vector
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __init__(
        self,
        position: Vector,
        color: Vector = _White,
        falls_off: bool = False,
        name: str = "",
        *,
        colour: Vector | None = None,
    ) -> None:
        object.__setattr__(self, "position", vector("position", position))
        object.__setattr__(self, "color", _color(color, colour))
        object.__setattr__(self, "falls_off", falls_off)
        object.__setattr__(self, "name", name)

    def _tuple(self) -> LightTuple:
        zero = (0.0, 0.0, 0.0)
        return ("point", self.name, self.position, zero, (0.0, 0.0), self.color, self.falls_off)


@dataclass(frozen=True, init=False)
class DirectionalLight(_Colored):
    """Parallel light, as of the sun. `antumbra.Sun` makes one from azimuth and elevation.

    Args:
        direction: From the scene **towards the light**, world space, any length but zero: `(0, 0, 1)` is a sun
            in the zenith of a scene with z up. If you have the vector along which light travels, negate it.
        color: Linear RGB, not negative, by default white; plays no part in shadow answers.
        name: For layers of pictures.
    """

    direction: Vector
    color: Vector = _White
    name: str = ""

    def __init__(
        self, direction: Vector, color: Vector = _White, name: str = "", *, colour: Vector | None = None
    ) -> None:
        object.__setattr__(self, "direction", _direction("direction", direction))
        object.__setattr__(self, "color", _color(color, colour))
        object.__setattr__(self, "name", name)

    @classmethod
    def sun(
        cls,
        azimuth_degrees: float,
        elevation_degrees: float,
        *,
        up: Literal["z", "y"] = "z",
        color: Vector = _White,
        name: str = "sun",
        colour: Vector | None = None,
    ) -> DirectionalLight:
        """Returns the light of a sun at a place of the sky, as `antumbra.Sun` and the program's `--sun` do.

        **With z up, north is +y and east is +x. With y up, north is -z and east is +x.**

        Args:
            azimuth_degrees: Clockwise from north, seen from above: 90 is east, 180 is south. -3600 to 3600.
            elevation_degrees: Above the horizon, -90 to 90; below zero the sun shines from below, which is reported as
                `AntumbraWarning`.
            up: The axis that points up in the scene.
            color: As of the class.
            name: As of the class.
            colour: The older spelling of `color`.
        """
        return cls(towards_sun(azimuth_degrees, elevation_degrees, up), color, name, colour=colour)

    def _tuple(self) -> LightTuple:
        zero = (0.0, 0.0, 0.0)
        return ("directional", self.name, self.direction, zero, (0.0, 0.0), self.color, False)


@dataclass(frozen=True, init=False)
class SpotLight(_Colored):
    """A point that shines into a cone.

    The cone is power, not geometry: `ShadowIndex` asks whether something is between a point and the light, in the
    cone or not. Pictures know the cone.

    Args:
        position: World space, three numbers.
        axis: The middle of the cone, the way that the light goes, world space, any length but zero.
        half_angle_degrees: Between the axis and the cone's border, outside of which there is no light: above 0,
            at most 90.
        full_half_angle_degrees: Between the axis and where the light begins to fade; at most the other angle.
        color: Linear RGB, not negative, by default white; plays no part in shadow answers.
        falls_off: Whether it weakens with the square of the distance; plays no part in shadow answers.
        name: For layers of pictures.
    """

    position: Vector
    axis: Vector
    half_angle_degrees: float = 45.0
    full_half_angle_degrees: float = 0.0
    color: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __init__(
        self,
        position: Vector,
        axis: Vector,
        half_angle_degrees: float = 45.0,
        full_half_angle_degrees: float = 0.0,
        color: Vector = _White,
        falls_off: bool = False,
        name: str = "",
        *,
        colour: Vector | None = None,
    ) -> None:
        object.__setattr__(self, "position", vector("position", position))
        object.__setattr__(self, "axis", _direction("axis", axis))
        object.__setattr__(self, "half_angle_degrees", half_angle_degrees)
        object.__setattr__(self, "full_half_angle_degrees", full_half_angle_degrees)
        object.__setattr__(self, "color", _color(color, colour))
        object.__setattr__(self, "falls_off", falls_off)
        object.__setattr__(self, "name", name)
        full, half = full_half_angle_degrees, half_angle_degrees
        if not (0.0 <= full <= half <= 90.0 and half > 0.0):
            raise ValueError(
                f"half_angle_degrees is {half} and full_half_angle_degrees {full}: expected the former above 0, "
                "at most 90, and the latter from 0 to it"
            )

    def _tuple(self) -> LightTuple:
        angles = (self.full_half_angle_degrees, self.half_angle_degrees)
        inner, outer = (math.cos(math.radians(angle)) for angle in angles)
        return ("spot", self.name, self.position, self.axis, (inner, outer), self.color, self.falls_off)


def Sun(
    azimuth: float,
    elevation: float,
    *,
    up: Literal["z", "y"] = "z",
    color: Vector = _White,
    name: str = "sun",
) -> DirectionalLight:
    """Returns the light of a sun at a place of the sky.

    **With z up, north is +y and east is +x. With y up, north is -z and east is +x.**

    Args:
        azimuth: Degrees clockwise from north, seen from above: 90 is east, 180 is south. -3600 to 3600.
        elevation: Degrees above the horizon, -90 to 90; below zero the sun shines from below, which an
            `AntumbraWarning` says.
        up: The axis that points up in the scene, `"z"` or `"y"`.
        color: Linear RGB, not negative, by default white; plays no part in shadow answers.
        name: For layers of pictures.

    Raises:
        ValueError: A number is out of range.
    """
    return DirectionalLight.sun(azimuth, elevation, up=up, color=color, name=name)


Light: TypeAlias = PointLight | DirectionalLight | SpotLight
"""Any of the lights."""


def light_of(parts: LightTuple) -> Light:
    """Returns the light that the extension module means."""
    kind, name, place, axis, (inner, outer), color, falls_off = parts
    if kind == "point":
        return PointLight(place, color, falls_off, name)
    if kind == "directional":
        return DirectionalLight(place, color, name)
    full, half = (math.degrees(math.acos(min(1.0, max(0.0, cosine)))) for cosine in (inner, outer))
    return SpotLight(place, axis, half, min(full, half), color, falls_off, name)


def tuples_of(lights: Any) -> list[LightTuple]:
    """Returns lights, or one, as the extension module takes them."""
    if isinstance(lights, (PointLight, DirectionalLight, SpotLight)):
        lights = [lights]
    if not isinstance(lights, Iterable):
        lights = [lights]
    found = []
    for number, light in enumerate(lights):
        if not isinstance(light, (PointLight, DirectionalLight, SpotLight)):
            kind = type(light).__name__
            advice = ": a light with size is asked by visible_fraction" if hasattr(light, "_tuple_in") else ""
            raise TypeError(
                f"lights[{number}]: expected PointLight, DirectionalLight or SpotLight, found {kind}{advice}"
            )
        found.append(light._tuple())
    return found
