"""The rule of EXACTNESS.md for free rays and triangles, in rational numbers: who is right where engines differ."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, TypeAlias

Vector: TypeAlias = tuple[Fraction, Fraction, Fraction]


def exact(numbers: Any) -> Vector:
    """Returns the exact values of three floats."""
    x, y, z = (Fraction(float(number)) for number in numbers)
    return x, y, z


def minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def distance(origin: Any, direction: Any, triangle: Sequence[Any]) -> Fraction | None:
    """Returns where a ray meets a triangle, in lengths of the direction; `None` if it does not.

    It does if its origin lies strictly on one side of the plane and goes to the other, and its line meets the
    closed triangle.
    """
    start, towards = exact(origin), exact(direction)
    a, b, c = (minus(exact(corner), start) for corner in triangle)
    normal = cross(minus(b, a), minus(c, a))
    height, rate = dot(normal, a), dot(normal, towards)
    if height * rate <= 0:
        return None
    signs = [dot(towards, cross(p, q)) for p, q in ((a, b), (b, c), (c, a))]
    if any(sign < 0 for sign in signs) and any(sign > 0 for sign in signs):
        return None
    return height / rate
