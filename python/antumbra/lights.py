"""Lights: where light comes from, and how much, which only pictures depend on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

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


def _colour(value: Any) -> tuple[float, float, float]:
    colour = vector("colour", value)
    if min(colour) < 0.0:
        raise ValueError(f"colour is {colour}: expected no negative number")
    return colour


def _direction(name: str, value: Any) -> tuple[float, float, float]:
    direction = vector(name, value)
    if not any(direction):
        raise ValueError(f"{name} is {direction}: expected a direction, which is not zero")
    return direction


@dataclass(frozen=True)
class PointLight:
    """A point that shines in all directions.

    Args:
        position: World space, three numbers.
        colour: Linear RGB, not negative; plays no part in shadow answers.
        falls_off: Whether it weakens with the square of the distance; plays no part in shadow answers.
        name: For layers of pictures.
    """

    position: Vector
    colour: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("position", self.position))
        object.__setattr__(self, "colour", _colour(self.colour))

    def _tuple(self) -> LightTuple:
        zero = (0.0, 0.0, 0.0)
        return ("point", self.name, self.position, zero, (0.0, 0.0), self.colour, self.falls_off)


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light, as of the sun. `DirectionalLight.sun` makes one from azimuth and elevation.

    Args:
        direction: From the scene **towards the light**, world space, any length but zero: `(0, 0, 1)` is a sun
            in the zenith of a scene with z up. If you have the vector along which light travels, negate it.
        colour: Linear RGB, not negative; plays no part in shadow answers.
        name: For layers of pictures.
    """

    direction: Vector
    colour: Vector = _White
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _direction("direction", self.direction))
        object.__setattr__(self, "colour", _colour(self.colour))

    @classmethod
    def sun(
        cls,
        azimuth_degrees: float,
        elevation_degrees: float,
        *,
        up: Literal["z", "y"] = "z",
        colour: Vector = _White,
        name: str = "sun",
    ) -> DirectionalLight:
        """Makes the light of a sun at a place of the sky, as the program's `--sun` does.

        **With z up, north is +y and east is +x. With y up, north is -z and east is +x.**

        Args:
            azimuth_degrees: Clockwise from north, seen from above: 90 is east, 180 is south. -3600 to 3600.
            elevation_degrees: Above the horizon, -90 to 90; below zero the sun shines from below, which is told as
                `AntumbraWarning`.
            up: The axis that points up in the scene.
            colour: As of the class.
            name: As of the class.
        """
        axes = {"z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0)}
        if up not in axes:
            raise ValueError(f'up is {up!r}: expected "z" or "y"')
        azimuth, elevation = float(azimuth_degrees), float(elevation_degrees)
        if not abs(azimuth) <= 3600.0:
            raise ValueError(f"azimuth_degrees is {azimuth}: expected -3600 to 3600")
        if not abs(elevation) <= 90.0:
            raise ValueError(f"elevation_degrees is {elevation}: expected -90 to 90")
        if elevation < 0.0:
            warn(f"the sun is {-elevation} degrees below the horizon: it shines from below")
        return cls(_antumbra.towards_sun(azimuth, elevation, axes[up]), colour, name)

    def _tuple(self) -> LightTuple:
        zero = (0.0, 0.0, 0.0)
        return ("directional", self.name, self.direction, zero, (0.0, 0.0), self.colour, False)


@dataclass(frozen=True)
class SpotLight:
    """A point that shines into a cone.

    The cone is power, not geometry: `ShadowIndex` asks whether something is between a point and the light, in the
    cone or not. Pictures know the cone.

    Args:
        position: World space, three numbers.
        axis: The middle of the cone, the way that the light goes, world space, any length but zero.
        half_angle_degrees: Between the axis and the cone's border, outside of which there is no light: above 0,
            at most 90.
        full_half_angle_degrees: Between the axis and where the light begins to fade; at most the other angle.
        colour: Linear RGB, not negative; plays no part in shadow answers.
        falls_off: Whether it weakens with the square of the distance; plays no part in shadow answers.
        name: For layers of pictures.
    """

    position: Vector
    axis: Vector
    half_angle_degrees: float = 45.0
    full_half_angle_degrees: float = 0.0
    colour: Vector = _White
    falls_off: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "position", vector("position", self.position))
        object.__setattr__(self, "axis", _direction("axis", self.axis))
        object.__setattr__(self, "colour", _colour(self.colour))
        full, half = self.full_half_angle_degrees, self.half_angle_degrees
        if not (0.0 <= full <= half <= 90.0 and half > 0.0):
            raise ValueError(
                f"half_angle_degrees is {half} and full_half_angle_degrees {full}: expected the former above 0, "
                "at most 90, and the latter from 0 to it"
            )

    def _tuple(self) -> LightTuple:
        angles = (self.full_half_angle_degrees, self.half_angle_degrees)
        inner, outer = (math.cos(math.radians(angle)) for angle in angles)
        return ("spot", self.name, self.position, self.axis, (inner, outer), self.colour, self.falls_off)


Light: TypeAlias = PointLight | DirectionalLight | SpotLight
"""Any of the lights."""


def light_of(parts: LightTuple) -> Light:
    """Returns the light that the extension module means."""
    kind, name, place, axis, (inner, outer), colour, falls_off = parts
    if kind == "point":
        return PointLight(place, colour, falls_off, name)
    if kind == "directional":
        return DirectionalLight(place, colour, name)
    full, half = (math.degrees(math.acos(min(1.0, max(0.0, cosine)))) for cosine in (inner, outer))
    return SpotLight(place, axis, half, min(full, half), colour, falls_off, name)


def tuples_of(lights: Any) -> list[LightTuple]:
    """Returns lights as the extension module takes them."""
    if isinstance(lights, (PointLight, DirectionalLight, SpotLight)):
        raise TypeError(f"lights: expected a sequence of lights, found one {type(lights).__name__}; give [light]")
    found = []
    for number, light in enumerate(lights):
        if not isinstance(light, (PointLight, DirectionalLight, SpotLight)):
            kind = type(light).__name__
            raise TypeError(f"lights[{number}]: expected PointLight, DirectionalLight or SpotLight, found {kind}")
        found.append(light._tuple())
    return found
