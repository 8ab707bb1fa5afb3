"""Shows what lifting ray origins off their surfaces does to the hours of sun on a roof.

    pip install . embreex
    python bench/python_offsets.py --svg offsets.svg

A gabled house with a chimney and a dormer stands beside a taller neighbor, 175 m from the origin. Sensors lie on its roof in a grid; the
suns are those of a year, hour by hour, at latitude 48. antumbra is asked about the points as they are. Embree needs
origins that are lifted off the roof, or it finds the roof itself, and is asked again for each distance.

Reported for each distance, in meters: of the answers that antumbra calls lit, the share that Embree calls shadowed; of those
that antumbra calls shadowed, the share that Embree calls lit; and the sensor whose hours differ most. As the distance
shrinks, Embree comes near antumbra's answers, until rounding takes over. Differences at the smallest distance that are
judged by the exact rule (method="naive") are all Embree's.
"""

from __future__ import annotations

import argparse
import math
from typing import Any

import numpy as np
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh

import antumbra

LATITUDE = math.radians(48.0)
DISTANCES = [10.0 ** (exponent / 2) for exponent in range(-14, -1)]


class House:
    """Vertices and triangles of a few boxes and roofs; the faces of the roof that is studied."""

    def __init__(self) -> None:
        self.vertices: list[tuple[float, float, float]] = []
        self.faces: list[tuple[int, int, int]] = []

    def polygon(self, *corners: tuple[float, float, float]) -> list[int]:
        """Adds a convex polygon, counterclockwise from outside. Returns its triangles."""
        first = len(self.vertices)
        self.vertices.extend(corners)
        added = [(first, first + i, first + i + 1) for i in range(1, len(corners) - 1)]
        self.faces.extend(added)
        return list(range(len(self.faces) - len(added), len(self.faces)))

    def box(self, low: tuple[float, float, float], high: tuple[float, float, float]) -> None:
        """Adds a box without a bottom."""
        (a, b, c), (d, e, f) = low, high
        self.polygon((a, b, f), (d, b, f), (d, e, f), (a, e, f))
        ring = [(a, b), (d, b), (d, e), (a, e)]
        for (x, y), (u, v) in zip(ring, ring[1:] + ring[:1]):
            self.polygon((x, y, c), (u, v, c), (u, v, f), (x, y, f))

    def gable(self, low: tuple[float, float], high: tuple[float, float], eaves: float, ridge: float) -> list[int]:
        """Adds walls and a roof whose ridge runs along x. Returns the triangles of the roof."""
        (a, b), (d, e) = low, high
        middle = 0.5 * (b + e)
        south = self.polygon((a, b, eaves), (d, b, eaves), (d, middle, ridge), (a, middle, ridge))
        north = self.polygon((d, e, eaves), (a, e, eaves), (a, middle, ridge), (d, middle, ridge))
        self.polygon((a, b, 0.0), (d, b, 0.0), (d, b, eaves), (a, b, eaves))
        self.polygon((d, e, 0.0), (a, e, 0.0), (a, e, eaves), (d, e, eaves))
        self.polygon((d, b, 0.0), (d, e, 0.0), (d, e, eaves), (d, middle, ridge), (d, b, eaves))
        self.polygon((a, e, 0.0), (a, b, 0.0), (a, b, eaves), (a, middle, ridge), (a, e, eaves))
        return south + north


def town() -> tuple[Any, Any, list[int]]:
    """Returns vertices, triangles, and which of these are the roof of the house."""
    house = House()
    house.polygon((-60.0, -60.0, 0.0), (60.0, -60.0, 0.0), (60.0, 60.0, 0.0), (-60.0, 60.0, 0.0))
    roof = house.gable((0.0, 0.0), (11.3, 8.7), 5.1, 8.9)
    house.box((7.9, 4.8, 6.0), (8.7, 5.6, 10.2))
    house.box((2.2, 1.1, 5.2), (4.1, 3.3, 7.6))
    house.gable((-6.0, -22.0), (13.0, -12.0), 9.0, 13.5)
    house.gable((15.5, -2.0), (25.0, 9.0), 7.0, 11.0)
    return np.array(house.vertices), np.array(house.faces, dtype=np.int32), roof


def sensors(vertices: Any, faces: Any, roof: list[int], spacing: float) -> tuple[Any, Any, Any]:
    """Returns points on triangles about so far apart, the triangles, and their normals."""
    points, owners, normals = [], [], []
    for face in roof:
        a, b, c = vertices[faces[face]]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal)
        steps = max(1, math.ceil(max(np.linalg.norm(b - a), np.linalg.norm(c - a)) / spacing))
        for i in range(steps):
            for j in range(steps - i):
                u, v = (i + 1 / 3) / steps, (j + 1 / 3) / steps
                points.append(a + u * (b - a) + v * (c - a))
                owners.append(face)
                normals.append(normal)
    return np.array(points), np.array(owners, dtype=np.uint32), np.array(normals)


def suns(step_hours: float) -> Any:
    """Returns unit vectors to the suns of a year above the horizon; x is east, y north."""
    hours = np.arange(0.0, 365.0 * 24.0, step_hours) + 0.5 * step_hours
    declination = np.radians(23.44) * np.sin(2.0 * np.pi * (284.0 + hours / 24.0) / 365.0)
    angle = np.radians(15.0) * (hours % 24.0 - 12.0)
    east = -np.cos(declination) * np.sin(angle)
    north = np.cos(LATITUDE) * np.sin(declination) - np.sin(LATITUDE) * np.cos(declination) * np.cos(angle)
    up = np.sin(LATITUDE) * np.sin(declination) + np.cos(LATITUDE) * np.cos(declination) * np.cos(angle)
    directions = np.stack([east, north, up], -1)
    return directions[up > 0.0]


def plot(path: str, rows: list[tuple[float, float, float]]) -> None:
    """Writes both shares over the distance, as SVG; both axes are logarithmic, and 0 lies at the bottom."""
    width, height, left, bottom = 640, 320, 72, 48
    low, high = math.log10(rows[0][0]), math.log10(rows[-1][0])
    least, most = -4.0, 2.0

    def at(distance: float, share: float) -> tuple[float, float]:
        x = left + (width - left - 16) * (math.log10(distance) - low) / (high - low)
        up = (math.log10(max(share, 10.0**least)) - least) / (most - least)
        return round(x, 1), round(height - bottom - (height - bottom - 16) * up, 1)

    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">']
    parts.append(f'<rect width="{width}" height="{height}" fill="white"/>')
    for exponent in range(math.ceil(low), math.floor(high) + 1):
        x, y = at(10.0**exponent, 10.0**least)
        parts.append(f'<path d="M{x} 16V{y}" stroke="#ddd"/><text x="{x}" y="{y + 16}" text-anchor="middle">1e{exponent}</text>')
    for exponent in range(int(least), int(most) + 1):
        x, y = at(rows[0][0], 10.0**exponent)
        label = f"{10.0**exponent:g} %"
        parts.append(f'<path d="M{x} {y}H{width - 16}" stroke="#ddd"/><text x="{x - 6}" y="{y + 4}" text-anchor="end">{label}</text>')
    for column, color in [(1, "#d55e00"), (2, "#0072b2")]:
        line = " ".join("{},{}".format(*at(row[0], row[column])) for row in rows)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2"/>')
    parts.append(f'<text x="{left + 190}" y="34" fill="#d55e00">lit points that Embree calls shadowed</text>')
    parts.append(f'<text x="{left + 190}" y="52" fill="#0072b2">shadowed points that Embree calls lit</text>')
    parts.append(f'<text x="{width / 2}" y="{height - 8}" text-anchor="middle">distance of ray origins from the roof, meters</text></svg>')
    with open(path, "w", encoding="utf-8") as file:
        file.write("\n".join(parts) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--spacing", type=float, default=0.35, help="meters between sensors")
    parser.add_argument("--step", type=float, default=1.0, help="hours between suns")
    parser.add_argument("--at", type=float, nargs=2, default=[150.0, 90.0], help="where the house stands, in meters")
    parser.add_argument("--svg", help="file to write a plot to")
    arguments = parser.parse_args()
    vertices, faces, roof = town()
    # Corners that float32 holds, so that both are asked about one mesh.
    vertices = (vertices + [*arguments.at, 0.0]).astype(np.float32).astype(np.float64)
    points, owners, normals = sensors(vertices, faces, roof, arguments.spacing)
    directions = suns(arguments.step)
    lights = [antumbra.DirectionalLight(tuple(direction)) for direction in directions]
    scene = antumbra.Scene.from_arrays(vertices, faces)
    index = antumbra.ShadowIndex(scene, lights, method="bvh")
    ours = index.occluded(points, np.arange(len(lights)), face_ids=owners)
    # What faces away is no ray.
    facing = normals @ directions.T > 0.0
    lit, shadowed = facing & ~ours, facing & ours
    print(f"{len(points)} sensors, {len(directions)} suns: {facing.sum()} answers, {100 * lit.sum() / facing.sum():.1f} % lit")
    embree = rtcore_scene.EmbreeScene()
    TriangleMesh(scene=embree, vertices=vertices.astype(np.float32), indices=faces)
    rows = []
    judged = None
    for distance in DISTANCES:
        origins = (points + distance * normals).astype(np.float32)
        theirs = np.empty_like(ours)
        for sun, direction in enumerate(directions.astype(np.float32)):
            rays = np.broadcast_to(direction, origins.shape)
            theirs[:, sun] = embree.run(origins, np.ascontiguousarray(rays), query="OCCLUDED") != -1
        wrongly_dark, wrongly_lit = lit & theirs, shadowed & ~theirs
        if judged is None:
            judged = np.argwhere(wrongly_dark | wrongly_lit)[:: max(1, (wrongly_dark | wrongly_lit).sum() // 200)]
        shares = 100.0 * wrongly_dark.sum() / lit.sum(), 100.0 * wrongly_lit.sum() / shadowed.sum()
        hours = arguments.step * np.abs((lit & ~theirs | shadowed & ~theirs).sum(1) - lit.sum(1)).max()
        rows.append((distance, *shares))
        print(f"  {distance:9.2e} m: {shares[0]:7.4f} % of lit shadowed, {shares[1]:7.4f} % of shadowed lit, worst sensor {hours:.0f} h a year")
    naive = antumbra.ShadowIndex(scene, lights, method="naive")
    wrong = sum(
        int(naive.occluded(points[[p]], int(s), face_ids=owners[[p]]).item() != ours[p, s]) for p, s in judged
    )
    print(f"{len(judged)} differences judged by the exact rule: {wrong} of ours wrong")
    if arguments.svg:
        plot(arguments.svg, rows)


if __name__ == "__main__":
    main()
