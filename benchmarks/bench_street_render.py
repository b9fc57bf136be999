"""CPU milliseconds per rendered street frame: ``python -m benchmarks.bench_street_render``.

1242x375 as in KITTI, sun and sky; about 400 bodies and 0.7 million triangles within 100 m: 30
vehicles of 6,000 triangles, 40 people of 5,000, 30 houses of 4,000, 40 trees of 5,000, 250 poles
and signs, and a road. RGB, depth, instance, category and amodal silhouettes. The shapes stand in
for real assets of the same size: they are computed, so that the benchmark needs no files
and its scenes never change. One process, one core.
"""

import argparse
import resource
from dataclasses import dataclass
from functools import cache

import numpy as np

from benchmarks.bench_render import frame_ms, photograph, timed_launches
from gen_data.core import errors, intrinsics
from gen_data.core.asset_types import (
    Asset,
    ConvexParts,
    Float32,
    Keypoint,
    Material,
    MeshData,
    RobotModel,
    TextureData,
)
from gen_data.core.capture import Channel
from gen_data.core.scene import Body, Camera, Environment, Instance, Light, Scene
from gen_data.core.se3 import SE3, Array, Vec3, look_at
from gen_data.core.streams import Rng, Streams
from gen_data.renderers.warp.renderer import WarpRenderer

CHANNELS = frozenset(
    {Channel.RGB, Channel.Z_DEPTH, Channel.INSTANCE, Channel.CATEGORY, Channel.AMODAL}
)
KITTI = intrinsics.Intrinsics(1242, 375, 721.5, 721.5, 621.0, 187.5)
STREET_LENGTH_M = 100.0


@dataclass(frozen=True)
class Kind:
    """One kind of object in the street.

    Attributes:
        shapes: Number of different meshes.
        rows_m: Distances of its rows from the middle of the street.
        squareness: 1 is an ellipsoid, towards 0 a box.
    """

    shapes: int
    count: int
    triangles: int
    size_m: Vec3
    rows_m: tuple[float, ...]
    squareness: float = 1.0
    labelled: bool = False
    textured: bool = False


KINDS = {
    "vehicle": Kind(40, 30, 6000, (4.5, 1.8, 1.5), (-4.5, -1.8, 1.8, 4.5), 0.4, labelled=True),
    "person": Kind(60, 40, 5000, (0.5, 0.6, 1.75), (-8.0, -7.0, 7.0, 8.0), 0.8, labelled=True),
    "house": Kind(40, 30, 4000, (12.0, 10.0, 14.0), (-16.0, 16.0), 0.1, textured=True),
    "tree": Kind(20, 40, 5000, (4.0, 4.0, 7.0), (-9.0, 9.0)),
    "pole": Kind(20, 250, 300, (0.15, 0.15, 4.0), (-6.0, -9.5, 6.0, 9.5), 0.5),
}


class Street:
    """An AssetLibrary that computes meshes on demand, from the kind and a number."""

    def get(self, asset_id: str) -> Asset:
        """Raise: no asset has an entry."""
        raise errors.AssetError(f"unknown asset '{asset_id}'")

    def find(self, tags: object, kind: str = "object") -> tuple[Asset, ...]:  # noqa: ARG002
        """Return nothing: no asset has tags."""
        return ()

    def materials(self, asset_id: str) -> tuple[Material, ...]:
        """Materials of the mesh, one per slot."""
        return self.mesh(asset_id).materials

    def body_bounds_m(self, asset_id: str) -> None:
        """None: there are no mirrors."""

    def bounds_m(self, asset_id: str) -> tuple[Vec3, Vec3]:
        """Bounds of the mesh."""
        return self.mesh(asset_id).bounds_m()

    def keypoints(self, asset_id: str) -> tuple[Keypoint, ...]:  # noqa: ARG002
        """Return no keypoints."""
        return ()

    def robot(self, asset_id: str) -> RobotModel:
        """Raise: there is no robot."""
        raise errors.AssetError(f"'{asset_id}' is no robot")

    def convex_parts(self, asset_id: str) -> ConvexParts:
        """One part with all vertices."""
        return ConvexParts((self.mesh(asset_id).vertices_m.astype(np.float64),))

    def mesh(self, asset_id: str) -> MeshData:
        """The mesh called ``<kind>/<number>``, or ``road``."""
        return street_mesh(asset_id)

    def texture(self, texture_id: str) -> TextureData:
        """Noise of 512 x 512 texels, with roughness and normals."""
        rng = Streams(0, 0).rng(texture_id)
        tile = np.asarray(rng.integers(60, 200, (64, 64, 3)), np.uint8).repeat(8, 0).repeat(8, 1)
        normal = np.full_like(tile, 128)
        normal[..., 2] = 255
        return TextureData(tile, tile[..., 0].copy(), normal)

    def environment(self, environment_id: str) -> Float32:  # noqa: ARG002
        """A sky that is brighter than the ground."""
        rows = np.where(np.arange(64) < 32, 1.6, 0.4).astype(np.float32)
        return np.broadcast_to(rows[:, None, None], (64, 128, 3)).copy()


@cache
def street_mesh(asset_id: str) -> MeshData:
    """See Street.mesh."""
    kind, _, number = asset_id.partition("/")
    if kind == "road":
        return road_mesh()
    if kind == "tree":
        return tree_mesh(KINDS[kind], Streams(0, 0).rng(asset_id))
    return lumpy_mesh(KINDS[kind], Streams(0, 0).rng(asset_id), int(number))


def lumpy_mesh(kind: Kind, rng: Rng, number: int) -> MeshData:
    """Lumpy superellipsoid with its materials in ten bands."""
    rows = max(int(np.sqrt(kind.triangles / 4)), 4)
    polar, azimuth = np.meshgrid(
        np.linspace(0.02, np.pi - 0.02, rows + 1),
        np.linspace(0, 2 * np.pi, 2 * rows + 1),
        indexing="ij",
    )
    unit = np.stack(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1
    )
    lumps = 1.0 + 0.03 * np.sin(rng.uniform(3, 6) * polar) * np.sin(
        int(rng.integers(2, 7)) * azimuth
    )
    shape = np.sign(unit) * np.abs(unit) ** kind.squareness * lumps[..., None]
    vertices = (0.5 * shape * np.asarray(kind.size_m)).reshape(-1, 3)
    vertices[:, 2] += 0.5 * kind.size_m[2]
    texture = f"wall/{number % 12}" if kind.textured else ""
    color = tuple(float(c) for c in rng.uniform(0.05, 0.7, 3))
    materials = tuple(
        Material(color, 0.3 + 0.05 * k, texture=texture, texture_scale_m=3.0 if texture else 0.0)
        for k in range(10)
    )
    return grid_mesh(vertices, rows, 2 * rows, materials)


def road_mesh() -> MeshData:
    """A cambered strip of 15,000 triangles, textured."""
    x, y = np.meshgrid(np.linspace(-20, 130, 251), np.linspace(12, -12, 31), indexing="ij")
    vertices = np.stack([x, y, -0.02 * np.abs(y)], axis=-1).reshape(-1, 3)
    asphalt = Material((0.3, 0.3, 0.3), 0.9, texture="asphalt", texture_scale_m=2.0)
    return grid_mesh(vertices, 250, 30, (asphalt,))


def grid_mesh(
    vertices: Array, rows: int, columns: int, materials: tuple[Material, ...]
) -> MeshData:
    """Faces and smooth normals over a grid of vertices."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    q = (i * (columns + 1) + j).reshape(-1)
    faces = np.concatenate(
        [
            np.stack([q, q + columns + 1, q + 1], axis=-1),
            np.stack([q + 1, q + columns + 1, q + columns + 2], axis=-1),
        ]
    )
    slots = np.tile((i * len(materials) // rows).reshape(-1), 2)
    return with_normals(vertices, faces, slots, materials)


def tree_mesh(kind: Kind, rng: Rng) -> MeshData:
    """Crown of leaves, each a single triangle."""
    n = kind.triangles
    way = rng.normal(size=(n, 3))
    way /= np.sqrt((way * way).sum(axis=1, keepdims=True))
    crown = way * rng.uniform(0.3, 1.0, (n, 1)) * 0.5 * np.asarray(kind.size_m)
    crown[:, 2] += 0.65 * kind.size_m[2]
    corners = crown[:, None] + rng.uniform(-0.15, 0.15, (n, 3, 3))
    faces = np.arange(3 * n).reshape(n, 3)
    leaf = Material((0.1, 0.3, 0.05), 0.8)
    return with_normals(corners.reshape(-1, 3), faces, np.zeros(n), (leaf,))


def with_normals(
    vertices: Array, faces: Array, slots: Array, materials: tuple[Material, ...]
) -> MeshData:
    """Return the mesh with its normals."""
    corners = vertices[faces]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], flat)
    normals /= np.maximum(np.sqrt((normals * normals).sum(axis=1, keepdims=True)), 1e-12)
    return MeshData(
        vertices.astype(np.float32),
        faces.astype(np.int32),
        normals.astype(np.float32),
        np.zeros((len(vertices), 2), np.float32),
        slots.astype(np.int32),
        materials,
    )


def street_scene(number: int) -> Scene:
    """Street whose assets, places and camera depend on the number."""
    rng = Streams(0, number).rng("street")
    bodies = [Body("road", "road", collides=False)]
    instances = []
    for category, (name, kind) in enumerate(sorted(KINDS.items()), 1):
        for k in range(kind.count):
            asset = f"{name}/{int(rng.integers(kind.shapes))}"
            along = STREET_LENGTH_M * (k + float(rng.uniform())) / kind.count - 5.0
            across = kind.rows_m[k % len(kind.rows_m)]
            turn = float(rng.choice([0.0, np.pi])) + float(rng.uniform(-0.05, 0.05))
            pose = SE3((along, across, 0.0), (np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)))
            instance_id = len(instances) + 1 if kind.labelled else 0
            if kind.labelled:
                instances.append(Instance(instance_id, f"{name}/{k}", name, category, asset))
            bodies.append(Body(f"{name}/{k}", asset, pose, instance_id=instance_id))
    eye = (float(rng.uniform(-2, 2)), 0.0, 1.65)
    camera = Camera("front", look_at(eye, (eye[0] + 20.0, 0.0, 1.6)), KITTI)
    sun = Light("sun", "sun", direction=(0.48, 0.6, -0.64), illuminance_lux=80_000.0)
    return Scene(
        template="street",
        bodies=tuple(bodies),
        instances=tuple(instances),
        lights=(sun,),
        environment=Environment("sky", 4000.0),
        cameras=(camera,),
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()

    library = Street()
    scenes = [street_scene(k) for k in range(arguments.scenes)]
    for scene in scenes:
        for body in scene.bodies:
            library.mesh(body.asset)
    triangles = sum(len(library.mesh(body.asset).faces) for body in scenes[0].bodies)
    print(f"{len(scenes[0].bodies)} bodies, {triangles / 1e6:.2f} million triangles")
    renderer = WarpRenderer(library, "cpu")
    photograph(renderer, scenes[0], CHANNELS)
    for label in ("first time", "again"):
        spent_ms = [frame_ms(renderer, [scene], CHANNELS, 1)[0] for scene in scenes[1:]]
        print(f"CPU ms per frame, {label}: {', '.join(f'{ms:.0f}' for ms in spent_ms)}")
    best = frame_ms(renderer, scenes[:1], CHANNELS, arguments.repeats)
    print(f"CPU ms per frame, one scene, best: {best[0]:.0f}")
    with timed_launches() as by_kernel:
        frame_ms(renderer, scenes[:1], CHANNELS, 1)
    for kernel, ms in sorted(by_kernel.items(), key=lambda item: -item[1]):
        print(f"    {kernel:<24} {ms:6.1f} CPU ms")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"peak memory {peak:.0f} MB, the benchmark's own meshes included")


if __name__ == "__main__":
    main()
