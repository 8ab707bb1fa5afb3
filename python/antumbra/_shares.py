"""Shares in place of bits: visible fractions of lights with size, lit intervals, ambient occlusion, sky view factors.

In: arrays of points, and what is known of them. Out: arrays of numbers from 0 to 1. Absent here: bits of
single points and lights.
"""

from __future__ import annotations

import math
from typing import Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

from . import _antumbra
from ._arrays import Lights, Reals, numbers, places, reach, rows, rows_like, thread_count, vector, whole
from ._warning import warn_of_surfaces
from .area import AreaLight, SegmentLight, Side, area_tuple_of
from .lights import Light, tuples_of
from .scene import Scene

SAMPLES_BESIDE_EXACT = 64
"""Samples of a light at points where its visible fraction has no closed form."""


class FractionSettings(TypedDict):
    """How shares are computed, as the extension module takes it."""

    side: str
    samples: int
    seed: int
    tolerance: float | None
    threads: int


class Shares:
    """Queries of a `ShadowIndex` that are answered by shares."""

    _native: _antumbra.ShadowIndex
    _scene: Scene

    def visible_fraction(
        self,
        points: Any,
        light: AreaLight,
        face_ids: Any = None,
        *,
        normals: Any = None,
        side: Side = "front",
        samples: int | Literal["exact"] = 64,
        seed: int = 0,
        tolerance: float | None = None,
        threads: int = 0,
    ) -> npt.NDArray[Any]:
        """Answers for each point which share of a light with size it sees, by samples that are answered exactly, or exactly.

        The light need not be one of the index. Points mean what they mean in `occluded`.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite. Without `face_ids` they are points of space: an
                `AntumbraWarning` says it where many lie on surfaces.
            light: Such as `RectLight` or `SunDisc`.
            face_ids: Shape (n,), integers: the surfaces that the points lie on.
            normals: Shape (n, 3): points of space that face somewhere see what is on the normal's side.
            side: For points with `face_ids`: from which side of the surface they look, `"front"` as its winding
                says, `"back"`, or `"both"`. What is on the other side counts as not seen.
            samples: Samples a point, 1 to 65536; powers of two are spread best. `"exact"` takes no samples: it cuts the
                light by the shadows of triangles. Where that has no closed form (more than 256 triangles in the way,
                curved or alpha-tested surfaces, lights that are spheres or the sky) 64 samples answer;
                `exact_visible_fraction` says where.
            seed: Changes the samples. Each row has samples of its own.
            tolerance: As of `occluded`, with `face_ids` only.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.

        Returns:
            The number of samples seen over all samples, float32, shape (n,); with `"exact"` the share itself, float64.

        Raises:
            ValueError: A shape does not fit, a number is not finite, or a point is not on the face that it names.
            TypeError: A dtype does not fit, or the light has no size.
            IndexError: A surface does not exist.
        """
        if isinstance(samples, str) and samples != "exact":
            raise ValueError(f'samples is {samples!r}: expected a number or "exact"')
        if samples == "exact":
            how = {"normals": normals, "tolerance": tolerance}
            return self.exact_visible_fraction(points, light, face_ids, side=side, seed=seed, threads=threads, **how)[0]
        parts = area_tuple_of(light, self._scene)
        checked = self._checked(points, face_ids, normals, side, samples, seed, tolerance, threads)
        places, ids, directions, settings = checked
        found, _ = _antumbra.visible_fraction(self._native, places, ids, directions, parts, False, settings)
        self._warn_of_space(places, ids)
        return found.astype(np.float32)

    def exact_visible_fraction(
        self,
        points: Any,
        light: AreaLight,
        face_ids: Any = None,
        *,
        normals: Any = None,
        side: Side = "front",
        samples: int = SAMPLES_BESIDE_EXACT,
        seed: int = 0,
        tolerance: float | None = None,
        threads: int = 0,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
        """Answers for each point which share of a light it sees, without samples where there is a closed form.

        The share is by length, area, or for `SunDisc` solid angle: the number that samples converge to, right to 2^-32 at
        least. It is 0 or 1 exactly where the light is wholly hidden or wholly visible.

        Args:
            points: As of `visible_fraction`, like all that follow but `samples`.
            light: The light.
            face_ids: Surfaces that the points lie on.
            normals: Normals of points of space.
            side: Side of the surface that is looked from.
            samples: Samples at points that have no closed form.
            seed: Changes these samples.
            tolerance: How far points may lie off their faces.
            threads: Threads that work.

        Returns:
            The shares, float64, shape (n,); and where they are exact, bool, shape (n,): samples answered elsewhere.

        Raises:
            ValueError: As of `visible_fraction`.
            TypeError: As of `visible_fraction`.
            IndexError: As of `visible_fraction`.
        """
        parts = area_tuple_of(light, self._scene)
        checked = self._checked(points, face_ids, normals, side, samples, seed, tolerance, threads)
        places, ids, directions, settings = checked
        found, exact = _antumbra.visible_fraction(self._native, places, ids, directions, parts, True, settings)
        self._warn_of_space(places, ids)
        if exact is None:
            exact = np.ones(len(found), dtype=np.bool_)
        return found, exact

    def lit_intervals(
        self, point: Any, light: SegmentLight, *, face_id: int | None = None, side: Side = "front"
    ) -> npt.NDArray[np.float64] | None:
        """Answers which parts of a linear light a point sees.

        Args:
            point: Shape (3,), world space.
            light: A `SegmentLight`.
            face_id: The surface that the point lies on; `None` for a point of space.
            side: Side of the surface that is looked from.

        Returns:
            Begins and ends of the lit intervals in order, as shares of the length from the light's first end, float64,
            shape (k, 2); `None` where there is no closed form, as a curved or alpha-tested surface may be in the way.

        Raises:
            ValueError: The point is not finite, or the light is not linear.
            IndexError: The surface does not exist.
        """
        at = vector("point", point)
        if face_id is not None:
            face_id = whole("face_id", face_id, 0, 2**32 - 1)
            if face_id >= self._scene.surface_count:
                raise IndexError(f"face_id is {face_id}: expected less than {self._scene.surface_count}, the number of surfaces")
        found = _antumbra.lit_intervals(self._native, at, face_id, area_tuple_of(light, self._scene), side)
        if face_id is None:
            warn_of_surfaces("point", self._native.suspicious_share(np.array([at])), "face_id")
        return None if found is None else np.array(found, dtype=np.float64).reshape(-1, 2)

    def lit_intervals_along(
        self, origins: Any, ends: Any, light: int | Light, *, threads: int = 0
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """Answers for each segment which of its points a light reaches: shafts of light in fog are where view rays are lit.

        Points of a segment are points of space, those at both ends, too. Exact is how many intervals there are and between
        which shadows; each end is the float64 nearest to the exact crossing. `lit_intervals` asks the reverse: what part of a
        linear light one point sees.

        Args:
            origins: Shape (n, 3), float32 or float64, world space, finite.
            ends: The same shape. A segment without length is lit as a whole, or not at all.
            light: A light of the index by its place, or any light: its position or direction counts. The cone of a
                `SpotLight` is power, and clips nothing.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.

        Returns:
            offsets: Shape (n + 1,), int64: the intervals of segment `i` are `intervals[offsets[i]:offsets[i + 1]]`.
            intervals: Shape (k, 2), float64: begin and end of each, as shares of the length from the origin, in order.

        Raises:
            ValueError: A shape does not fit, a number is not finite, or an alpha-tested surface may shade some of a segment: its
                shadow has no closed form here.
            TypeError: A dtype does not fit, or the light has a size.
            IndexError: The light does not exist.
        """
        first = rows("origins", origins)
        first, second = rows_like("ends", ends, "origins", first)
        if isinstance(light, Light):
            [parts] = tuples_of(light)
        else:
            lights = self._native.lights
            found, is_one = places("light", light, len(lights), "lights")
            if not is_one:
                raise TypeError(f"light: expected one light, found {type(light).__name__}")
            parts = lights[found[0]]
        return _antumbra.lit_intervals_along(self._native, first, second, parts, thread_count(threads))

    def transmittance(
        self,
        points: Any,
        lights: Lights = None,
        face_ids: Any = None,
        *,
        on_surface: bool = False,
        tolerance: float | None = None,
        threads: int = 0,
    ) -> npt.NDArray[np.float64]:
        """Answers for each point which shares of a light's red, green and blue reach it: 0 behind opaque surfaces, else the
        product over all see-through surfaces between, which light crosses straight on.

        What a surface lets through is its material's (docs/formats.md): what it transmits, and what its alpha leaves. Exact is
        which surfaces are crossed; a sheet of triangles filters once, also where light crosses an edge of them.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite. Without `face_ids` they are points of space.
            lights: A light's place, a sequence of places, or `None`, the default, for all lights.
            face_ids: Shape (n,), integers: numbers of the surfaces that the points lie on, up to rounding.
            on_surface: Whether points without `face_ids` are taken as points of the nearest surface.
            tolerance: How far points may be from their surfaces, as for `occluded_on_faces`.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.

        Returns:
            Shares from 0 to 1: float64, shape (n, 3) for one light, else (n, lights, 3).

        Raises:
            ValueError: A shape does not fit, a number is not finite, or a point is not on its surface.
            TypeError: A dtype does not fit.
            IndexError: A light or a face does not exist.
        """
        at = rows("points", points)
        ids = None
        if face_ids is not None:
            ids = numbers("face_ids", face_ids, (len(at),), self._scene.surface_count, "surfaces")
        elif not on_surface:
            if tolerance is not None:
                raise ValueError("tolerance: only points on surfaces have one")
            warn_of_surfaces("points", self._native.suspicious_share(at), "face_ids, or on_surface=True")
        light_count = len(self._native.lights)
        if lights is None:
            asked, is_one = list(range(light_count)), False
        else:
            asked, is_one = places("lights", lights, light_count, "lights")
        was_single = at.dtype == np.float32
        shares = _antumbra.transmittance(
            self._native, at, asked, ids, on_surface, reach(tolerance), was_single, thread_count(threads)
        )
        return shares[:, 0] if is_one else shares

    def ambient_occlusion(
        self,
        points: Any,
        face_ids: Any = None,
        *,
        normals: Any = None,
        distance: float | None = None,
        side: Side = "front",
        samples: int = 256,
        seed: int = 0,
        tolerance: float | None = None,
        threads: int = 0,
    ) -> npt.NDArray[np.float32]:
        """Answers for each point how open what is around it is: 1 is open, 0 closed all around.

        Points with `face_ids` or `normals` look into the half sphere around the normal, directions weighted by their
        cosine to it. Points of space, and those with `side="both"`, look all around, all directions alike.

        Args:
            points: Shape (n, 3), float32 or float64, world space, finite. Without `face_ids` they are points of space: an
                `AntumbraWarning` says it where many lie on surfaces.
            face_ids: Shape (n,), integers: the surfaces that the points lie on.
            normals: Shape (n, 3), of any length; of a point with a zero normal nothing is open.
            distance: Distance, above 0, up to which surfaces count; `None` for any.
            side: For points with `face_ids`: the side that they look to.
            samples: Directions a point, 1 to 65536; powers of two are spread best. Each is answered exactly.
            seed: Changes the directions. Each row has directions of its own.
            tolerance: As of `occluded`, with `face_ids` only.
            threads: Threads that work; 0 for one a processor. Answers do not depend on them.

        Returns:
            The share of directions in which nothing opaque is nearer than `distance`, float32, shape (n,).

        Raises:
            ValueError: A shape does not fit, a number is not finite, or a point is not on the face that it names.
            TypeError: A dtype does not fit.
            IndexError: A surface does not exist.
        """
        if distance is not None:
            distance = float(distance)
            if not distance > 0.0:
                raise ValueError(f"distance is {distance}: expected above 0, or None for any")
            distance = distance if math.isfinite(distance) else None
        checked = self._checked(points, face_ids, normals, side, samples, seed, tolerance, threads)
        places, ids, directions, settings = checked
        found, _ = _antumbra.ambient_occlusion(self._native, places, ids, directions, distance, settings)
        self._warn_of_space(places, ids)
        return found.astype(np.float32)

    def sky_view_factor(
        self,
        points: Any,
        face_ids: Any = None,
        *,
        normals: Any = None,
        up: Any = None,
        side: Side = "front",
        samples: int = 256,
        seed: int = 0,
        tolerance: float | None = None,
        threads: int = 0,
    ) -> npt.NDArray[np.float32]:
        """Answers for each point which share it gets of the light of an equally bright sky: 1 on open ground.

        Directions are weighted by their cosine to the receiver's normal, and none below the horizon is sky, so a free
        wall has 0.5. Points of space are level ground.

        Args:
            points: As of `ambient_occlusion`, like all that follow but `up`.
            face_ids: Surfaces that the points lie on.
            normals: Normals of points of space.
            up: Where the middle of the sky is, shape (3,); by default the scene's up, with a warning where its file does
                not say it.
            side: Side of the surface.
            samples: Directions a point.
            seed: Changes the directions.
            tolerance: How far points may lie off their faces.
            threads: Threads that work.

        Returns:
            The share, float32, shape (n,).

        Raises:
            ValueError: As of `ambient_occlusion`, or `up` is zero.
            TypeError: As of `ambient_occlusion`.
            IndexError: As of `ambient_occlusion`.
        """
        towards = self._scene._up_for("the sky") if up is None else vector("up", up)
        checked = self._checked(points, face_ids, normals, side, samples, seed, tolerance, threads)
        places, ids, directions, settings = checked
        found, _ = _antumbra.sky_view_factor(self._native, places, ids, directions, towards, settings)
        self._warn_of_space(places, ids)
        return found.astype(np.float32)

    def _warn_of_space(self, places: Reals, ids: npt.NDArray[np.uint32] | None) -> None:
        """Warns of points that are answered as points of space and lie on surfaces."""
        if ids is None:
            warn_of_surfaces("points", self._native.suspicious_share(places), "face_ids")

    def _checked(
        self,
        points: Any,
        face_ids: Any,
        normals: Any,
        side: str,
        samples: int,
        seed: int,
        tolerance: float | None,
        threads: int,
    ) -> tuple[Reals, npt.NDArray[np.uint32] | None, Reals | None, FractionSettings]:
        """Checks points and settings."""
        places_of_points = rows("points", points)
        directions = None
        if normals is not None:
            if face_ids is not None:
                raise ValueError("face_ids say where points are: give them without normals")
            places_of_points, directions = rows_like("normals", normals, "points", places_of_points)
        ids = None
        if face_ids is not None:
            shape = (len(places_of_points),)
            ids = numbers("face_ids", face_ids, shape, self._scene.surface_count, "surfaces")
        elif tolerance is not None:
            raise ValueError("tolerance: only points with face_ids have one")
        how: FractionSettings = {
            "side": side,
            "samples": whole("samples", samples, 1, 65536),
            "seed": whole("seed", seed, 0, 2**64 - 1),
            "tolerance": reach(tolerance),
            "threads": thread_count(threads),
        }
        return places_of_points, ids, directions, how
