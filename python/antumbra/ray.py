"""A ray intersector for `trimesh`, in place of its own.

```python
mesh.ray = antumbra.ray.RayMeshIntersector(mesh)
mesh.ray.intersects_any(origins, directions)
```

or, for all meshes that are made from then on:

```python
antumbra.ray.install()
```

Needs the package `trimesh`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

try:
    from trimesh import caching, grouping
    from trimesh.ray.ray_util import contains_points
except ImportError as error:
    raise ImportError('antumbra.ray needs the package trimesh: pip install "antumbra[trimesh]"') from error

from . import _antumbra
from ._arrays import Reals, numbers, rows, rows_like, thread_count
from .index import settings
from .scene import Scene


class RayMeshIntersector:
    """Ray queries of a mesh, with the signatures of `trimesh.ray`.

    Which faces a ray meets is exact: a ray through an edge or a vertex meets the faces around it and leaks nowhere.
    A ray holds neither its origin nor a face that it lies in: a face whose plane holds the origin, exactly, or the
    whole ray, is not met. An origin that rounding put before its face meets the face; `face_ids` names faces that
    origins lie on, which are not met again. Where a face is met is rounded to float64, and so is the order of hits.

    It differs from the intersectors of trimesh in what they leave to rounding, and here:

    * `ray_triangle` takes hits up to 1e-6 behind the origin and 1e-12 beside a face, `ray_pyembree` rounds all to
      float32 and steps over 1e-6 of the mesh's size behind each of many hits: here nothing is added or left out;
    * a direction may have any length; a zero one meets nothing; one that is not finite is a `ValueError`.

    Args:
        geometry: A `trimesh.Trimesh`. When it changes, the next query builds a new index.
        scale_to_box: Taken for the sake of `ray_pyembree` and not needed: every scale is exact.
        threads: Threads that work; 0 for one a processor.
    """

    def __init__(self, geometry: Any, scale_to_box: bool = True, *, threads: int = 0) -> None:
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._threads = thread_count(threads)
        self._cache: Any = caching.Cache(id_function=self.mesh.__hash__)

    @property
    def _index(self) -> _antumbra.ShadowIndex:
        self._cache.verify()
        index: _antumbra.ShadowIndex | None = self._cache["index"]
        if index is None:
            scene = Scene.from_trimesh(self.mesh)
            index = _antumbra.ShadowIndex(
                scene._native, [], settings(method="bvh", threads=self._threads), None, None
            )
            self._cache["index"] = index
        return index

    def _rays(
        self, ray_origins: Any, ray_directions: Any, face_ids: Any
    ) -> tuple[Reals, Reals, npt.NDArray[np.uint32] | None]:
        origins = rows("ray_origins", ray_origins)
        origins, directions = rows_like("ray_directions", ray_directions, "ray_origins", origins)
        ids = None
        if face_ids is not None:
            ids = numbers("face_ids", face_ids, (len(origins),), len(self.mesh.faces), "faces")
        return origins, directions, ids

    def intersects_location(
        self,
        ray_origins: Any,
        ray_directions: Any,
        multiple_hits: bool = True,
        *,
        face_ids: Any = None,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Returns where rays meet the mesh.

        Args:
            ray_origins: Shape (n, 3).
            ray_directions: Shape (n, 3).
            multiple_hits: Whether to return all hits, or the first of each ray.
            face_ids: Shape (n,): the faces that the origins lie on.

        Returns:
            locations: Shape (m, 3). Places of one ray that `trimesh` takes for equal are given once.
            index_ray: Shape (m,): numbers of rays.
            index_tri: Shape (m,): numbers of faces.
        """
        index_tri, index_ray, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits, return_locations=True, face_ids=face_ids
        )
        return locations, index_ray, index_tri

    def intersects_id(
        self,
        ray_origins: Any,
        ray_directions: Any,
        multiple_hits: bool = True,
        max_hits: int | None = None,
        return_locations: bool = False,
        *,
        face_ids: Any = None,
    ) -> Any:
        """Returns which faces rays meet: ray after ray, each by distance.

        Args:
            ray_origins: Shape (n, 3).
            ray_directions: Shape (n, 3).
            multiple_hits: Whether to return all hits, or the first of each ray.
            max_hits: Most hits of a ray, the first ones; `None` for all.
            return_locations: Whether to return places, too. Then hits of one ray whose places `trimesh` takes for
                equal are given once, as at an edge that two faces share.
            face_ids: Shape (n,): the faces that the origins lie on.

        Returns:
            index_tri: Shape (m,): numbers of faces.
            index_ray: Shape (m,): numbers of rays.
            locations: Shape (m, 3), only if `return_locations`.
        """
        origins, directions, ids = self._rays(ray_origins, ray_directions, face_ids)
        if multiple_hits:
            index_ray, index_tri, _, locations = _antumbra.all_hits(
                self._index, origins, directions, ids, self._threads
            )
            if return_locations and len(index_tri):
                unique = np.sort(grouping.unique_rows(np.column_stack((locations, index_ray)))[0])
                index_ray, index_tri, locations = index_ray[unique], index_tri[unique], locations[unique]
            if max_hits is not None:
                # The place of each hit among those of its ray.
                firsts = np.searchsorted(index_ray, index_ray)
                kept = np.arange(len(index_ray)) - firsts < max_hits
                index_ray, index_tri, locations = index_ray[kept], index_tri[kept], locations[kept]
        else:
            found, _, places = _antumbra.nearest_hits(self._index, origins, directions, ids, self._threads)
            index_ray = np.flatnonzero(found >= 0).astype(np.int64)
            index_tri, locations = found[index_ray], places[index_ray]
        if return_locations:
            return index_tri, index_ray, locations
        return index_tri, index_ray

    def intersects_first(
        self, ray_origins: Any, ray_directions: Any, *, face_ids: Any = None
    ) -> npt.NDArray[np.int64]:
        """Returns the first face of each ray, shape (n,), -1 where there is none."""
        origins, directions, ids = self._rays(ray_origins, ray_directions, face_ids)
        return _antumbra.nearest_hits(self._index, origins, directions, ids, self._threads)[0]

    def intersects_any(
        self, ray_origins: Any, ray_directions: Any, *, face_ids: Any = None
    ) -> npt.NDArray[np.bool_]:
        """Returns whether each ray meets the mesh, shape (n,)."""
        origins, directions, ids = self._rays(ray_origins, ray_directions, face_ids)
        return self._index.occluded_rays(origins, directions, ids, math.inf, self._threads, None).view(np.bool_)

    def contains_points(self, points: Any) -> npt.NDArray[np.bool_]:
        """Returns whether the mesh contains points, shape (n, 3), by rays, as `trimesh` does it."""
        inside: npt.NDArray[np.bool_] = contains_points(self, np.asarray(points, dtype=np.float64))
        return inside

    def __getstate__(self) -> dict[str, Any]:
        state = self.__dict__.copy()
        state.pop("_cache", None)
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._cache = caching.Cache(id_function=self.mesh.__hash__)

    def __copy__(self) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, self._scale_to_box, threads=self._threads)

    def __deepcopy__(self, memo: Any) -> RayMeshIntersector:
        return self.__copy__()


_replaced: dict[Any, Any] = {}
"""Modules of trimesh, and the intersectors that they had before `install`."""


def install() -> None:
    """Makes this intersector that of every `trimesh.Trimesh` that is made from now on, in the whole process.

    Methods of trimesh that trace rays use it then: `contains`, thickness, sampling by visibility. Meshes that are there
    already keep theirs, and `uninstall` takes it back. Calling it again does nothing.
    """
    from trimesh.ray import has_embree, ray_pyembree, ray_triangle

    modules: list[Any] = [ray_triangle, ray_pyembree] if has_embree else [ray_triangle]
    for module in modules:
        _replaced.setdefault(module, module.RayMeshIntersector)
        module.RayMeshIntersector = RayMeshIntersector


def uninstall() -> None:
    """Gives trimesh its own intersectors back, for meshes that are made from now on."""
    for module, its_own in _replaced.items():
        module.RayMeshIntersector = its_own
    _replaced.clear()
