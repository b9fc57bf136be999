"""Scenes of the comparison with other renderers: ten objects on a ground.

In the workload ``fine`` each has 12,012 triangles, and every view has its own scene. In ``small``
five have 480 triangles and five are primitives, and five views share a scene, which is typical for
renderers of physics engines. All data is computed here from formulas: the workload is the same on
every machine.
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
FINE_RINGS, SMALL_RINGS = 78, 16
"""Of an object's surface, and as many sectors: 2 * 78 * 77 = 12,012, and 2 * 16 * 15 = 480
triangles."""
VIEWS_PER_SCENE = {"fine": 1, "small": 5}
"""Names of the workloads."""
GROUND_SIDE_M = 2.4

CONFIG = """\
views_per_scene: {views_per_scene}
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


Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices [m], float [n, 3], and triangles, int [m, 3], counter-clockwise outward."""


def object_mesh(number: int, rings: int = FINE_RINGS) -> Mesh:
    """One of the objects: a superquadric with bumps, 18 to 38 cm long.

    Source of the formula: Barr, "Superquadrics and Angle-Preserving Transformations", 1981.
    """
    sectors = rings
    latitude = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)[1:-1, None]
    longitude = np.linspace(-np.pi, np.pi, sectors, endpoint=False)[None, :]
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
    index = np.arange((rings - 1) * sectors).reshape(rings - 1, sectors)
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


def ground_mesh() -> Mesh:
    """A slab, 2 cm high."""
    return prism_mesh(4, (GROUND_SIDE_M, GROUND_SIDE_M, 0.02))


def prism_mesh(sides: int, size_m: tuple[float, float, float], taper: float = 1.0) -> Mesh:
    """A prism about Z, a frustum if ``taper`` is not 1; of 4 sides, a box.

    Args:
        sides: Corners of the base, the first between +X and +Y; even.
        size_m: Lengths of the box around the base, and the height.
        taper: Size of the top divided by the size of the base.
    """
    angle = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    ring *= np.array(size_m[:2]) / np.ptp(ring, axis=0)
    low, high = (
        np.column_stack([share * ring, np.full(sides, z)])
        for share, z in ((1.0, -0.5 * size_m[2]), (taper, 0.5 * size_m[2]))
    )
    # Every side has separate vertices: renderers smooth shared ones.
    walls = np.stack([low, np.roll(low, -1, 0), np.roll(high, -1, 0), high], axis=1)
    corner = 4 * np.arange(sides)[:, None]
    fan = np.arange(1, sides - 1)[:, None]
    faces = [
        *(corner + np.array(three) for three in ((0, 1, 2), (0, 2, 3))),
        4 * sides + fan[:, [0, 0, 0]] * [0, 1, 1] + [0, 1, 0],
        5 * sides + fan[:, [0, 0, 0]] * [0, 1, 1] + [0, 0, 1],
    ]
    return np.concatenate([walls.reshape(-1, 3), low, high]), np.concatenate(faces)


def object_meshes(workload: str) -> list[Mesh]:
    """The objects of a workload."""
    if workload == "fine":
        return [object_mesh(k) for k in range(OBJECTS)]
    return [
        *(object_mesh(k, SMALL_RINGS) for k in range(0, OBJECTS, 2)),
        prism_mesh(4, (0.2, 0.14, 0.1)),
        prism_mesh(4, (0.12, 0.12, 0.24)),
        prism_mesh(24, (0.14, 0.14, 0.2)),
        prism_mesh(24, (0.18, 0.18, 0.16), taper=0.3),
        prism_mesh(6, (0.2, 0.2, 0.12)),
    ]


def write_assets(folder: Path, workload: str) -> None:
    """Write the ground and the objects as OBJ files, each in the folder of its category."""
    things = {f"thing{k}": mesh for k, mesh in enumerate(object_meshes(workload))}
    for name, (vertices_m, faces) in {"ground": ground_mesh(), **things}.items():
        lines = [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in vertices_m]
        lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
        path = folder / name / f"{name}.obj"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines) + "\n")


def write_config(folder: Path, workload: str, *, full: bool) -> None:
    """Write the workload's configuration, with every label and COCO if ``full``."""
    names = [f"thing{k}" for k in range(OBJECTS)]
    elements = [
        f"  - {{type: objects, name: {n}, on: ground, count: 1, assets: {{ids: [user/{n}/{n}]}}}}"
        for n in names
    ]
    text = CONFIG.format(
        folder=folder / ASSETS_NAME,
        views_per_scene=VIEWS_PER_SCENE[workload],
        elements="\n".join(elements),
        randomizers="\n".join(f"  - {{type: objects, name: {n}, count: 1}}" for n in names),
        annotations=", ".join(FULL_LABELS if full else ()),
        exporters="{type: coco}" if full else "",
    )
    _config_path(folder, full=full).write_text(text)


def read_config(folder: Path, *, full: bool) -> Config:
    """The configuration that ``prepare`` has written."""
    return load_config(str(_config_path(folder, full=full)), seed=1)


def _config_path(folder: Path, *, full: bool) -> Path:
    return folder / f"workload_{'full' if full else 'plain'}.yaml"


ASSETS_NAME, VIEWS_NAME = "assets", "views.pickle"
"""Folder of the meshes, and file of the settled views, with the sensors that read them."""
Views = list[tuple[DrawnView, tuple[Sensor, ...]]]


def prepare(folder: Path, count: int, workload: str) -> None:
    """Draw and settle ``count`` views; write them for this renderer, and as worlds for others."""
    write_assets(folder / ASSETS_NAME, workload)
    for full in (False, True):
        write_config(folder, workload, full=full)
    views: Views = []
    with PipelineFactory(read_config(folder, full=False), count)() as pipeline:
        for k in range(count):
            scene, view = divmod(k, VIEWS_PER_SCENE[workload])
            accepted = pipeline.accepted_scene(scene)
            views.append((pipeline.drawn_view(accepted, view), tuple(accepted.sensors)))
    (folder / VIEWS_NAME).write_bytes(pickle.dumps(views))
    worlds = [describe_world(view.scene, folder / ASSETS_NAME) for view, _ in views]
    write_worlds(worlds, folder)


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
