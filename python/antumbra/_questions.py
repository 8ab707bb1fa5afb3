"""The questions that an index answers, one a method.

In: arrays of points, and what is known of them. Out: arrays of answers. Invariant: what is asked is what the method's
name says; arrays that fit are not copied. Absent here: how an index is made and kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias, overload

import numpy as np
import numpy.typing as npt

from . import _antumbra
from ._arrays import Lights, Reals, numbers, places, reach, rows, rows_like, thread_count
from ._progress import Progress, reporter
from ._warning import warn_of_surfaces
from .scene import Scene

Answers: TypeAlias = npt.NDArray[np.bool_] | npt.NDArray[np.uint8]
"""A bool for each point and light, or bits."""

def _reach(tolerance: float | None, face_ids: npt.NDArray[np.uint32] | None) -> float | None:
    """Checks the tolerance of the starts of segments or rays."""
    if tolerance is not None and face_ids is None:
        raise ValueError("tolerance: only points with face_ids have one")
    return reach(tolerance)


class Questions:
    """Queries of a `ShadowIndex`."""

    _native: _antumbra.ShadowIndex
    _scene: Scene

    @overload
    def occluded_on_faces(
        self,
        points: Any,
        face_ids: Any,
        lights: Lights = None,
        *,
        tolerance: float | None = None,
        packed: Literal[False] = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]: ...

    @overload
    def occluded_on_faces(
        self,
        points: Any,
        face_ids: Any,
        lights: Lights = None,
        *,
        tolerance: float | None = None,
        packed: Literal[True],
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.uint8]: ...

    @overload
    def occluded_on_faces(
        self,
        points: Any,
        face_ids: Any,
        lights: Lights = None,
        *,
        tolerance: float | None = None,
        packed: bool,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers: ...

    def occluded_on_faces(
        self,
        points: Any,
        face_ids: Any,
        lights: Lights = None,
        *,
        tolerance: float | None = None,
        packed: bool = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers:
        """Answers for points on faces that you name whether an opaque surface stands between them and a light.

        The points are **on those faces** up to rounding, also that to float32. Each is moved onto its face exactly,
        nothing is offset, and the face does not block its own points. This is the fastest and the surest question.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite.
            face_ids: Shape (n,), integers: numbers of the scene's surfaces.
            lights: A light's place, a sequence of places, or `None`, the default, for all lights.
            tolerance: How far points may be from their faces, world units, `math.inf` for any distance. By default as
                far as rounding to float32 may have moved them, 2^-21 of the coordinates of the point and the face.
            packed: Whether to return bits.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.
            progress: As of the class.

        Returns:
            True where the light is blocked: shape (n,) for one light, else (n, lights). With `packed` uint8, eight
            points a byte, the first in the lowest bit: the bytes of
            `np.packbits(answers, axis=0, bitorder="little")`.

        Raises:
            ValueError: A shape does not fit, a number is not finite, or a point is not on the face that it names.
            TypeError: A dtype does not fit.
            IndexError: A light or a face does not exist.

        Arrays are not copied where they are in C order and of a dtype named above. The interpreter's lock is
        released, and Ctrl-C ends the call. Do not change the arrays meanwhile: answers would be to either.
        """
        at = rows("points", points)
        ids = numbers("face_ids", face_ids, (len(at),), self._scene.surface_count, "surfaces")
        return self._ask(at, "lights", lights, None, ids, False, tolerance, packed, threads, progress)

    @overload
    def occluded_near(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        tolerance: float | None = None,
        packed: Literal[False] = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]: ...

    @overload
    def occluded_near(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        tolerance: float | None = None,
        packed: Literal[True],
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.uint8]: ...

    @overload
    def occluded_near(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        tolerance: float | None = None,
        packed: bool,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers: ...

    def occluded_near(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        tolerance: float | None = None,
        packed: bool = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers:
        """Answers for points on surfaces that are not named: each is on the nearest, which is looked for first.

        Then it answers as `occluded_on_faces` does, which is faster where the faces are known.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite.
            lights: A light's place, a sequence of places, or `None`, the default, for all lights.
            normals: Shape (n, 3), any length: they choose among surfaces that are as near, as at an edge; zero for
                none.
            tolerance: How far points may be from the nearest surface, world units. By default as far as rounding may
                have moved them: 2^-42 of the coordinates of the point and the surface, 2^-21 for float32 points.
            packed: Whether to return bits.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.
            progress: As of the class.

        Returns:
            True where the light is blocked: shape (n,) for one light, else (n, lights). With `packed` uint8, eight
            points a byte, the first in the lowest bit: the bytes of
            `np.packbits(answers, axis=0, bitorder="little")`.

        Raises:
            ValueError: A shape does not fit, a number is not finite, or a point is on no surface.
            TypeError: A dtype does not fit.
            IndexError: A light does not exist.
        """
        at = rows("points", points)
        return self._ask(at, "lights", lights, normals, None, True, tolerance, packed, threads, progress)

    @overload
    def occluded_at(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        packed: Literal[False] = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]: ...

    @overload
    def occluded_at(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        packed: Literal[True],
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.uint8]: ...

    @overload
    def occluded_at(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        packed: bool,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers: ...

    def occluded_at(
        self,
        points: Any,
        lights: Lights = None,
        normals: Any = None,
        *,
        packed: bool = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers:
        """Answers for points of space, taken as given, whether an opaque surface stands between them and a light.

        A point that lies on a surface up to rounding may be in that surface's shadow: where many do, an
        `AntumbraWarning` says how many and what to call instead.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite.
            lights: A light's place, a sequence of places, or `None`, the default, for all lights.
            normals: Shape (n, 3), any length: a light that is not strictly on a normal's side counts as blocked; zero
                faces no light. By default points face everywhere.
            packed: Whether to return bits.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.
            progress: As of the class.

        Returns:
            True where the light is blocked: shape (n,) for one light, else (n, lights). With `packed` uint8, eight
            points a byte, the first in the lowest bit: the bytes of
            `np.packbits(answers, axis=0, bitorder="little")`.

        Raises:
            ValueError: A shape does not fit, or a number is not finite.
            TypeError: A dtype does not fit.
            IndexError: A light does not exist.
        """
        at = rows("points", points)
        answers = self._ask(at, "lights", lights, normals, None, False, None, packed, threads, progress)
        warn_of_surfaces("points", self._native.suspicious_share(at), "occluded_near, or occluded_on_faces")
        return answers

    @overload
    def occluded(
        self,
        points: Any,
        light_index: int | Sequence[int] | npt.NDArray[np.integer[Any]] = 0,
        normals: Any = None,
        face_ids: Any = None,
        on_surface: bool = False,
        *,
        tolerance: float | None = None,
        packed: Literal[False] = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]: ...

    @overload
    def occluded(
        self,
        points: Any,
        light_index: int | Sequence[int] | npt.NDArray[np.integer[Any]] = 0,
        normals: Any = None,
        face_ids: Any = None,
        on_surface: bool = False,
        *,
        tolerance: float | None = None,
        packed: Literal[True],
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.uint8]: ...

    @overload
    def occluded(
        self,
        points: Any,
        light_index: int | Sequence[int] | npt.NDArray[np.integer[Any]] = 0,
        normals: Any = None,
        face_ids: Any = None,
        on_surface: bool = False,
        *,
        tolerance: float | None = None,
        packed: bool,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers: ...

    def occluded(
        self,
        points: Any,
        light_index: int | Sequence[int] | npt.NDArray[np.integer[Any]] = 0,
        normals: Any = None,
        face_ids: Any = None,
        on_surface: bool = False,
        *,
        tolerance: float | None = None,
        packed: bool = False,
        threads: int = 0,
        progress: Progress = None,
    ) -> Answers:
        """Answers for each point whether an opaque surface stands between it and a light.

        The methods above ask one question each; this one asks any of them. What is asked depends on what is known of
        the points:

        * nothing: they are **points of space**, taken as given. A point that lies on a surface up to rounding may
          then be in that surface's shadow: where many do, an `AntumbraWarning` says so;
        * `normals`: points of space that face somewhere. Blocked is also a light that is not strictly on the
          normal's side;
        * `face_ids`: points **on those surfaces**, up to rounding, also that to float32. The start is moved onto
          the surface exactly, nothing is offset, and the surface does not block its own points;
        * `on_surface`: points on surfaces that are not named: each is on the nearest, which is looked for first.
          `normals`, if given, choose among surfaces that are as near. It is slower than `face_ids`.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite.
            light_index: A light's place, or a sequence of them.
            normals: Shape (n, 3), any length; zero faces no light.
            face_ids: Shape (n,), integers: numbers of the scene's surfaces.
            on_surface: Whether the points lie on surfaces that are not named.
            tolerance: How far points may be from their surface, world units, `math.inf` for any distance. By default
                as far as rounding may have moved them: with `on_surface` 2^-42 of the coordinates of the point and
                the surface, or 2^-21 where the points are float32; with `face_ids` 2^-21.
            packed: Whether to return bits.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.
            progress: As of the class.

        Returns:
            True where the light is blocked: shape (n,), or (n, lights) for a sequence of lights. With `packed`
            uint8, eight points a byte, the first in the lowest bit: the bytes of
            `np.packbits(answers, axis=0, bitorder="little")`.

        Raises:
            ValueError: A shape does not fit, a number is not finite, a point is on no surface, or not on the face that
                it names.
            TypeError: A dtype does not fit.
            IndexError: A light or a surface does not exist.

        Arrays are not copied where they are in C order and of a dtype named above. The interpreter's lock is
        released, and Ctrl-C ends the call. Do not change the arrays meanwhile: answers would be to either.
        """
        at = rows("points", points)
        ids = None
        if face_ids is not None:
            if normals is not None or on_surface:
                raise ValueError("face_ids say where points are: give them without normals and on_surface")
            ids = numbers("face_ids", face_ids, (len(at),), self._scene.surface_count, "surfaces")
        if tolerance is not None and not on_surface and ids is None:
            raise ValueError("tolerance: only points with face_ids or on_surface=True have one")
        answers = self._ask(
            at, "light_index", light_index, normals, ids, bool(on_surface), tolerance, packed, threads, progress
        )
        if ids is None and not on_surface:
            warn_of_surfaces("points", self._native.suspicious_share(at), "on_surface=True or face_ids")
        return answers

    def _ask(
        self,
        at: Reals,
        name: str,
        lights: Lights,
        normals: Any,
        ids: npt.NDArray[np.uint32] | None,
        on_surface: bool,
        tolerance: float | None,
        packed: bool,
        threads: int,
        progress: Progress,
    ) -> Answers:
        was_single = at.dtype == np.float32
        light_count = len(self._native.lights)
        if lights is None:
            asked, is_one = list(range(light_count)), False
        else:
            asked, is_one = places(name, lights, light_count, "lights")
        directions = None
        if normals is not None:
            at, directions = rows_like("normals", normals, "points", at)
        answers = self._native.occluded(
            at,
            asked,
            directions,
            ids,
            on_surface,
            reach(tolerance),
            was_single,
            bool(packed),
            thread_count(threads),
            reporter(progress),
        )
        if packed:
            return answers[0] if is_one else answers.T
        return (answers[:, 0] if is_one else answers).view(np.bool_)

    def occluded_segments(
        self,
        a: Any,
        b: Any,
        face_ids: Any = None,
        *,
        tolerance: float | None = None,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]:
        """Answers for each pair of points whether an opaque surface stands between them.

        The segments hold neither of their ends: a surface that holds an end exactly does not block there. Ends
        are taken as given, unless `face_ids` names the surfaces of the first. An end that is a rounded point of a
        surface may lie behind it, and the surface blocks then: give the point of the surface as `a`, or move `b`.

        Lights play no part, and values know nothing about such segments: each is a ray.

        Args:
            a: Shape (n, 3), float32 or float64, world space, finite.
            b: The same shape.
            face_ids: Shape (n,), integers: the surfaces that the points of `a` lie on, up to rounding.
            tolerance: How far those may be from them, as for `occluded`.
            threads: Threads that work; 0 for one a processor.
            progress: As of the class.

        Returns:
            True where something is between, shape (n,).
        """
        first = rows("a", a)
        first, second = rows_like("b", b, "a", first)
        ids = None
        if face_ids is not None:
            ids = numbers("face_ids", face_ids, (len(first),), self._scene.surface_count, "surfaces")
        most = _reach(tolerance, ids)
        found = self._native.occluded_segments(first, second, ids, most, thread_count(threads), reporter(progress))
        if ids is None:
            warn_of_surfaces("a", self._native.suspicious_share(first), "face_ids")
        return found.view(np.bool_)

    def occluded_rays(
        self,
        origins: Any,
        directions: Any,
        face_ids: Any = None,
        *,
        tolerance: float | None = None,
        threads: int = 0,
        progress: Progress = None,
    ) -> npt.NDArray[np.bool_]:
        """Answers for each ray whether it meets an opaque surface, as `occluded_segments` does for segments.

        Args:
            origins: Shape (n, 3), float32 or float64, world space, finite. A ray does not hold its origin.
            directions: The same shape, any length; a zero direction meets nothing.
            face_ids: Shape (n,), integers: the surfaces that the origins lie on, up to rounding.
            tolerance: How far those may be from them, as for `occluded`.
            threads: Threads that work; 0 for one a processor.
            progress: As of the class.

        Returns:
            True where something is met, shape (n,).
        """
        first = rows("origins", origins)
        first, second = rows_like("directions", directions, "origins", first)
        ids = None
        if face_ids is not None:
            ids = numbers("face_ids", face_ids, (len(first),), self._scene.surface_count, "surfaces")
        most = _reach(tolerance, ids)
        found = self._native.occluded_rays(first, second, ids, most, thread_count(threads), reporter(progress))
        if ids is None:
            warn_of_surfaces("origins", self._native.suspicious_share(first), "face_ids")
        return found.view(np.bool_)
