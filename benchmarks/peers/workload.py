"""Scenes of the comparison with other renderers: ten objects of 12,000 triangles on a ground.

Everything is made here, from formulas, so that the workload is the same wherever it runs.
"""

import pickle
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.worlds import Lamp, World, write_worlds
from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.interfaces import Sensor
from gen_data.core.scene import Scene
from gen_data.pipeline.pipeline import DrawnView

OBJECTS = 10
RINGS, SECTORS = 78, 78
"""Of every object's surface: 2 * 78 * 77 = 12,012 triangles."""
GROUND_SIDE_M = 2.4

CONFIG = """\
views_per_scene: 1
assets: {{folders: [{folder}]}}
elements:
  - {{type: surface, name: ground, asset: user/ground/ground}}
{elements}
randomizers:
{randomizers}
  - type: lighting
    name: lamps
    count: 2
    kind: sphere
    illuminance_lux: {{uniform: [500, 1500]}}
    distance_m: {{uniform: [2.0, 3.5]}}
    radius_m: {{uniform: [0.1, 0.2]}}
  - type: camera_pose
    name: orbit
    distance_m: {{uniform: [1.6, 2.2]}}
    elevation_deg: {{uniform: [30, 65]}}
sensors:
  - type: rgb_camera
    name: color
    size_px: [640, 480]
    hfov_deg: 50
    channels: [rgb, depth, instance]
annotations: [{annotations}]
exporters: [{exporters}]
"""
FULL_LABELS = ("boxes2d", "boxes3d", "instance_masks", "amodal_masks", "poses", "visibility")


def object_mesh(number: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """One of the objects: a superquadric with bumps, 18 to 38 cm long.

    Returns:
        Vertices [m], float [n, 3], and triangles, int [12012, 3], counter-clockwise outward.

    Source of the formula: Barr, "Superquadrics and Angle-Preserving Transformations", 1981.
    """
    latitude = np.linspace(-np.pi / 2, np.pi / 2, RINGS + 1)[1:-1, None]
    longitude = np.linspace(-np.pi, np.pi, SECTORS, endpoint=False)[None, :]
    squareness = 0.4 + 0.15 * (number % 5)
    radius_m = np.array([0.13, 0.11, 0.15]) * (0.8 + 0.05 * number)
    bumps = 1 + 0.04 * np.sin((3 + number) * longitude) * np.cos(latitude) * np.cos(4 * latitude)

    def power(value: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.sign(value) * np.abs(value) ** squareness

    rows = np.stack(
        np.broadcast_arrays(
            power(np.cos(latitude)) * power(np.cos(longitude)) * bumps,
            power(np.cos(latitude)) * power(np.sin(longitude)) * bumps,
            power(np.sin(latitude)) * bumps,
        ),
        axis=-1,
    )
    poles = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    vertices_m = np.concatenate([rows.reshape(-1, 3), poles]) * radius_m
    index = np.arange((RINGS - 1) * SECTORS).reshape(RINGS - 1, SECTORS)
    right = np.roll(index, -1, axis=1)
    south, north = len(vertices_m) - 2, len(vertices_m) - 1
    a, b, c, d = index[:-1], right[:-1], right[1:], index[1:]
    faces = [
        np.stack([a, b, c], axis=-1),
        np.stack([a, c, d], axis=-1),
        np.stack([np.full_like(index[0], south), right[0], index[0]], axis=-1),
        np.stack([np.full_like(index[0], north), index[-1], right[-1]], axis=-1),
    ]
    return vertices_m, np.concatenate([part.reshape(-1, 3) for part in faces])


def ground_mesh() -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A slab, 2 cm high: vertices [m] and triangles."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    vertices_m = corners * [GROUND_SIDE_M / 2, GROUND_SIDE_M / 2, 0.01]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    first = 4 * np.arange(6)[:, None]  # every side has vertices of its own: renderers smooth others
    faces = np.concatenate([first + np.array(corner) for corner in ((0, 1, 2), (0, 2, 3))])
    return vertices_m[np.ravel(quads)], faces


def write_assets(folder: Path) -> None:
    """Write the ground and the objects as OBJ files, each in the folder of its category."""
    meshes = {"ground": ground_mesh()} | {f"thing{k}": object_mesh(k) for k in range(OBJECTS)}
    for name, (vertices_m, faces) in meshes.items():
        lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in vertices_m]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
        path = folder / name / f"{name}.obj"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines) + "\n")


def make_config(assets: Path, folder: Path, *, full: bool) -> Config:
    """The workload's configuration, with every label and COCO if ``full``."""
    names = [f"thing{k}" for k in range(OBJECTS)]
    elements = [
        f"  - {{type: objects, name: {n}, on: ground, count: 1, assets: {{ids: [user/{n}/{n}]}}}}"
        for n in names
    ]
    text = CONFIG.format(
        folder=assets,
        elements="\n".join(elements),
        randomizers="\n".join(f"  - {{type: objects, name: {n}, count: 1}}" for n in names),
        annotations=", ".join(FULL_LABELS if full else ()),
        exporters="{type: coco}" if full else "",
    )
    path = folder / f"workload_{'full' if full else 'plain'}.yaml"
    path.write_text(text)
    return load_config(str(path), seed=1)


VIEWS_NAME = "views.pickle"
"""File of the settled views, with the sensors that read them."""
Views = list[tuple[DrawnView, tuple[Sensor, ...]]]


def prepare(folder: Path, count: int) -> None:
    """Draw and settle ``count`` scenes; write them for this renderer, and as worlds for others."""
    assets = folder / "assets"
    write_assets(assets)
    views: Views = []
    with PipelineFactory(make_config(assets, folder, full=False), count)() as pipeline:
        for k in range(count):
            accepted = pipeline.accepted_scene(k)
            views.append((pipeline.drawn_view(accepted, 0), tuple(accepted.sensors)))
    (folder / VIEWS_NAME).write_bytes(pickle.dumps(views))
    write_worlds([describe_world(view.scene, assets) for view, _ in views], folder)


def describe_world(scene: Scene, assets: Path) -> World:
    """The scene without anything of this project."""
    (camera,) = scene.cameras
    names = [body.asset.rpartition("/")[2] for body in scene.bodies]
    lens = camera.intrinsics
    return World(
        meshes=tuple(str(assets / name / f"{name}.obj") for name in names),
        T_world_bodies=tuple(body.T_world_body.matrix().tolist() for body in scene.bodies),
        ids=tuple(body.instance_id for body in scene.bodies),
        lamps=tuple(
            Lamp(lamp.position_m, lamp.radius_m, tuple(lamp.intensity_cd * c for c in lamp.color))
            for lamp in scene.lights
        ),
        T_world_camera=camera.T_world_camera.matrix().tolist(),
        size_px=(lens.width_px, lens.height_px),
        focal_px=lens.fx_px,
    )
