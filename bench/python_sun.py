"""Measures `antumbra.sun` and `antumbra.distributed`: sensors of a town of boxes and the suns of a year.

    pip install ".[dask]"
    python bench/python_sun.py --sensors 200000 --json out.json

Suns are those of a year at latitude 48 by a formula, hour by hour, those above the horizon. Sensors lie on the boxes' tops and
sides, face after face. What is measured, in the wall's time:

* `rate`: pairs of sensor and sun a second, one process of `--threads` threads, packed bits, the index made before;
* `rerun`: energy with other weather from those bits, as a share of answering them;
* `wall_ratio`: `LocalCluster` of `--threads` workers of one thread each, over one process of as many threads, the same work
  from chunks to the answers in memory; interleaved, medians of `--repeats`. The cluster is started before, as it is once a
  session; each call makes its indices anew on both sides;
* `bytes_per_sensor`: bytes of a sensor that go over the network, to a worker and back.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from typing import Any

import antumbra
import antumbra.distributed
import antumbra.sun
import numpy as np


def town(side: int) -> tuple[Any, Any]:
    """Returns side^2 boxes in streets, five faces of two triangles each."""
    random = np.random.default_rng(1)
    vertices, faces = [], []
    quads = np.array([(0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6)])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    for number in range(side * side):
        x, y = 14.0 * (number % side), 14.0 * (number // side)
        width, depth, height = random.uniform((6, 6, 4), (11, 11, 20))
        corners = [[x + width * i, y + depth * j, height * k] for k in (0, 1) for j in (0, 1) for i in (0, 1)]
        faces.append(triangles + 8 * number)
        vertices.append(corners)
    return np.concatenate(vertices), np.concatenate(faces)


def year(latitude: float) -> Any:
    """Returns directions of 8760 hours, night included."""
    hours = np.arange(8760) + 0.5
    declination = -np.radians(23.44) * np.cos(2 * np.pi * (hours / 24 + 10) / 365)
    angle, phi = (hours % 24 - 12) * np.pi / 12, np.radians(latitude)
    return np.stack(
        [
            -np.cos(declination) * np.sin(angle),
            np.sin(declination) * np.cos(phi) - np.cos(declination) * np.cos(angle) * np.sin(phi),
            np.cos(declination) * np.cos(angle) * np.cos(phi) + np.sin(declination) * np.sin(phi),
        ],
        axis=-1,
    )


def sample(vertices: Any, faces: Any, count: int) -> tuple[Any, Any]:
    """Returns points of faces, by area, face after face."""
    random = np.random.default_rng(2)
    corners = vertices[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    ids = np.sort(random.choice(len(faces), size=count, p=areas / areas.sum())).astype(np.uint32)
    weights = random.dirichlet((1, 1, 1), size=count)
    return np.einsum("nc,ncd->nd", weights, corners[ids]).astype(np.float32), ids


def seconds(work: Any) -> tuple[float, Any]:
    begin = time.perf_counter()
    found = work()
    return time.perf_counter() - begin, found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensors", type=int, default=100_000)
    parser.add_argument("--houses", type=int, default=40, help="along a side")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--chunk", type=int, default=8192)
    parser.add_argument("--json")
    arguments = parser.parse_args()
    from distributed import Client, LocalCluster

    vertices, faces = town(arguments.houses)
    points, ids = sample(vertices, faces, arguments.sensors)
    scene = antumbra.Scene.from_arrays(vertices, faces)
    suns = antumbra.sun.Suns.of(year(48.0))
    index = antumbra.ShadowIndex(scene, [])
    threads = arguments.threads
    answering, bits = seconds(
        lambda: antumbra.sun.sun_visibility(index, points, ids, suns=suns, packed=True, threads=threads)
    )
    normals = antumbra.sun.face_normals(scene, ids)
    weather = np.random.default_rng(3).random(suns.count) * 900
    summing, _ = seconds(
        lambda: antumbra.sun.radiation(bits, suns, weather, normals=normals, step_hours=1.0, threads=threads)
    )
    how: dict[str, Any] = {"suns": suns, "chunk": arguments.chunk}
    here, there = [], []
    with LocalCluster(n_workers=threads, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        for _ in range(arguments.repeats):
            wall, found = seconds(lambda: antumbra.distributed.sun_visibility(scene, points, ids, threads=threads, **how))
            assert np.array_equal(found, bits)
            here.append(wall)
            wall, found = seconds(lambda: antumbra.distributed.sun_visibility(scene, points, ids, client=client, **how))
            assert np.array_equal(found, bits)
            there.append(wall)
    figures = {
        "machine": platform.processor() or platform.machine(),
        "processors": os.cpu_count(),
        "triangles": len(faces),
        "sensors": len(points),
        "suns": len(suns),
        "threads": threads,
        "pairs_per_second": len(points) * len(suns) / answering,
        "lit_share": float(np.unpackbits(bits[::97], axis=1, count=len(suns), bitorder="little").mean()),
        "rerun": summing / answering,
        "one_process_seconds": here,
        "workers_seconds": there,
        "wall_ratio": statistics.median(there) / statistics.median(here),
        "bytes_per_sensor": bits.shape[1] + points.itemsize * 3 + ids.itemsize,
        "scene_bytes": len(scene._native.to_bytes()),
    }
    text = json.dumps(figures, indent=2)
    print(text)
    if arguments.json:
        with open(arguments.json, "w", encoding="utf-8") as file:
            file.write(text + "\n")


if __name__ == "__main__":
    main()
