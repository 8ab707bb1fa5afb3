"""Studies of the sun: which suns sensors see, for how many hours, and how much energy that is.

```python
import antumbra
import antumbra.sun
import numpy as np

# A wall to the south, and a sensor of the ground behind it.
wall = np.array([[-9, 0, 0], [9, 0, 0], [9, 0, 3], [-9, 0, 3]], dtype=float)
scene = antumbra.Scene.from_arrays(wall, [[0, 1, 2], [0, 2, 3]])
suns = antumbra.sun.Suns.of((np.full(3, 180.0), np.array([20.0, 40.0, 60.0])))
seen = antumbra.sun.sun_visibility(scene, [[0, 3, 0]], normals=[[0, 0, 1]], suns=suns)
assert seen.tolist() == [[False, False, True]]
```

| question | call |
|---|---|
| which suns does a sensor see | `sun_visibility` |
| for how many hours, and when | `sun_hours` |
| which share of the sky's light does it get | `sky_view_factor` |
| how much energy is that | `radiation` |
| what does it look like | `plot_hours`, `plot_day`, `plot_mesh` |

Positions of the sun come from a table of `pvlib`, as angles or as directions; `Suns.of` says how. Plots need
`pip install "antumbra[plot]"`. Past one machine see `antumbra.distributed`.
"""

from ._charts import plot_day, plot_hours
from ._hours import SunHours, sun_hours
from ._plotter import plot_mesh
from ._radiation import Radiation, radiation
from ._sensors import face_normals
from ._sky import SkyPatches, sky_patches, sky_view_factor
from ._suns import Suns
from ._visibility import sun_visibility

__all__ = [
    "Radiation",
    "SkyPatches",
    "SunHours",
    "Suns",
    "face_normals",
    "plot_day",
    "plot_hours",
    "plot_mesh",
    "radiation",
    "sky_patches",
    "sky_view_factor",
    "sun_hours",
    "sun_visibility",
]
