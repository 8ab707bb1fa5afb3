"""Embree's answers against ours: every difference is judged by the exact rule."""

from __future__ import annotations

from typing import Any

import antumbra
import numpy as np
import pytest
from conftest import points_on

# Points of surfaces are asked as points of space, too: answers are compared, whatever was meant.
pytestmark = pytest.mark.filterwarnings("ignore::antumbra.AntumbraWarning")

pytest.importorskip("embreex", reason="embreex is not installed: answers are not compared with Embree's")


def test_where_embree_differs_it_is_wrong(
    index: antumbra.ShadowIndex, reference: antumbra.ShadowIndex, bumps: Any
) -> None:
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    vertices, faces = bumps
    # Points off the surface, in the float32 that Embree takes.
    points, _, normals = points_on(vertices, faces, 20_000, seed=10)
    points = (points + 0.01 * normals / np.linalg.norm(normals, axis=1, keepdims=True)).astype(np.float32)
    position = np.float32([2.0, -3.0, 4.0])
    scene = rtcore_scene.EmbreeScene()
    TriangleMesh(scene=scene, vertices=vertices.astype(np.float32), indices=faces.astype(np.int32))
    # A light that is outside of everything: what is beyond it does not matter.
    hit = scene.run(points, position - points, query="OCCLUDED")
    theirs = hit == 0 if set(np.unique(hit)) <= {-1, 0} else hit.astype(bool)

    rounded = antumbra.Scene.from_arrays(vertices.astype(np.float32), faces)
    lights = [antumbra.PointLight(position)]
    ours = antumbra.ShadowIndex(rounded, lights).occluded(points)
    differing = np.flatnonzero(ours != theirs)
    assert len(differing) < 200, "the two do not answer the same question"
    asked = np.union1d(differing, np.arange(0, len(points), 50))
    expected = antumbra.ShadowIndex(rounded, lights, method="naive").occluded(points[asked])
    assert np.array_equal(ours[asked], expected)
