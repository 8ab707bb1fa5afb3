"""Scenes from files and from arrays."""

from __future__ import annotations

import os
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _antumbra
from ._arrays import numbers, rows, vector, whole
from ._progress import Progress, reporter
from ._warning import warn
from .lights import Light, light_of


class Scene:
    """A static scene: surfaces with numbers, perhaps lights and a camera.

    Made by `Scene.load`, `Scene.from_arrays` or `Scene.from_trimesh`. A scene never changes, so its copies are the
    scene itself; a pickle holds all of it, exactly.
    """

    _native: _antumbra.Scene

    def __init__(self) -> None:
        raise TypeError("a Scene is made by Scene.load, Scene.from_arrays or Scene.from_trimesh")

    @classmethod
    def _of(cls, native: _antumbra.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        *,
        up: Literal["y", "z"] | None = None,
        memory_limit: int | None = None,
        progress: Progress = None,
    ) -> Scene:
        """Reads a scene file.

        Args:
            path: The file; its ending says the format: `.nff`, `.obj`, `.gltf`, `.glb`, `.ply` or `.stl`.
            up: `"y"` or `"z"`, for cameras, suns and skies that the file does not give; nothing is turned. By default
                as the format has it; OBJ (y), PLY and STL (z) do not say it, and what depends on it then warns.
            memory_limit: The most bytes that files, pictures and the scene may take together while they are
                read. What does not fit is refused before it is taken. By default three quarters of the
                machine's memory.
            progress: `True` for a line on the standard error stream, or a callable that is called with a stage's name,
                its steps that are done and all of them: here before and after the reading.

        What the reader ignores, repairs or guesses is reported as `AntumbraWarning`, and again in `warnings`. Ctrl-C
        ends the reading.

        Raises:
            FileNotFoundError: There is no such file.
            MemoryError: More than `memory_limit` would be needed.
            ValueError: The file cannot be used; the message says where and why.
        """
        limit = None if memory_limit is None else whole("memory_limit", memory_limit, 0, 2**63)
        report = reporter(progress)
        if report is not None:
            report("reading", 0, 1)
        scene = cls._of(_antumbra.Scene.load(os.fsdecode(path), up, limit))
        if report is not None:
            report("reading", 1, 1)
        for message in scene.warnings:
            warn(message)
        return scene

    @classmethod
    def from_arrays(cls, vertices: Any, faces: Any, *, up: Any = (0.0, 0.0, 1.0)) -> Scene:
        """Makes a scene of one triangle mesh, opaque and grey.

        Args:
            vertices: Shape (n, 3), float32 or float64, world space, finite where a face uses them. What is given is
                the exact shape: float32 is not rounded further.
            faces: Shape (m, 3), integers: numbers of vertices. Winding does not matter for shadows. A face
                without area blocks nothing.
            up: Which way is up, for cameras and suns of pictures.

        The faces' numbers are what `face_ids` of `ShadowIndex.occluded` means. The arrays are copied.

        Raises:
            ValueError: A shape does not fit, or a vertex of a face is not finite.
            TypeError: A dtype does not fit.
            IndexError: A face names a vertex that is not there.
        """
        places = rows("vertices", vertices)
        if not len(places) and not np.size(faces):
            faces = np.zeros((0, 3), np.uint32)
        corners = numbers("faces", faces, (-1, 3), len(places), "vertices")
        return cls._of(_antumbra.Scene.from_arrays(places, corners, vector("up", up)))

    @classmethod
    def from_trimesh(cls, mesh: Any) -> Scene:
        """Returns the scene of a `trimesh.Trimesh`, a `trimesh.Scene`, or of anything with `vertices` and `faces`.

        Faces have the mesh's numbers; those of a `trimesh.Scene` are in the order of its `to_mesh()`. The mesh is
        copied: later changes of it are not seen.

        Raises:
            TypeError: There are no vertices and faces.
        """
        if hasattr(mesh, "geometry") and hasattr(mesh, "to_mesh"):
            mesh = mesh.to_mesh()
        if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
            raise TypeError(
                f"mesh: expected vertices and faces, found {type(mesh).__name__}"
            )
        return cls.from_arrays(np.asarray(mesh.vertices), np.asarray(mesh.faces))

    @property
    def surface_count(self) -> int:
        """How many surfaces there are: triangles first, then spheres, walls and caps of cones, and disks."""
        return self._native.surface_count

    @property
    def triangle_count(self) -> int:
        """How many of the surfaces are triangles."""
        return self._native.triangle_count

    @property
    def bounds(self) -> npt.NDArray[np.float64] | None:
        """The box around all surfaces, shape (2, 3), or `None` for an empty scene."""
        bounds = self._native.bounds
        return None if bounds is None else np.array(bounds)

    @property
    def up(self) -> tuple[float, float, float]:
        """Which way is up, for cameras, suns and skies: of the file, or as given, or as is usual for the format."""
        x, y, z = self._native.up
        return x, y, z

    def _up_for(self, what: str) -> tuple[float, float, float]:
        """Returns `up`, and warns where it is a guess that an answer depends on."""
        if self._native.is_up_assumed:
            taken, other = ("z", "y") if self.up == (0.0, 0.0, 1.0) else ("y", "z")
            warn(
                f"the file does not say which way is up: taking +{taken} for {what}; "
                f'Scene.load(path, up="{other}") takes +{other}'
            )
        return self.up

    @property
    def lights(self) -> list[Light]:
        """The lights of the file."""
        return [light_of(parts) for parts in self._native.lights]

    @property
    def warnings(self) -> list[str]:
        """What the reader ignored, repaired or guessed."""
        return self._native.warnings

    def triangles(self) -> npt.NDArray[np.float64]:
        """Returns the corners of all triangles, shape (triangles, 3, 3), in the order of their numbers."""
        return self._native.triangles().reshape(-1, 3, 3)

    def __copy__(self) -> Scene:
        return self

    def __deepcopy__(self, memo: Any) -> Scene:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _scene_of_bytes, (self._native.to_bytes(),)

    def __repr__(self) -> str:
        return f"<antumbra.Scene: {self.surface_count} surfaces, {len(self._native.lights)} lights>"


def _scene_of_bytes(data: bytes) -> Scene:
    """Makes a scene from what its pickle holds."""
    return Scene._of(_antumbra.Scene.of_bytes(data))


SceneLike: TypeAlias = Scene | tuple[Any, Any] | Any
"""What has surfaces: a `Scene`, a pair of vertices and faces, a `trimesh.Trimesh` or a `trimesh.Scene`."""


def scene_of(value: SceneLike) -> Scene:
    """Returns the scene that a caller means."""
    if isinstance(value, Scene):
        return value
    if isinstance(value, (tuple, list)):
        if len(value) != 2:
            raise ValueError(f"scene: expected a pair of vertices and faces, found {len(value)} items")
        return Scene.from_arrays(*value)
    if hasattr(value, "to_mesh") or (hasattr(value, "vertices") and hasattr(value, "faces")):
        return Scene.from_trimesh(value)
    advice = "; antumbra.Scene.load reads files" if isinstance(value, (str, os.PathLike)) else ""
    raise TypeError(
        "scene: expected antumbra.Scene, a pair of vertices and faces, a trimesh.Trimesh or a trimesh.Scene, found "
        f"{type(value).__name__}{advice}"
    )
