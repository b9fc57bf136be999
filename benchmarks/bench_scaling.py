"""How cost grows with the size of a task: ``python -m benchmarks.bench_scaling``.

Each law is measured by itself, with everything else fixed, and fitted by a line (least squares).
Pixels, triangles, objects and lamps: computed bumps on a plane, one process, one core, CPU time of
a frame that was drawn before (RGB, depth, instance, category, amodal silhouettes). Views and
workers: samples of the tabletop of ``bench_tabletop``. Assets: memory of a process that has passed
so many different ones through the caches of a renderer.

    python -m benchmarks.bench_scaling --only pixels lamps
"""

import argparse
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks import bench_memory, bench_render, bench_tabletop
from benchmarks.bench_street_render import CHANNELS, Street, grid_mesh
from benchmarks.runs import machine, measure_run
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.library import open_library
from gen_data.core import asset_types, intrinsics, se3, streams, system_calls
from gen_data.core.scene import Body, Camera, Environment, Instance, Light, Scene
from gen_data.renderers.warp.device import open_device
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.renderers.warp.scene.device_cache import DeviceCache
from gen_data.runner.resident_memory import release_memory

Points = list[tuple[float, float]]
FIELD_M = 4.0
"""Side of the square that the bumps share."""


@dataclass(frozen=True)
class Line:
    """The line ``intercept + slope * x`` that fits points best.

    Attributes:
        r2: Share of the variance that it explains; NaN if all values are equal.
    """

    slope: float
    intercept: float
    r2: float


def fit_line(points: Points) -> Line:
    """Fit a line by least squares. Raises ValueError for fewer than two different ``x``."""
    x, y = np.asarray(points, dtype=np.float64).reshape(-1, 2).T
    if len(set(x.tolist())) < 2:
        raise ValueError("a line needs points at two different places")
    dx, dy = x - x.mean(), y - y.mean()
    slope = float(dx @ dy / (dx @ dx))
    left = dy - slope * dx
    spread = float(dy @ dy)
    r2 = 1.0 - float(left @ left) / spread if spread > 0.0 else math.nan
    return Line(slope, float(y.mean() - slope * x.mean()), r2)


class Bumps(Street):
    """An AssetLibrary of bumps, ``bump/<rows>``, which have twice the square of that triangles."""

    def mesh(self, asset_id: str) -> asset_types.MeshData:
        """Raised square of 1 m, or the plane ``bump/1`` beneath all of them."""
        return bump_mesh(int(asset_id.partition("/")[2]))


@cache
def bump_mesh(rows: int) -> asset_types.MeshData:
    """See Bumps."""
    ticks = np.linspace(-0.5, 0.5, rows + 1)
    x, y = np.meshgrid(ticks, -ticks, indexing="ij")
    z = 0.3 * np.cos(np.pi * x) * np.cos(np.pi * y) * (1.0 + 0.2 * np.cos(9.0 * x + 5.0 * y))
    paint = asset_types.Material((0.4, 0.35, 0.3), 0.6)
    return grid_mesh(np.stack([x, y, z], axis=-1).reshape(-1, 3), rows, rows, (paint,))


def bumps_scene(
    side: int = 3, rows: int = 40, lamps: int = 2, size_px: tuple[int, int] = (640, 480)
) -> Scene:
    """Bumps on a plane, ``side`` along both axes of the same square, and small lamps above."""
    step_m = FIELD_M / side
    bodies = [Body("plane", "bump/1", se3.SE3((0.0, 0.0, 0.0)), scale=3.0 * FIELD_M)]
    instances = []
    for k in range(side * side):
        at = [(index + 0.5) * step_m - 0.5 * FIELD_M for index in divmod(k, side)]
        name, asset = f"bump{k}", f"bump/{rows}"
        pose = se3.SE3((at[0], at[1], 0.01))
        bodies.append(Body(name, asset, pose, scale=0.8 * step_m, instance_id=k + 1))
        instances.append(Instance(k + 1, name, "bump", 1, asset))
    turns = [2.0 * math.pi * k / lamps for k in range(lamps)]
    lights = tuple(
        Light(
            f"lamp{k}",
            "sphere",
            (2.0 * math.cos(turn), 2.0 * math.sin(turn), 3.0),
            intensity_cd=400.0,
        )
        for k, turn in enumerate(turns)
    )
    width, height = size_px
    focal_px = 1.1 * width
    lens = intrinsics.Intrinsics(width, height, focal_px, focal_px, 0.5 * width, 0.5 * height)
    return Scene(
        template="bumps",
        bodies=tuple(bodies),
        instances=tuple(instances),
        lights=lights,
        environment=Environment("sky", 100.0),
        cameras=(Camera("front", se3.look_at((0.0, -5.0, 3.5), (0.0, 0.0, 0.0)), lens),),
    )


def _frames(scenes: Iterator[tuple[float, Scene]], repeats: int) -> Points:
    """CPU time of each scene, drawn again [ms]."""
    renderer = WarpRenderer(Bumps(), "cpu")
    points = []
    for x, scene in scenes:
        bench_render.photograph(renderer, scene, CHANNELS)
        points.append((x, bench_render.frame_ms(renderer, [scene], CHANNELS, repeats)[0]))
    return points


def by_pixels(repeats: int) -> Points:
    """Thousands of pixels; CPU ms per frame."""
    sizes = [(160, 120), (320, 240), (480, 360), (640, 480), (960, 720), (1280, 960)]
    return _frames(((w * h / 1e3, bumps_scene(size_px=(w, h))) for w, h in sizes), repeats)


def by_triangles(repeats: int) -> Points:
    """Thousands of triangles in nine objects; CPU ms per frame."""
    rows = (10, 40, 80, 120, 160, 240)
    return _frames(((18 * n * n / 1e3, bumps_scene(rows=n)) for n in rows), repeats)


def by_objects(repeats: int) -> Points:
    """Objects of 200 triangles, which fill the same area; CPU ms per frame."""
    sides = (2, 4, 6, 8, 12, 16)
    return _frames(((n * n, bumps_scene(side=n, rows=10)) for n in sides), repeats)


def by_lamps(repeats: int) -> Points:
    """Lamps with soft shadows; CPU ms per frame."""
    return _frames(((n, bumps_scene(lamps=n)) for n in (1, 2, 4, 6, 8, 12, 16)), repeats)


def by_views(repeats: int) -> Points:
    """Scenes per sample, the inverse of ``views_per_scene``; CPU ms per sample, not encoded."""
    return [
        (1.0 / views, min(_tabletop_ms(views) for _ in range(repeats))) for views in (1, 2, 5, 10)
    ]


def _tabletop_ms(views: int, n: int = 20) -> float:
    """CPU time per sample of the tabletop, after the first scene [ms]."""
    with PipelineFactory(bench_tabletop.make_config(views), n + views)() as pipeline:
        for index in range(views):
            pipeline.sample(index)
        started_s = time.process_time()
        for index in range(views, n + views):
            pipeline.sample(index)
        return 1e3 * (time.process_time() - started_s) / n


def by_workers(repeats: int) -> Points:
    """Workers, up to one per core; samples per second to disk, with the start of the workers."""
    n = 100 * repeats
    counts = range(1, system_calls.usable_cores() + 1)
    return [(k, measure_run(bench_tabletop.make_config(5), n, k).samples_per_s) for k in counts]


def by_assets(repeats: int) -> Points:
    """Different objects, textures and panoramas seen; private memory [MB]."""
    library = open_library()
    cached = DeviceCache(library, open_device("cpu"))
    upload = {"object": cached.mesh, "texture": cached.texture, "environment": cached.environment}
    seen = [(kind, one.asset_id) for kind in upload for one in library.find((), kind)]
    streams.Streams(0, 0).rng("assets").shuffle(seen)
    step = 50 * repeats
    points = []
    for first in range(0, min(8 * step, len(seen)), step):
        release_memory(file_bytes_kept=0)
        points.append((first, bench_memory.read_rollup(os.getpid())["Pss_Anon"]))
        for kind, asset_id in seen[first : first + step]:
            upload[kind](asset_id)
    return points


LAWS: dict[str, Callable[[int], Points]] = {
    "pixels": by_pixels,
    "triangles": by_triangles,
    "objects": by_objects,
    "lamps": by_lamps,
    "views": by_views,
    "workers": by_workers,
    "assets": by_assets,
}


def format_law(name: str, points: Points) -> str:
    """A row of the table of docs/performance.md; a single point has no line."""
    listed = ", ".join(f"{x:.4g}: {y:.4g}" for x, y in points)
    if len(points) < 2:
        return f"| {name} | {listed} | | | |"
    line = fit_line(points)
    return f"| {name} | {listed} | {line.slope:.3g} | {line.intercept:.3g} | {line.r2:.3f} |"


def main() -> None:
    """Print one row per law."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    print(f"{machine()}, {system_calls.usable_cores()} cores, load {os.getloadavg()[0]:.1f}\n")
    print("| law | measured | slope | intercept | r2 |\n|---|---|---|---|---|", flush=True)
    for name in arguments.only:
        points = LAWS[name](arguments.repeats)
        print(format_law(f"{name}: {LAWS[name].__doc__}", points), flush=True)


if __name__ == "__main__":
    main()
