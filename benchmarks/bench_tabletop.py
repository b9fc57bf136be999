"""Labelled samples per second to disk: ``python -m benchmarks.bench_tabletop``.

640x480, the shipped tabletop with the arm and exactly ten objects, two soft-shadow lights and
environment light; RGB, depth, instance and category PNGs and COCO and KITTI labels on disk.
PyBullet's TinyRenderer draws the same scenes for comparison.
"""

import argparse
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runs import format_summary, machine, measure_run
from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import open_pipeline

OVERRIDES = ("randomizers.clutter.count=10", "randomizers.lamps.count=2")


# All features of lights and materials: balls, spots, rectangles, disks and visible panels; coats,
# panes, solid glass, metal, bumps. Mirrors, panoramas and metering are in the scene anyway.
EVERYTHING = (
    *OVERRIDES, "randomizers.lamps.kind={choice: [sphere, spot, rectangle, disk]}",
    "randomizers.lamps.visible=true", "randomizers.finish.coated={probability: 0.4}",
    "randomizers.finish.clear={probability: 0.2}", "randomizers.finish.solid={probability: 0.5}",
)  # fmt: skip


def make_config(views_per_scene: int) -> Config:
    """Tabletop with ten objects and two lamps."""
    overrides = (*OVERRIDES, f"views_per_scene={views_per_scene}")
    return load_config("tabletop.yaml", seed=1, overrides=overrides)


def every_effect_config() -> Config:
    """The tabletop with every effect of the realtime tier."""
    return load_config("tabletop.yaml", seed=1, overrides=EVERYTHING)


def first_sample_s() -> float:
    """Time to the first sample in this process [s]."""
    started_s = time.perf_counter()
    with open_pipeline(make_config(5)) as pipeline:
        pipeline.sample(0)
    return time.perf_counter() - started_s


def tiny_renderer_s(samples: int) -> float:
    """CPU seconds per sample of PyBullet's TinyRenderer on the same scenes and cameras.

    One light, hard shadow, no materials; RGB, depth and id PNGs are encoded and written, as ours.
    """
    import pybullet

    with open_pipeline(make_config(1)) as pipeline, tempfile.TemporaryDirectory() as folder:
        taken = [pipeline.sample(i) for i in range(samples)]
        client = pybullet.connect(pybullet.DIRECT)
        spent_s = 0.0
        for sample in taken:
            _load_bodies(pybullet, client, sample.scene.bodies, pipeline.assets, Path(folder))
            started_s = time.process_time()
            _draw(pybullet, client, sample.scene.cameras[0], Path(folder))
            spent_s += time.process_time() - started_s
            pybullet.resetSimulation(physicsClientId=client)
        pybullet.disconnect(client)
    return spent_s / samples


def _load_bodies(pybullet: Any, client: int, bodies: Any, assets: Any, folder: Path) -> None:
    """Load the meshes of all bodies into the engine; not part of the timing."""
    for body in bodies:
        path = folder / (body.asset.replace("/", "_").replace("?", "_") + ".obj")
        if not path.exists():
            mesh = assets.mesh(body.asset)
            lines = [f"v {x} {y} {z}" for x, y, z in mesh.vertices_m]
            lines += [f"vn {x} {y} {z}" for x, y, z in mesh.normals]
            lines += [f"f {a}//{a} {b}//{b} {c}//{c}" for a, b, c in mesh.faces + 1]
            path.write_text("\n".join(lines))
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH, fileName=str(path), meshScale=[body.scale] * 3,
            rgbaColor=[0.7, 0.6, 0.5, 1], physicsClientId=client,
        )  # fmt: skip
        w, x, y, z = body.T_world_body.quaternion_wxyz
        pybullet.createMultiBody(
            baseVisualShapeIndex=shape, basePosition=body.T_world_body.translation_m,
            baseOrientation=[x, y, z, w], physicsClientId=client,
        )  # fmt: skip


def _draw(pybullet: Any, client: int, camera: Any, folder: Path) -> None:
    import cv2

    k = camera.intrinsics
    T_camera_world = camera.T_world_camera.inverse().matrix()
    view = np.diag([1.0, -1.0, -1.0, 1.0]) @ T_camera_world
    near_m, far_m = 0.05, 20.0
    projection = np.zeros((4, 4))
    projection[0, 0], projection[1, 1] = 2 * k.fx_px / k.width_px, 2 * k.fy_px / k.height_px
    projection[2, 2] = -(far_m + near_m) / (far_m - near_m)
    projection[2, 3] = -2 * far_m * near_m / (far_m - near_m)
    projection[3, 2] = -1
    _, _, rgba, depth, ids = pybullet.getCameraImage(
        k.width_px, k.height_px, viewMatrix=view.T.ravel().tolist(),
        projectionMatrix=projection.T.ravel().tolist(), shadow=1,
        renderer=pybullet.ER_TINY_RENDERER, physicsClientId=client,
    )  # fmt: skip
    shape = (k.height_px, k.width_px)
    images = {
        "rgb": np.reshape(rgba, (*shape, 4)).astype(np.uint8)[..., 2::-1],
        "depth": (np.reshape(depth, shape) * 65535).astype(np.uint16),
        "ids": (np.reshape(ids, shape) + 1).astype(np.uint16),
    }
    for name, image in images.items():
        _, encoded = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 1])
        (folder / f"{name}.png").write_bytes(encoded.tobytes())


def main() -> None:
    """Print the figures of docs/performance.md."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--n", type=int, default=1500)
    parser.add_argument("--workers", type=int, default=2)
    arguments = parser.parse_args()

    print(f"{machine()}, {arguments.workers} workers, {arguments.n} samples")
    print(f"first sample in this process: {first_sample_s():.1f} s")
    ours_s = {}
    for views_per_scene in (5, 1):
        summary = measure_run(make_config(views_per_scene), arguments.n, arguments.workers)
        ours_s[views_per_scene] = sum(summary.cpu_s.values())
        print(f"views_per_scene {views_per_scene}: {format_summary(summary)}")
    summary = measure_run(every_effect_config(), arguments.n, arguments.workers)
    print(f"every effect, views_per_scene 5: {format_summary(summary)}")
    tiny_s = tiny_renderer_s(20)
    print(
        f"TinyRenderer, same scenes: {1e3 * tiny_s:.0f} CPU ms/sample (render, encode, write; no"
        f" physics, no annotation); ours, everything: {1e3 * ours_s[5]:.0f} CPU ms/sample"
    )


if __name__ == "__main__":
    main()
