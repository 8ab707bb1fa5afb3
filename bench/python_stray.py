"""Measures what one stray triangle far from a mesh costs: the same queries with it and without.

    pip install .
    python bench/python_stray.py --json out.json

The mesh is a ball of 5120 triangles, made here; the light is a point outside of it. The stray triangle stands 1e4, 1e6
or 1e8 radii behind the ball, so it changes no answer, and that is checked. Points lie on random faces of the ball, in
random order.

Each method asks all scenes in turn, round after round, on one thread; two rounds before are not timed, so that what is
computed while queries are answered is there. The figure is the median time with the stray triangle over the median
time of the ball alone, of the process's CPU. *Cold* is the same for the first call with all that comes before it:
taking the mesh and building the index.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import time
from typing import Any, Callable

import numpy as np

import antumbra

LIGHT = (2.0, -3.0, 4.0)

# All that answer by something else than a test of every surface.
METHODS = ["auto", "voxel", "bvh", "voxel-1990", "grid"]


def ball(divisions: int) -> tuple[Any, Any]:
    """Returns vertices and faces of a unit ball: 20 * 4^divisions faces."""
    golden = (1.0 + 5.0**0.5) / 2.0
    corners = [[0.0, y, z] for y in (-1.0, 1.0) for z in (-golden, golden)]
    vertices = np.array([np.roll(corner, turn) for corner in corners for turn in range(3)])
    # Edges of the icosahedron have length 2; three corners that are that far apart are a face.
    near = np.isclose(np.linalg.norm(vertices[:, None] - vertices[None], axis=-1), 2.0)
    found = [
        [a, b, c]
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[c, a]
    ]
    triangles = vertices[np.array(found)]
    for _ in range(divisions):
        a, b, c = np.moveaxis(triangles, 1, 0)
        ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
        parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        triangles = np.concatenate([np.stack(part, 1) for part in parts])
    triangles = triangles / np.linalg.norm(triangles, axis=-1, keepdims=True)
    # Rounded before they are compared, so that neighbours share their vertices.
    merged, numbers = np.unique(triangles.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    faces = numbers.reshape(-1, 3)
    normals = np.cross(merged[faces[:, 1]] - merged[faces[:, 0]], merged[faces[:, 2]] - merged[faces[:, 0]])
    is_inward = np.sum(normals * merged[faces[:, 0]], axis=1) < 0.0
    faces[is_inward] = faces[is_inward][:, ::-1]
    return merged, faces.astype(np.int32)


def with_stray(vertices: Any, faces: Any, distance: float) -> tuple[Any, Any]:
    """Returns the mesh and a triangle of edge 1 so far from it, on the side away from the light."""
    away = -np.asarray(LIGHT) / np.linalg.norm(LIGHT)
    stray = distance * away + np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    count = len(vertices)
    return np.concatenate([vertices, stray]), np.concatenate([faces, [[count, count + 1, count + 2]]]).astype(np.int32)


def points_on(vertices: Any, faces: Any, count: int) -> tuple[Any, Any]:
    """Returns random points on faces, and the faces' numbers."""
    random = np.random.default_rng(1)
    ids = random.integers(len(faces), size=count, dtype=np.uint32)
    u, v = random.random((2, count, 1))
    flip = u + v > 1.0
    u, v = np.where(flip, 1.0 - u, u), np.where(flip, 1.0 - v, v)
    a, b, c = np.moveaxis(vertices[faces[ids]], 1, 0)
    return a + u * (b - a) + v * (c - a), ids


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--divisions", type=int, default=4, help="20 * 4^divisions faces")
    parser.add_argument("--points", type=int, default=200_000)
    parser.add_argument("--distances", type=float, nargs="+", default=[1e4, 1e6, 1e8])
    parser.add_argument("--methods", nargs="+", default=METHODS, metavar="METHOD")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--json", help="where to write the figures")
    typed = parser.parse_args()

    vertices, faces = ball(typed.divisions)
    points, ids = points_on(vertices, faces, typed.points)
    meshes = {"alone": (vertices, faces)}
    meshes |= {f"{distance:g}": with_stray(vertices, faces, distance) for distance in typed.distances}
    light = antumbra.PointLight(LIGHT)

    def asking(index: antumbra.ShadowIndex) -> Callable[[], Any]:
        return lambda: index.occluded_on_faces(points, ids, threads=1)

    found: dict[str, Any] = {}
    for method in typed.methods:
        asks: dict[str, Callable[[], Any]] = {}
        cold: dict[str, float] = {}
        for name, mesh in meshes.items():
            begin = time.process_time()
            how: Any = {"method": method}
            asks[name] = asking(antumbra.ShadowIndex(mesh, light, threads=1, **how))
            asks[name]()
            cold[name] = time.process_time() - begin
        expected = asks["alone"]()
        times: dict[str, list[float]] = {name: [] for name in meshes}
        for round_number in range(2 + typed.rounds):
            for name, ask in asks.items():
                begin = time.process_time()
                answers = ask()
                took = time.process_time() - begin
                assert np.array_equal(answers, expected), f"{method}, {name}: a triangle far off changed answers"
                if round_number >= 2:
                    times[name].append(took)
        warm = {name: float(np.median(taken)) for name, taken in times.items()}
        ratios = {name: warm[name] / warm["alone"] for name in meshes if name != "alone"}
        cold_ratios = {name: cold[name] / cold["alone"] for name in ratios}
        found[method] = {
            "alone_ns_a_point": 1e9 * warm["alone"] / typed.points,
            "ratios": ratios,
            "cold_ratios": cold_ratios,
        }
        said = ", ".join(f"{name}: {ratio:.2f}" for name, ratio in ratios.items())
        said_cold = ", ".join(f"{name}: {ratio:.2f}" for name, ratio in cold_ratios.items())
        alone = found[method]["alone_ns_a_point"]
        print(f"{method:10} alone {alone:7.1f} ns a point; with a stray triangle, warm {said}; cold {said_cold}", flush=True)

    if typed.json:
        record = {
            "faces": len(faces),
            "points": typed.points,
            "rounds": typed.rounds,
            "machine": platform.processor() or platform.machine(),
            "cpus": os.cpu_count(),
            "antumbra": antumbra.__version__,
            "methods": found,
        }
        with open(typed.json, "w", encoding="utf-8") as file:
            json.dump(record, file, indent=2)
            file.write("\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
