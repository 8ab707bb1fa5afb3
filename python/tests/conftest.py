"""Scenes that several tests ask about."""

from __future__ import annotations

import importlib.util
import os
from collections.abc import Iterator
from typing import Any

import antumbra
import numpy as np
import numpy.typing as npt
import pytest

OPTIONAL = (
    "trimesh", "rtree", "embreex", "mypy", "pandas", "pvlib", "xarray", "distributed", "zarr", "matplotlib", "pyvista", "nbclient",
    "ipykernel",
)


def pytest_report_header() -> list[str]:
    """Says what is compared with, and what is not there to be compared with."""
    missing = [name for name in OPTIONAL if importlib.util.find_spec(name) is None]
    there = [name for name in OPTIONAL if name not in missing]
    lines = [f"antumbra {antumbra.__version__}, compared with: {', '.join(there) or 'nothing'}"]
    required = [name.strip() for name in os.environ.get("ANTUMBRA_REQUIRE", "").split(",")]
    # Embree is named as the tests of Rust name it.
    wanted = [name for name in missing if name in required or name == "embreex" and "embree" in required]
    if wanted:
        pytest.exit(f"not installed, and ANTUMBRA_REQUIRE requires it: {', '.join(wanted)}", returncode=1)
    if missing:
        lines.append(f"NOT INSTALLED, so these comparisons are skipped: {', '.join(missing)}")
    return lines


def skip_for_want_of(name: str, why: str) -> None:
    """Skips a test for want of what is no package, or fails it where `ANTUMBRA_REQUIRE` names that."""
    required = [name.strip() for name in os.environ.get("ANTUMBRA_REQUIRE", "").split(",")]
    if name in required:
        pytest.fail(f"{name} is required by ANTUMBRA_REQUIRE: {why}")
    pytest.skip(f"for want of {name}: {why}")


def bumpy_sphere(rings: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Returns a sphere with bumps that shade each other: 4 * rings^2 faces, open at the poles."""
    sectors = 2 * rings
    polar, around = np.meshgrid(
        np.linspace(0.05, np.pi - 0.05, rings + 1), np.linspace(0.0, 2.0 * np.pi, sectors, endpoint=False), indexing="ij"
    )
    radius = 1.0 + 0.2 * np.sin(9.0 * polar) * np.cos(7.0 * around)
    vertices = np.stack(
        [radius * np.sin(polar) * np.cos(around), radius * np.sin(polar) * np.sin(around), radius * np.cos(polar)], -1
    ).reshape(-1, 3)
    i, j = (index.ravel() for index in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))
    a, b = i * sectors + j, i * sectors + (j + 1) % sectors
    c, d = b + sectors, a + sectors
    faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)])
    return vertices, faces


def points_on(
    vertices: npt.NDArray[np.float64], faces: npt.NDArray[np.int64], count: int, seed: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.uint32], npt.NDArray[np.float64]]:
    """Returns rounded points of faces, the faces, and their normals, which point outwards."""
    random = np.random.default_rng(seed)
    ids = random.integers(len(faces), size=count)
    corners = vertices[faces[ids]]
    weights = random.dirichlet((1.0, 1.0, 1.0), size=count)
    points = np.einsum("nc,ncd->nd", weights, corners)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return points, ids.astype(np.uint32), normals


LIGHTS = [
    antumbra.PointLight((2.0, -3.0, 4.0)),
    antumbra.DirectionalLight((0.3, 0.2, -1.0)),
    antumbra.SpotLight((0.0, 3.0, 0.0), (0.0, -1.0, 0.0), 20.0),
]


@pytest.fixture(scope="session")
def bumps() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """A bumpy sphere of 1600 faces."""
    return bumpy_sphere(20)


@pytest.fixture(scope="session")
def scene(bumps: tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]) -> antumbra.Scene:
    return antumbra.Scene.from_arrays(*bumps)


@pytest.fixture(scope="session")
def index(scene: antumbra.Scene) -> antumbra.ShadowIndex:
    return antumbra.ShadowIndex(scene, LIGHTS)


@pytest.fixture(scope="session")
def reference(scene: antumbra.Scene) -> antumbra.ShadowIndex:
    """Tests every surface: the rule of EXACTNESS.md and nothing else."""
    return antumbra.ShadowIndex(scene, LIGHTS, method="naive")


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    """Two workers of one thread each."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed: its workers are not tested")
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client
