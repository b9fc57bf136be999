"""A small library of procedural test assets: boxes, spheres, planes, checkers."""

import math
from collections.abc import Iterable

import numpy as np

from gen_data.core import asset_types, errors, scene, se3
from gen_data.core.intrinsics import Intrinsics


def box_mesh(
    size_m: se3.Vec3 = (1.0, 1.0, 1.0),
    materials: tuple[asset_types.Material, ...] = (asset_types.Material(),),
) -> asset_types.MeshData:
    corners, normals, uvs, faces = [], [], [], []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            first = len(corners)
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                p = np.zeros(3)
                p[axis], p[a], p[b] = sign, s, t
                corners.append(0.5 * p * np.asarray(size_m))
                n = np.zeros(3)
                n[axis] = sign
                normals.append(n)
                uvs.append(((s + 1) / 2, (t + 1) / 2))
            quad = [(0, 1, 2), (0, 2, 3)] if sign > 0 else [(0, 2, 1), (0, 3, 2)]
            faces += [[first + i for i in f] for f in quad]
    return _mesh(corners, faces, normals, uvs, materials)


def room_mesh(
    size_m: se3.Vec3 = (6.0, 6.0, 3.0),
    materials: tuple[asset_types.Material, ...] = (asset_types.Material(),),
) -> asset_types.MeshData:
    """A box seen from inside, floor at z = 0."""
    box = box_mesh(size_m, materials)
    vertices = box.vertices_m + np.array([0, 0, 0.5 * size_m[2]], np.float32)
    return asset_types.MeshData(
        vertices, box.faces[:, ::-1].copy(), -box.normals, box.uvs, box.face_slots, materials
    )


def sphere_mesh(
    radius_m: float = 0.5,
    rings: int = 32,
    materials: tuple[asset_types.Material, ...] = (asset_types.Material(),),
) -> asset_types.MeshData:
    polar = np.linspace(0.0, np.pi, rings + 1)
    azimuth = np.linspace(0.0, 2 * np.pi, 2 * rings + 1)
    p, a = np.meshgrid(polar, azimuth, indexing="ij")
    unit = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1)
    uvs = np.stack([a / (2 * np.pi), 1 - p / np.pi], axis=-1)
    columns = 2 * rings + 1
    faces = []
    for i in range(rings):
        for j in range(2 * rings):
            q = i * columns + j
            if i > 0:
                faces.append((q, q + columns, q + 1))
            if i < rings - 1:
                faces.append((q + 1, q + columns, q + columns + 1))
    unit = unit.reshape(-1, 3)
    return _mesh(unit * radius_m, faces, unit, uvs.reshape(-1, 2), materials)


def plane_mesh(
    size_m: float = 10.0, materials: tuple[asset_types.Material, ...] = (asset_types.Material(),)
) -> asset_types.MeshData:
    h = 0.5 * size_m
    corners = [(-h, -h, 0), (h, -h, 0), (h, h, 0), (-h, h, 0)]
    uvs = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return _mesh(corners, [(0, 1, 2), (0, 2, 3)], [(0, 0, 1)] * 4, uvs, materials)


def _mesh(vertices, faces, normals, uvs, materials) -> asset_types.MeshData:  # noqa: ANN001
    return asset_types.MeshData(
        np.asarray(vertices, np.float32),
        np.asarray(faces, np.int32),
        np.asarray(normals, np.float32),
        np.asarray(uvs, np.float32),
        np.zeros(len(faces), np.int32),
        materials,
    )


def ground(material: asset_types.Material | None = None) -> "FakeLibrary":
    """A plane of 20 m, matte by default, and a box of 1 m."""
    return FakeLibrary({"plane": plane_mesh(20.0, (material or MATTE,)), "box": box_mesh()})


def scattered_pose(rng: np.random.Generator, low_m: se3.Vec3, high_m: se3.Vec3) -> se3.SE3:
    """Any rotation, at any place in a box."""
    q = rng.normal(size=4)
    w, x, y, z = (float(v) for v in q / np.linalg.norm(q))
    place = tuple(float(v) for v in rng.uniform(low_m, high_m))
    return se3.SE3(place, (w, x, y, z))


def uniform_sky(height: int = 16) -> asset_types.Float32:
    return np.ones((height, 2 * height, 3), np.float32)


class FakeLibrary:
    """An AssetLibrary over dictionaries handed in by a test."""

    def __init__(
        self,
        meshes: dict[str, asset_types.MeshData],
        textures: dict[str, asset_types.TextureData] | None = None,
        environments: dict[str, asset_types.Float32] | None = None,
    ) -> None:
        self.meshes = meshes
        self.textures = textures or {}
        self.environments = {"environment/neutral?seed=0": uniform_sky(), **(environments or {})}

    def get(self, asset_id: str) -> asset_types.Asset:
        raise errors.AssetError(f"unknown asset '{asset_id}'")

    def find(self, tags: Iterable[str], kind: str = "object") -> tuple[asset_types.Asset, ...]:
        return ()

    def variants(self, family: str) -> tuple[asset_types.Asset, ...]:
        return ()

    def materials(self, asset_id: str) -> tuple[asset_types.Material, ...]:
        return self.meshes[asset_id].materials

    def body_bounds_m(self, asset_id: str) -> None:
        """None: there are no mirrors."""

    def bounds_m(self, asset_id: str) -> tuple[se3.Vec3, se3.Vec3]:
        return self.meshes[asset_id].bounds_m()

    def vertices_m(self, asset_id: str) -> asset_types.Float32:
        return self.meshes[asset_id].vertices_m

    def keypoints(self, asset_id: str) -> tuple[asset_types.Keypoint, ...]:
        return ()

    def robot(self, asset_id: str) -> asset_types.RobotModel:
        raise errors.AssetError(f"'{asset_id}' is no robot")

    def mesh(self, asset_id: str) -> asset_types.MeshData:
        return self.meshes[asset_id]

    def convex_parts(self, asset_id: str) -> asset_types.ConvexParts:
        return asset_types.ConvexParts((self.meshes[asset_id].vertices_m.astype(np.float64),))

    def texture(self, texture_id: str) -> asset_types.TextureData:
        return self.textures[texture_id]

    def environment(self, environment_id: str) -> asset_types.Float32:
        return self.environments[environment_id]


def camera_at(
    eye_m: se3.Vec3,
    target_m: se3.Vec3,
    size_px: tuple[int, int] = (64, 48),
    hfov_deg: float = 60.0,
    ev100: float | None = None,
) -> scene.Camera:
    intrinsics = Intrinsics.from_hfov(*size_px, math.radians(hfov_deg))
    return scene.Camera("camera", se3.look_at(eye_m, target_m), intrinsics, ev100)


def forward_camera(size_px: tuple[int, int] = (64, 48), focal_px: float = 50.0) -> scene.Camera:
    """A camera at the origin whose frame is the world's: X right, Y down, Z forward."""
    width_px, height_px = size_px
    intrinsics = Intrinsics(
        width_px, height_px, focal_px, focal_px, 0.5 * width_px, 0.5 * height_px
    )
    return scene.Camera("camera", se3.SE3(), intrinsics)


DARK = scene.Environment(luminance_cd_m2=0.0, visible=False)
MATTE = asset_types.Material(base_color=(0.5, 0.5, 0.5), roughness=1.0, specular=0.0)
