"""Exact shadow answers for static scenes, mostly without tracing a ray.

```python
import antumbra
import numpy as np

vertices = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], dtype=np.float32)
index = antumbra.ShadowIndex((vertices, [[0, 1, 2]]), antumbra.PointLight((0, 0, 3)))
assert index.occluded_at([[0, 0, 0], [9, 0, 0]], 0).tolist() == [True, False]
```

Answers are exact: `EXACTNESS.md` in the repository defines each of them for the given numbers, taken as real
numbers. They depend neither on the method nor on the number of threads.

What may not be what you meant is reported as `AntumbraWarning`. `antumbra.sun` has studies of the sun,
`antumbra.distributed` has them on many machines, and `antumbra.ray` an intersector for `trimesh`. These three are imported
at their first use; the last needs that package.
"""

from types import ModuleType

from ._antumbra import version as _version
from ._warning import AntumbraWarning
from .area import DiskLight, PolygonLight, RectLight, SegmentLight, Sky, SphereLight, SunDisc
from .index import ShadowIndex, Volume
from .lights import DirectionalLight, Light, PointLight, SpotLight, Sun
from .picture import Camera, Picture, render
from .scene import Scene

__version__: str = _version()

__all__ = [
    "AntumbraWarning",
    "Camera",
    "DirectionalLight",
    "DiskLight",
    "Light",
    "Picture",
    "PointLight",
    "PolygonLight",
    "RectLight",
    "Scene",
    "SegmentLight",
    "ShadowIndex",
    "Sky",
    "SphereLight",
    "SpotLight",
    "Sun",
    "SunDisc",
    "Volume",
    "__version__",
    "render",
]


_LATER = ("distributed", "ray", "sun")


def __getattr__(name: str) -> ModuleType:
    """Imports modules that not everybody uses, or has the packages for, at their first use."""
    if name in _LATER:
        import importlib

        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
