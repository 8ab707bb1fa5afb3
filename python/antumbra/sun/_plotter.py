"""Sensors on their scene, in the colors of their values, drawn by PyVista.

In: a scene, sensors, a number for each. Out: a `pyvista.Plotter`; the package is imported at the first call. Invariant: no
value is changed, and none is spread to faces without sensors.
"""

from __future__ import annotations

import importlib
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from .._warning import warn
from ..index import ShadowIndex
from ..scene import Scene, SceneLike, scene_of
from ._sensors import Sensors, checked_sensors

NO_SENSORS = "#b8b8b8"
"""Color of faces without sensors."""


def plot_mesh(
    scene_or_index: SceneLike | ShadowIndex,
    points: Any,
    face_ids: Any = None,
    *,
    values: Any,
    label: str = "hours of sun",
    on: Literal["points", "faces"] = "points",
    limits: tuple[float, float] | None = None,
    color_map: str = "inferno",
    point_size: float = 8.0,
    size: tuple[int, int] = (960, 720),
    off_screen: bool = True,
) -> Any:
    """Draws a scene in grey and its sensors in the colors of their values.

    ```python
    plotter = antumbra.sun.plot_mesh(scene, points, face_ids, values=hours.hours)
    plotter.screenshot("hours.png")
    ```

    The camera looks from the south-south-east and above; `plotter.camera_position` moves it. The scene is lit, colors of values
    are not. Curved surfaces are not drawn, which an `AntumbraWarning` says.

    Args:
        scene_or_index: As of `sun_visibility`.
        points: Sensors, shape (n, 3), at least one.
        face_ids: Surfaces that they lie on, shape (n,); needed for `on="faces"`.
        values: A finite number for each sensor, shape (n,).
        label: Title of the color bar, and name of the values in PyVista's data.
        on: `"points"` draws each sensor; `"faces"` draws each triangle in the color of the mean of its sensors, and leaves
            those without grey.
        limits: Values at the ends of the color map; by default the least and the greatest that are drawn.
        color_map: Name of a color map of matplotlib.
        point_size: Diameter of a sensor in pixels.
        size: Width and height of the picture in pixels.
        off_screen: Whether there is no window, only `screenshot`.

    Returns:
        The `pyvista.Plotter`, with the meshes `scene` and `sensors` in `plotter.actors`, not rendered yet.

    Raises:
        ValueError: A shape does not fit, a value is not finite, or `on` is none of both.
        IndexError: A face does not exist.
        ImportError: PyVista is not installed.
    """
    scene = scene_or_index.scene if isinstance(scene_or_index, ShadowIndex) else scene_of(scene_or_index)
    sensors = checked_sensors(scene, points, face_ids, None, "front", None)
    amounts = _values(values, len(sensors))
    if on not in ("points", "faces"):
        raise ValueError(f'on is {on!r}: expected "points" or "faces"')
    means = _means(scene, sensors, amounts) if on == "faces" else None
    pyvista = _pyvista()
    curved = scene.surface_count - scene.triangle_count
    if curved:
        warn(f"plot_mesh draws triangles alone: {curved} curved surfaces are left out")
    plotter = pyvista.Plotter(off_screen=off_screen, window_size=list(size))
    colors: dict[str, Any] = {
        "scalars": label,
        "cmap": color_map,
        "clim": None if limits is None else [float(limits[0]), float(limits[1])],
        "nan_color": NO_SENSORS,
        # Colors mean numbers: nothing shades them.
        "lighting": False,
        "scalar_bar_args": {"title": label, "vertical": True, "fmt": "%.4g"},
    }
    if scene.triangle_count:
        corners = scene.triangles().reshape(-1, 3)
        mesh = pyvista.PolyData.from_regular_faces(corners, np.arange(len(corners)).reshape(-1, 3))
        if means is None:
            plotter.add_mesh(mesh, color=NO_SENSORS, name="scene", render=False)
        else:
            mesh.cell_data[label] = means
            plotter.add_mesh(mesh, name="scene", render=False, **colors)
    if means is None:
        cloud = pyvista.PolyData(sensors.points.astype(np.float64))
        cloud.point_data[label] = amounts
        plotter.add_mesh(
            cloud, name="sensors", render=False, render_points_as_spheres=True, point_size=point_size, **colors
        )
    # North is +y with z up, and -z with y up.
    x, y, z = scene.up
    is_y_up = abs(y) > abs(z)
    towards = np.array([0.45, 1.0, 1.0] if is_y_up else [0.45, -1.0, 1.0])
    plotter.camera_position = [towards.tolist(), [0.0, 0.0, 0.0], [x, y, z]]
    plotter.reset_camera(render=False)
    return plotter


def _values(values: Any, count: int) -> npt.NDArray[np.float64]:
    found = np.asarray(values)
    if found.shape != (count,) or found.dtype.kind not in "iufb":
        raise ValueError(
            f"values: expected numbers, shape ({count},), one for each sensor, found shape {found.shape} and dtype {found.dtype}"
        )
    if not count:
        raise ValueError("points: expected sensors, found none")
    amounts = found.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(amounts))
    if len(bad):
        raise ValueError(f"values[{bad[0]}] is {amounts[bad[0]]}: expected a finite number")
    return amounts


def _means(scene: Scene, sensors: Sensors, values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Returns the mean of each triangle's sensors, NaN where there is none."""
    if sensors.face_ids is None:
        raise ValueError('face_ids: expected them with on="faces"')
    # Curved surfaces have the numbers behind.
    count = scene.surface_count
    sums = np.bincount(sensors.face_ids, weights=values, minlength=count)[: scene.triangle_count]
    counts = np.bincount(sensors.face_ids, minlength=count)[: scene.triangle_count]
    means = np.full(scene.triangle_count, np.nan)
    np.divide(sums, counts, out=means, where=counts > 0)
    return means


def _pyvista() -> Any:
    try:
        return importlib.import_module("pyvista")
    except ImportError as error:
        raise ImportError('plot_mesh needs the package pyvista: pip install "antumbra[plot]"') from error
