"""Exact shadow answers for static scenes, mostly without tracing a ray.

```python
import antumbra
import numpy as np

vertices = np.array([[-1, -1, 1], [1, -1, 1], [0, 1, 1]], dtype=np.float32)
scene = antumbra.Scene.from_arrays(vertices, [[0, 1, 2]])
index = antumbra.ShadowIndex(scene, [antumbra.PointLight((0, 0, 3))])
assert index.occluded([[0, 0, 0], [9, 0, 0]]).tolist() == [True, False]
```

Answers are exact: `EXACTNESS.md` in the repository defines each of them for the given numbers, taken as real
numbers. They depend neither on the method nor on the number of threads.
"""

from ._antumbra import version as _version
from ._warnings import AntumbraWarning
from .index import ShadowIndex, Volume
from .lights import DirectionalLight, Light, PointLight, SpotLight
from .picture import Camera, Picture, render
from .scene import Scene

__version__: str = _version()

__all__ = [
    "AntumbraWarning",
    "Camera",
    "DirectionalLight",
    "Light",
    "Picture",
    "PointLight",
    "Scene",
    "ShadowIndex",
    "SpotLight",
    "Volume",
    "__version__",
    "render",
]
