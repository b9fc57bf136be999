"""Time by kernel and copy, rays per second of laser scanners, and the path-traced tier."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from statistics import median
from typing import Any

import numpy as np
import warp as wp

from benchmarks.bench_render import timed_launches
from benchmarks.gpu.rates import overrides_of
from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.core.capture import LidarRays
from gen_data.renderers.warp.device import open_device
from gen_data.sensors.lidar.scan_pattern import Sweep, lidar_model, make_sweep

_SWEEP = ("kitti_rig", "velodyne", "HDL-64E")
_SMALL_SWEEP = ("robot_vacuum", "scan", "VLP-16")
"""Configuration, its scanner whose place is taken, and the model whose rays are traced."""
Spent = dict[str, tuple[int, float]]
"""Calls and milliseconds by kernel or kind of copy."""


def timed_activity(work: Callable[[], object], device: str) -> tuple[Spent, float]:
    """Time of a device by activity, and wall-clock time, of a piece of work [ms]."""
    counts, spent_ms = Counter[str](), Counter[str]()
    if open_device(device).is_cpu:
        with timed_launches() as by_kernel:
            wall_ms = _wall_ms(work)
        return {name: (1, ms) for name, ms in by_kernel.items()}, wall_ms
    wp.timing_begin()
    started_s = time.perf_counter()
    work()
    wp.synchronize()
    wall_ms = 1e3 * (time.perf_counter() - started_s)
    for result in wp.timing_end():
        counts[result.name] += 1
        spent_ms[result.name] += result.elapsed
    return {name: (counts[name], spent_ms[name]) for name in counts}, wall_ms


def time_kernels(config: str, device: str, views: int, small: bool) -> dict[str, Any]:
    """Where one process spends the time of a sample, after a first scene.

    Returns:
        ``wall_ms``, ``device_ms``: per sample; ``table``: calls and milliseconds per sample by
        kernel or copy, the longest first; ``free_mb``: memory that this process takes.
    """
    opened = open_device(device)
    before = 0 if opened.is_cpu else opened.free_memory
    # All views of one scene are the quickest.
    in_scene = 4 * views if small else views
    texts = (*overrides_of(config, device, small), f"views_per_scene={in_scene}")
    with open_pipeline(load_config(f"{config}.yaml", seed=1, overrides=texts)) as pipeline:
        for index in range(2 * views):
            pipeline.sample(index)
        samples = range(2 * views, 3 * views)
        walls = []
        for index in samples:
            started_s = time.perf_counter()
            pipeline.sample(index)
            walls.append(1e3 * (time.perf_counter() - started_s))
        again = range(3 * views, 4 * views)
        spent, timed_ms = timed_activity(lambda: [pipeline.sample(i) for i in again], device)
    table = sorted(
        ((n, c / views, ms / views) for n, (c, ms) in spent.items()), key=lambda r: -r[2]
    )
    taken = 0 if opened.is_cpu else before - opened.free_memory
    return {
        "wall_ms": [round(ms, 2) for ms in walls], "timed_wall_ms": timed_ms / views,
        "device_ms": sum(row[2] for row in table), "device_mb": taken / 1e6, "table": table,
    }  # fmt: skip


def time_sweeps(device: str, rays: int, repeats: int, small: bool) -> dict[str, Any]:
    """Rays per second of a sweep of an HDL-64E in traffic, and of as many sweeps as make ``rays``.

    Args:
        device: Device of the renderer.
        rays: Smallest number of rays in the launch of many sweeps.
        repeats: Measurements of each launch.
        small: Take a VLP-16 in a room instead.

    Returns:
        By kind of launch: ``rays``, ``ms`` from call to hits on the host, and ``kernels``.
    """
    name, scanner, model = _SMALL_SWEEP if small else _SWEEP
    config = load_config(f"{name}.yaml", seed=1, overrides=(f"render.device={device}",))
    sweep = make_sweep(lidar_model(model), 0.0)
    count = len(sweep.directions)
    figures = {}
    with open_pipeline(config) as pipeline:
        scene = pipeline.drawn_view(pipeline.accepted_scene(0), 0).scene
        renderer, lidar = pipeline.renderer, scene.lidar(scanner)
        for name, copies in (("one sweep", 1), ("one launch of many", -(-rays // count))):
            beams = _repeated(sweep, copies, lidar_model(model).range_m[1])
            anew = partial(renderer.scan, replace(scene), lidar, beams)
            packed_ms = _wall_ms(anew)
            kernels, _ = timed_activity(anew, device)
            figures[name] = {
                "rays": count * copies, "ms": median(_wall_ms(anew) for _ in range(repeats)),
                "with_packing_ms": packed_ms,
                "kernels": sorted(((n, ms) for n, (_, ms) in kernels.items()), key=lambda r: -r[1]),
            }  # fmt: skip
    return figures


def _repeated(sweep: Sweep, copies: int, range_m: float) -> LidarRays:
    """The rays of several equal sweeps, one after another."""
    count, order = len(sweep.directions), None
    if sweep.order is not None:
        order = np.concatenate([sweep.order + k * count for k in range(copies)]).astype(np.int32)
    directions = np.tile(sweep.directions, (copies, 1))
    return LidarRays(directions, 0.0, 1, range_m, order=order)


def _wall_ms(work: Callable[[], object]) -> float:
    started_s = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - started_s)


def time_paths(device: str, size_px: tuple[int, int], samples: int) -> dict[str, Any]:
    """Seconds per path-traced image of the shipped table, and paths per second."""
    texts = (
        f"render.device={device}", f"render.samples={samples}", "render.denoise=false",
        f"sensors[0].size_px=[{size_px[0]}, {size_px[1]}]", "views_per_scene=3",
    )  # fmt: skip
    with open_pipeline(
        load_config("tabletop_pathtraced.yaml", seed=1, overrides=texts)
    ) as pipeline:
        pipeline.sample(0)
        started_s = time.perf_counter()
        pipeline.sample(1)
        spent_s = time.perf_counter() - started_s
        kernels, _ = timed_activity(lambda: pipeline.sample(2), device)
    paths = size_px[0] * size_px[1] * samples
    return {
        "s": spent_s, "paths_per_s": paths / spent_s,
        "kernels": sorted(((n, c, ms) for n, (c, ms) in kernels.items()), key=lambda r: -r[2])[:8],
    }  # fmt: skip
