"""The intersector against those of trimesh; every difference is judged in rational numbers."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from conftest import bumpy_sphere
from exact import distance

trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: its intersectors are not compared with")
from antumbra.ray import RayMeshIntersector  # noqa: E402
from trimesh.ray import ray_triangle  # noqa: E402

pytest.importorskip("rtree", reason="rtree is not installed: trimesh's own intersector does not work")


def rays_of(kind: str, mesh: Any, count: int) -> tuple[Any, Any]:
    """Returns rays at a mesh around the origin: random ones, or aimed at what is delicate."""
    random = np.random.default_rng(len(kind))
    origins = random.normal(size=(count, 3))
    origins *= 3.0 / np.linalg.norm(origins, axis=1, keepdims=True)
    if kind == "random":
        return origins, random.normal(size=(count, 3)) * 0.3 - origins / 3.0
    if kind == "vertices":
        targets = mesh.vertices[random.integers(len(mesh.vertices), size=count)]
    elif kind == "edges":
        targets = mesh.vertices[mesh.edges_unique[random.integers(len(mesh.edges_unique), size=count)]].mean(axis=1)
    else:
        # Along an axis through vertices, from inside, so that many signs are zero.
        targets = mesh.vertices[random.integers(len(mesh.vertices), size=count)]
        origins = targets * np.array([1.0, 1.0, 0.0])
    return origins, targets - origins


MESHES = {
    "ico": lambda: trimesh.creation.icosphere(subdivisions=2),
    "box": lambda: trimesh.creation.box(),
    "bumps": lambda: trimesh.Trimesh(*bumpy_sphere(10), process=False),
}


@pytest.mark.parametrize("kind", ["random", "vertices", "edges", "axis"])
@pytest.mark.parametrize("name", MESHES)
def test_hits_are_exact_and_differ_from_trimesh_only_where_it_errs(name: str, kind: str) -> None:
    mesh = MESHES[name]()
    ours, theirs = RayMeshIntersector(mesh), ray_triangle.RayMeshIntersector(mesh)
    origins, directions = rays_of(kind, mesh, 300)
    pairs = []
    for engine in (ours, theirs):
        index_tri, index_ray = engine.intersects_id(origins, directions, multiple_hits=True)
        pairs.append(set(zip(index_ray.tolist(), index_tri.tolist())))

    def truly(ray: int, face: int) -> Any:
        return distance(origins[ray], directions[ray], mesh.triangles[face])

    # All that either says, and for some rays every face of the mesh.
    candidates = pairs[0] | pairs[1] | {(ray, face) for ray in range(5) for face in range(len(mesh.faces))}
    exactly = {pair for pair in candidates if truly(*pair) is not None}
    assert pairs[0] == exactly
    assert exactly
    if kind == "random":
        # Nothing is delicate: then there is nothing to differ about.
        assert pairs[1] == exactly

    hit = np.zeros(len(origins), bool)
    hit[[ray for ray, _ in exactly]] = True
    assert np.array_equal(ours.intersects_any(origins, directions), hit)
    first = ours.intersects_first(origins, directions)
    assert first.dtype == np.int64 and np.array_equal(first >= 0, hit)
    for ray in np.flatnonzero(hit)[:100]:
        distances = {face: truly(ray, face) for at, face in exactly if at == ray}
        # Distances are rounded: what is as near as rounding may be the first.
        assert distances[first[ray]] <= min(distances.values()) * (1 + 2.0**-40)


@pytest.mark.parametrize("name", MESHES)
def test_locations_are_those_of_trimesh(name: str) -> None:
    mesh = MESHES[name]()
    ours, theirs = RayMeshIntersector(mesh), ray_triangle.RayMeshIntersector(mesh)
    origins, directions = rays_of("random", mesh, 300)
    for multiple_hits in (True, False):
        found = ours.intersects_location(origins, directions, multiple_hits=multiple_hits)
        expected = theirs.intersects_location(origins, directions, multiple_hits=multiple_hits)
        orders = [np.lexsort((parts[2], parts[1])) for parts in (found, expected)]
        for ours_part, theirs_part in zip(found[1:], expected[1:]):
            assert np.array_equal(ours_part[orders[0]], theirs_part[orders[1]])
        assert np.allclose(found[0][orders[0]], expected[0][orders[1]], rtol=0, atol=1e-9)
    assert np.array_equal(ours.intersects_first(origins, directions), theirs.intersects_first(origins, directions))


def test_hits_of_a_ray_come_in_order_and_at_an_edge_once() -> None:
    box = trimesh.creation.box()
    # Through the diagonals of two faces, which two triangles share each.
    origins, directions = np.array([[0.25, 0.25, 5.0]]), np.array([[0.0, 0.0, -2.0]])
    ray = RayMeshIntersector(box)
    index_tri, index_ray = ray.intersects_id(origins, directions)
    locations, rays_of_locations, faces_of_locations = ray.intersects_location(origins, directions)
    assert len(set(index_tri)) == len(index_tri) and set(index_ray) == {0}
    assert np.allclose(locations, [[0.25, 0.25, 0.5], [0.25, 0.25, -0.5]])
    assert rays_of_locations.tolist() == [0, 0] and len(faces_of_locations) == 2
    first_only = ray.intersects_id(origins, directions, max_hits=1, return_locations=True)
    assert first_only[1].tolist() == [0] and np.allclose(first_only[2], [[0.25, 0.25, 0.5]])


def test_faces_that_rays_leave_are_not_met_again() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=3)
    ray = RayMeshIntersector(mesh)
    ids = np.arange(len(mesh.faces))
    origins, directions = mesh.triangles_center, mesh.face_normals
    # Outwards from a convex mesh: nothing is met, whatever the rounding of the origins.
    assert not ray.intersects_any(origins, directions, face_ids=ids).any()
    assert (ray.intersects_first(origins, directions, face_ids=ids) == -1).all()
    inwards = ray.intersects_first(origins, -directions, face_ids=ids)
    assert (inwards >= 0).all() and (inwards != ids).all()


def test_odd_rays() -> None:
    ray = RayMeshIntersector(trimesh.creation.box())
    none = np.empty((0, 3))
    assert ray.intersects_any(none, none).shape == (0,)
    assert ray.intersects_first(none, none).shape == (0,)
    assert [part.shape for part in ray.intersects_location(none, none)] == [(0, 3), (0,), (0,)]
    assert ray.intersects_any([[0, 0, 0]], [[0, 0, 0]]).tolist() == [False]
    assert ray.intersects_any([[0, 0, 0]], [[0, 0, 1e-300]]).tolist() == [True]
    with pytest.raises(ValueError, match=r"directions\[1\] is \(0, NaN, 0\)"):
        ray.intersects_id([[0, 0, 0]] * 2, [[0, 0, 1], [0, np.nan, 0]])
    with pytest.raises(ValueError, match=r"ray_directions: expected shape \(2, 3\)"):
        ray.intersects_any([[0, 0, 0]] * 2, [[0, 0, 1]])


def test_it_takes_the_place_of_the_mesh_s_own() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=2)
    points = np.random.default_rng(1).uniform(-1.5, 1.5, size=(200, 3))
    expected = mesh.contains(points)
    mesh.ray = RayMeshIntersector(mesh)
    assert np.array_equal(mesh.contains(points), expected)
    assert np.array_equal(mesh.ray.contains_points(points), expected)


def test_a_changed_mesh_is_seen() -> None:
    mesh = trimesh.creation.box()
    ray = RayMeshIntersector(mesh)
    origins, directions = [[0.0, 0.0, 5.0]], [[0.0, 0.1, -1.0]]
    assert ray.intersects_any(origins, directions).tolist() == [True]
    index = ray._index
    assert ray._index is index
    mesh.apply_translation([5.0, 0.0, 0.0])
    assert ray.intersects_any(origins, directions).tolist() == [False]


def test_it_is_copied_and_pickled() -> None:
    ray = RayMeshIntersector(trimesh.creation.box())
    for other in (copy.copy(ray), copy.deepcopy(ray), pickle.loads(pickle.dumps(ray))):
        assert other.intersects_any([[0, 0, 5]], [[0, 0, -1]]).tolist() == [True]
