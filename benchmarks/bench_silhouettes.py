"""Beams that meet an object alone, an upper bound of its points in a scan.

``python -m benchmarks.bench_silhouettes --range 10`` stands objects on level ground, ahead of a
scanner 1.73 m above it, and counts beams per direction of view: those whose axis ends on the object
at least 0.2 m above the ground, as ``bench_scans`` counts points, and those of which any of seven
rays does, that is, which touch it with at least a part of their divergence.
"""

import argparse
import math

import numpy as np

from gen_data.assets.library import Library, open_library
from gen_data.core.capture import LidarRays
from gen_data.core.interfaces import Renderer
from gen_data.core.scene import Body, Instance, Lidar, Scene
from gen_data.core.se3 import SE3
from gen_data.renderers.warp.renderer import WarpRenderer
from gen_data.sensors.lidar.scan_pattern import LidarModel, lidar_model, make_sweep

SCANNER_M, FLOOR_M = 1.73, 0.2
"""Heights above the ground: of KITTI's scanner, and below which points may be ground."""
VIEWS_DEG = {"behind": 0.0, "oblique": 45.0, "side": 90.0}
RAYS = 7


def beams_on(
    asset: str, yaw_deg: float, range_m: float, model: LidarModel, assets: Library, by: Renderer
) -> tuple[int, int]:
    """Beams whose axis, and of which any ray, meets an asset ``range_m`` ahead."""
    (_, _, bottom_m), _ = assets.bounds_m(asset)
    pose = SE3.about_z(math.radians(yaw_deg), (range_m, 0.0, -bottom_m))
    body, thing = Body("it", asset, pose, instance_id=1), Instance(1, "it", "it", 1, asset)
    lidar = Lidar("lidar", "", T_world_lidar=SE3((0.0, 0.0, SCANNER_M)))
    sweep = make_sweep(model, 0.0)
    ahead = sweep.directions[:, 0] > 0.7
    directions = sweep.directions[ahead]
    origins_m = np.zeros_like(directions) if sweep.origins_m is None else sweep.origins_m[ahead]
    divergence_rad = 1e-3 * model.divergence_mrad
    rays = LidarRays(directions, divergence_rad, RAYS, model.range_m[1], origins_m)
    hits = by.scan(Scene("alone", (body,), (thing,)), lidar, rays)
    # Rays of a beam differ by less than 1 cm in height here: all are judged by its axis.
    away_m = np.where(np.isfinite(hits.range_m), hits.range_m, 0.0)
    up_m = SCANNER_M + origins_m[:, 2:] + away_m * directions[:, 2:]
    on = (hits.instance_id == 1) & (up_m >= FLOOR_M)
    return int(on[:, 0].sum()), int(on.any(axis=1).sum())


def main() -> None:
    """Print a line per asset, and the means of each kind."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--range", type=float, default=10.0, help="metres")
    parser.add_argument("--model", default="HDL-64E")
    parser.add_argument(
        "--kinds", nargs="+", default=["cyclist", "cyclist?pose=wait", "simple_person"]
    )
    parser.add_argument("--variants", type=int, default=6)
    arguments = parser.parse_args()
    assets, model = open_library(), lidar_model(arguments.model)
    renderer = WarpRenderer(assets, "cpu")
    print(f"{'axes/touching beams':28}" + "".join(f"{view:>12}" for view in VIEWS_DEG))
    for kind in arguments.kinds:
        joint = "&" if "?" in kind else "?"
        counts = np.array(
            [
                [
                    beams_on(
                        f"{kind}{joint}seed={seed}", yaw, arguments.range, model, assets, renderer
                    )
                    for yaw in VIEWS_DEG.values()
                ]
                for seed in range(arguments.variants)
            ]
        )
        for name, row in ((f"{kind}, mean", counts.mean(axis=0)), ("  most", counts.max(axis=0))):
            print(f"{name:28}" + "".join(f"{a:7.0f}/{b:4.0f}" for a, b in row))


if __name__ == "__main__":
    main()
