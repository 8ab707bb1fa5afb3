"""Measures `ShadowIndex.occluded` beside embreex and trimesh: one thread, NumPy arrays on all sides.

    pip install . embreex trimesh
    python bench/python_occluded.py --occlusion bumps.antumbra --json out.json

The mesh is a sphere with bumps that shade each other, made here; the light is a point outside of it, with nothing
beyond. Points lie on random faces, in random order or, with --sorted, face after face. What is asked:

* on faces: ours gets the points in float32 and the numbers of their faces. Embree gets origins that were moved
  off the faces and directions, both in float32 and made before the clock starts, and its answers are those of
  rtcOccluded1 (query="OCCLUDED"), its fastest path in embreex;
* free: both get the moved origins, so the question is the same.

Every difference from Embree among a million points is judged by the exact rule (method="naive"), for the question that
ours was asked; on faces that is another one than Embree's.

*Kept* is with all values (refine="eager"), which are made before and kept in a file: it is what a process gets that
does so once. The time to make the file is reported apart. The others are lazy: values are made while queries are answered.

Times are of the process's CPU, which a loaded machine changes less than the wall's; both are reported. Cold is the first
call and all that comes before it: taking the mesh, building, and what is built while queries are
answered. Warm is the median of later calls. trimesh's intersects_any (with embreex behind it) converts to float64,
scales and unitizes; that is its time, and it is asked fewer points.
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


def bumpy_sphere(rings: int) -> tuple[Any, Any]:
    """Returns float32 vertices and int32 faces: 4 * rings^2 faces."""
    sectors = 2 * rings
    polar, around = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, rings + 1), np.linspace(0.0, 2.0 * np.pi, sectors, endpoint=False), indexing="ij"
    )
    radius = 1.0 + 0.15 * np.sin(17.0 * polar) * np.cos(13.0 * around)
    vertices = np.stack(
        [radius * np.sin(polar) * np.cos(around), radius * np.sin(polar) * np.sin(around), radius * np.cos(polar)], -1
    )
    i, j = (index.ravel() for index in np.meshgrid(np.arange(rings), np.arange(sectors), indexing="ij"))
    a, b = i * sectors + j, i * sectors + (j + 1) % sectors
    c, d = b + sectors, a + sectors
    faces = np.concatenate([np.stack([a, d, c], -1), np.stack([a, c, b], -1)])
    return vertices.reshape(-1, 3).astype(np.float32), faces.astype(np.int32)


def sample(vertices: Any, faces: Any, count: int, is_sorted: bool) -> tuple[Any, Any, Any]:
    """Returns points on faces, the faces' numbers, and points moved off them by 1e-4, in float32."""
    random = np.random.default_rng(1)
    corners = vertices.astype(np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    unit = normals / areas[:, None]
    ids = random.choice(len(faces), size=count, p=areas / areas.sum()).astype(np.uint32)
    if is_sorted:
        ids.sort()
    points, moved = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    for begin in range(0, count, 1 << 20):
        part = slice(begin, begin + (1 << 20))
        u, v = random.random((2, len(ids[part]), 1))
        flip = u + v > 1.0
        u, v = np.where(flip, 1.0 - u, u), np.where(flip, 1.0 - v, v)
        a, b, c = np.moveaxis(corners[ids[part]], 1, 0)
        at = a + u * (b - a) + v * (c - a)
        points[part] = at
        moved[part] = at + 1e-4 * unit[ids[part]]
    return points, ids, moved


def clocks() -> Any:
    """Returns wall-clock time and the CPU time of the process, all its threads together."""
    return np.array([time.perf_counter(), time.process_time()])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rings", type=int, default=224, help="4 * rings^2 faces")
    parser.add_argument("--points", type=int, default=10_000_000)
    parser.add_argument("--trimesh-points", type=int, default=1_000_000)
    parser.add_argument("--judged-points", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--sorted", action="store_true", help="face after face")
    parser.add_argument("--occlusion", required=True, metavar="FILE", help="values; made if it is not there")
    parser.add_argument("--bake-only", action="store_true", help="make that file and nothing else")
    parser.add_argument("--only", nargs="*", help="what to measure, by name")
    parser.add_argument("--json", help="where to write the figures")
    typed = parser.parse_args()

    vertices, faces = bumpy_sphere(typed.rings)
    points, ids, moved = sample(vertices, faces, typed.points, typed.sorted)
    directions = (np.asarray(LIGHT, np.float32) - moved).astype(np.float32)
    light = [antumbra.PointLight(LIGHT)]
    few = typed.trimesh_points

    bake_seconds = None
    if not os.path.exists(typed.occlusion):
        begin = clocks()
        scene = antumbra.Scene.from_arrays(vertices, faces)
        size = antumbra.ShadowIndex(scene, light, refine="eager", threads=1).save(typed.occlusion)
        bake_seconds = list(clocks() - begin)
        print(f"{typed.occlusion}: {size} bytes, made in {bake_seconds[1]:.1f} s of CPU", flush=True)
    if typed.bake_only:
        return 0

    def ours(**how: Any) -> Callable[[], Callable[[], Any]]:
        asked = how.pop("points", points)
        made = {name: how.pop(name) for name in ("refine", "method", "occlusion") if name in how}

        def make() -> Callable[[], Any]:
            scene = antumbra.Scene.from_arrays(vertices, faces)
            index = antumbra.ShadowIndex(scene, light, threads=1, **made)
            return lambda: index.occluded(asked, threads=1, **how)

        return make

    def embree() -> Callable[[], Any]:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh

        scene = rtcore_scene.EmbreeScene()
        TriangleMesh(scene=scene, vertices=vertices, indices=faces)

        def ask() -> Any:
            # 0 where something is hit, -1 where nothing is.
            return scene.run(moved, directions, query="OCCLUDED") != -1

        return ask

    def by_trimesh(engine: str) -> Callable[[], Callable[[], Any]]:
        def make() -> Callable[[], Any]:
            import trimesh

            mesh = trimesh.Trimesh(vertices, faces, process=False)
            ray: Any = mesh.ray
            if engine == "antumbra":
                from antumbra.ray import RayMeshIntersector

                ray = RayMeshIntersector(mesh, threads=1)
            return lambda: ray.intersects_any(moved[:few], directions[:few])

        return make

    subjects: dict[str, tuple[Callable[[], Callable[[], Any]], int]] = {
        "embreex, OCCLUDED": (embree, typed.points),
        "antumbra, on faces": (ours(face_ids=ids), typed.points),
        "antumbra, on faces, kept": (ours(face_ids=ids, occlusion=typed.occlusion), typed.points),
        "antumbra, free": (ours(points=moved), typed.points),
        "antumbra, free, kept": (ours(points=moved, occlusion=typed.occlusion), typed.points),
        "antumbra, on faces, bvh": (ours(face_ids=ids, method="bvh"), typed.points),
        "antumbra, on nearest, kept": (ours(on_surface=True, occlusion=typed.occlusion), typed.points),
        "trimesh, intersects_any": (by_trimesh("trimesh"), few),
        "trimesh with antumbra.ray": (by_trimesh("antumbra"), few),
    }
    kept = [name for name in subjects if not typed.only or name in typed.only]
    asks: dict[str, Callable[[], Any]] = {}
    answers: dict[str, Any] = {}
    cold: dict[str, Any] = {}
    for name in kept:
        begin = clocks()
        try:
            asks[name] = subjects[name][0]()
        except ImportError as error:
            print(f"{name}: not installed ({error}), NOT measured", flush=True)
            continue
        answers[name] = asks[name]()
        cold[name] = clocks() - begin
    # In turn, so that what else the machine does meets all of them.
    warm: dict[str, list[Any]] = {name: [] for name in asks}
    for _ in range(typed.rounds):
        for name, ask in asks.items():
            begin = clocks()
            again = ask()
            warm[name].append(clocks() - begin)
            assert np.array_equal(answers[name], again), f"{name}: answers changed"

    found = {}
    for name in asks:
        count = subjects[name][1]
        share = float(np.mean(answers[name]))
        wall, cpu = zip(1e9 * cold[name] / count, 1e9 * np.median(warm[name], axis=0) / count)
        found[name] = {
            "points": count,
            "blocked": share,
            "cold_wall_ns": wall[0],
            "warm_wall_ns": wall[1],
            "cold_cpu_ns": cpu[0],
            "warm_cpu_ns": cpu[1],
        }
        print(
            f"{name:26} CPU ns a point: cold {cpu[0]:8.1f}, warm {cpu[1]:8.1f}; wall: {wall[0]:8.1f}, {wall[1]:8.1f}; "
            f"blocked {share:.4f}",
            flush=True,
        )

    ratios = {}
    for name in found:
        for rival in ("embreex, OCCLUDED", "trimesh, intersects_any"):
            if name.startswith("antumbra") and rival in found:
                for kind in ("cold", "warm"):
                    # Fewer points would have to carry all of the preparation: trimesh's is left out.
                    of_rival = found[rival][f"{'warm' if rival.startswith('trimesh') else kind}_cpu_ns"]
                    ratio = of_rival / found[name][f"{kind}_cpu_ns"]
                    ratios[f"{rival} / {name}, {kind}"] = ratio
                    print(f"{rival} / {name}, {kind}, CPU: {ratio:.2f}")

    judged: dict[str, dict[str, int]] = {}
    asked = np.random.default_rng(2).permutation(typed.points)[: typed.judged_points]
    rule = antumbra.ShadowIndex(antumbra.Scene.from_arrays(vertices, faces), light, method="naive")
    for name in answers:
        if "embreex, OCCLUDED" not in answers or not name.startswith(("antumbra, on faces", "antumbra, free")):
            continue

        def truth(numbers: Any) -> Any:
            if "free" in name:
                return rule.occluded(moved[numbers])
            return rule.occluded(points[numbers], face_ids=ids[numbers])

        theirs, ours_of = answers["embreex, OCCLUDED"][asked], answers[name][asked]
        differing = asked[theirs != ours_of]
        # A few that agree, too: both could be wrong.
        agreeing = asked[theirs == ours_of][:500]
        right = truth(differing)
        judged[name] = {
            "points": len(asked),
            "differences": len(differing),
            "other_answer_wrong": int(np.sum(answers["embreex, OCCLUDED"][differing] != right)),
            "antumbra_wrong": int(np.sum(answers[name][differing] != right)),
            "agreements_judged": len(agreeing),
            "agreements_wrong": int(np.sum(truth(agreeing) != answers[name][agreeing])),
        }
        print(f"{name}, judged by the exact rule: {judged[name]}", flush=True)

    if typed.json:
        record = {
            "faces": len(faces),
            "order": "sorted by face" if typed.sorted else "random",
            "threads": 1,
            "rounds": typed.rounds,
            "machine": platform.processor() or platform.machine(),
            "cpus": os.cpu_count(),
            "python": platform.python_version(),
            "numpy": np.__version__,
            "antumbra": antumbra.__version__,
            "bake_seconds_wall_cpu": bake_seconds,
            "times": found,
            "ratios": ratios,
            "judged": judged,
        }
        with open(typed.json, "w", encoding="utf-8") as file:
            json.dump(record, file, indent=2)
            file.write("\n")
    return 1 if any(verdict["antumbra_wrong"] or verdict["agreements_wrong"] for verdict in judged.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
