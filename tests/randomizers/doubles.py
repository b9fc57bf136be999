"""Fake asset library with the sizes, tags and materials that the tests define."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from gen_data.assets.asset_ids import parse_asset_id
from gen_data.core.asset_types import (
    Asset,
    AssetFacts,
    Float32,
    Gripper,
    Joint,
    Keypoint,
    Material,
    RobotModel,
)
from gen_data.core.errors import AssetError, did_you_mean
from gen_data.core.plates import Plate, upright_pose
from gen_data.core.scene import Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.core.streams import Rng, Streams

FURNITURE_M: dict[str, tuple[float, ...]] = {
    "table": (1.2, 0.8, 0.74), "shelf": (0.9, 0.32, 1.6), "bin": (0.6, 0.4, 0.22),
    "box": (0.2, 0.2, 0.2), "room": (5.0, 4.0, 2.8), "gantry": (1.6, 1.0, 1.8),
    "pedestal": (0.3, 0.3, 0.7), "plane": (4.0, 4.0, 0.0), "light_panel": (0.6, 0.6),
    "backdrop": (3.0, 3.0, 2.2), "street_lamp": (0.4, 0.4, 6.0), "walker": (0.5, 0.5, 1.7),
}  # fmt: skip
SLOTS = {"room": 7, "table": 2, "shelf": 2}


@dataclass(frozen=True)
class Thing:
    """Properties of a fake object.

    Attributes:
        size_m: Its bounding box, around its origin.
    """

    category: str
    size_m: Vec3
    tags: tuple[str, ...] = ("household",)
    mass_kg: float = 0.2
    stackable: bool = False
    materials: tuple[Material, ...] = (Material(),)


PRINTED = Material(texture="texture/label?seed=1", printed=True)
LENSES = tuple(Material(role=f"lens_{color}") for color in ("red", "yellow", "green"))
WAGON = tuple(
    Material(role=role)
    for role in (
        "paint", "glass", "tyre", "headlight", "taillight", "brakelight", "indicator_left",
        "indicator_right",
    )
)  # fmt: skip
THINGS = {
    "brick": Thing("brick", (0.06, 0.03, 0.02), stackable=True),
    "can?seed=0": Thing("can", (0.066, 0.066, 0.12), stackable=True, materials=(PRINTED,)),
    "can?seed=1": Thing("can", (0.07, 0.07, 0.10), stackable=True, materials=(PRINTED, Material())),
    "bottle": Thing("bottle", (0.08, 0.08, 0.26)),
    "ball": Thing("ball", (0.2, 0.2, 0.2), ("household", "toy")),
    "bolt": Thing("bolt", (0.02, 0.02, 0.05), ("part",), 0.05),
    "nut": Thing("nut", (0.03, 0.03, 0.015), ("part",), 0.02, stackable=True),
    "signal": Thing("traffic_light", (0.3, 0.3, 3.0), ("street_furniture",), materials=LENSES),
    "wagon": Thing("car", (4.4, 1.8, 1.5), ("vehicle",), 1300.0, materials=WAGON),
    "odd": Thing("odd", (0.05, 0.07, 0.09), ("random_shape",)),
}
TEXTURES = {
    f"texture/{name}?seed={k}": tags
    for name, tags in (
        ("concrete", ("floor", "wall", "stone")),
        ("plaster", ("wall",)),
        ("wood_planks", ("floor", "wood")),
        ("wood_grain", ("wood",)),
    )
    for k in range(3)
}
ENVIRONMENTS = {
    f"environment/{name}?seed={k}": (name, tag)
    for name, tag in (("neutral", "indoor"), ("studio", "indoor"), ("sky", "outdoor"))
    for k in range(2)
}


PLATES = tuple(f"plate/{k}" for k in range(64))
PLATE = Plate(
    (640, 480), 500.0, upright_pose(np.array([0.0, -1.0, 0.0]), 1.5),
    ((100.0, 470.0), (540.0, 470.0), (400.0, 300.0), (240.0, 300.0)),
)  # fmt: skip
"""All photographs show the same; the number is in the colour of the ground."""


class FakeAssets:
    """An AssetIndex without files; the id of a piece of furniture gives its size."""

    def get(self, asset_id: str) -> Asset:
        if asset_id in THINGS:
            thing = THINGS[asset_id]
            return _asset(
                asset_id, "object", thing.category, thing.tags, thing.mass_kg, thing.stackable
            )
        if asset_id in TEXTURES:
            return _asset(asset_id, "texture", "", TEXTURES[asset_id])
        if asset_id in ENVIRONMENTS:
            return _asset(asset_id, "environment", "", ENVIRONMENTS[asset_id])
        if asset_id in PLATES:
            return _asset(asset_id, "plate", "", ("rendered",))
        family = parse_asset_id(asset_id).name
        if family == "walker":
            walks = AssetFacts(attributes=(("pose", "walk"),))
            return replace(_asset(asset_id, "object", "person", ()), facts=lambda: walks)
        if family in FURNITURE_M:
            return _asset(asset_id, "object", family, ("furniture",))
        if family == "two_link":
            return _asset(asset_id, "robot", "robot", ("arm",))
        if family.startswith("two_link/"):
            return _asset(asset_id, "object", "robot", ())
        raise AssetError(f"unknown asset '{asset_id}'{did_you_mean(asset_id, THINGS)}")

    def find(self, tags: Iterable[str], kind: str = "object") -> tuple[Asset, ...]:
        wanted = set(tags)
        if kind == "plate":
            return tuple(self.get(plate) for plate in PLATES if wanted <= {"rendered"})
        every = (self.get(i) for i in sorted([*THINGS, *TEXTURES, *ENVIRONMENTS, "two_link"]))
        return tuple(a for a in every if a.kind == kind and wanted <= set(a.tags))

    def variants(self, family: str) -> tuple[Asset, ...]:
        return tuple(a for a in self.find(()) if a.asset_id.partition("?")[0] == family)

    def materials(self, asset_id: str) -> tuple[Material, ...]:
        """Materials of an object; plain ones for furniture and links."""
        if asset_id in THINGS:
            return THINGS[asset_id].materials
        return (Material(),) * SLOTS.get(parse_asset_id(asset_id).name, 1)

    def body_bounds_m(self, asset_id: str) -> tuple[Vec3, Vec3] | None:
        """None: there are no mirrors."""

    def bounds_m(self, asset_id: str) -> tuple[Vec3, Vec3]:
        """Bounds: centred at the origin for objects, above it for furniture."""
        if asset_id in THINGS:
            x, y, z = THINGS[asset_id].size_m
            return (-x / 2, -y / 2, -z / 2), (x / 2, y / 2, z / 2)
        wanted = parse_asset_id(asset_id)
        if wanted.name.startswith("two_link/"):
            return (-0.05, -0.05, 0.0), (0.05, 0.05, 0.3)
        self.get(asset_id)
        given = wanted.parameters.get("size_m", FURNITURE_M.get(wanted.name))
        assert isinstance(given, tuple)
        x, y, *height = (float(v) for v in given)
        return (-x / 2, -y / 2, 0.0), (x / 2, y / 2, height[0] if height else 0.0)

    def vertices_m(self, asset_id: str) -> Float32:
        """Corners of the bounds, and the middles of their faces."""
        low, high = np.array(self.bounds_m(asset_id), np.float32)
        steps = np.array(list(product((0.0, 0.5, 1.0), repeat=3)), np.float32)
        return low + (high - low) * steps

    def keypoints(self, asset_id: str) -> tuple[Keypoint, ...]:
        """A street lamp has its lamp at the top, a wagon its headlights in front."""
        if asset_id == "wagon":
            return (
                Keypoint("headlight_left", (2.2, 0.7, -0.1)),
                Keypoint("headlight_right", (2.2, -0.7, -0.1)),
            )
        return (Keypoint("lamp", (1.5, 0.0, 6.0)),) if asset_id == "street_lamp" else ()

    def plate(self, asset_id: str) -> Plate:
        """A level view of a street from 1.5 m."""
        grey = round(0.1 + 0.01 * PLATES.index(asset_id), 4)
        return replace(PLATE, ground_color=(grey, grey, grey))

    def robot(self, asset_id: str) -> RobotModel:
        """An arm of two links with a parallel gripper that opens 8 cm."""
        if asset_id != "two_link":
            raise AssetError(f"'{asset_id}' is no robot{did_you_mean(asset_id, ['two_link'])}")
        return two_link_arm()


def two_link_arm() -> RobotModel:
    """Shoulder and elbow about Y, 0.3 m apart, then a hand with two sliding fingers."""
    up = SE3((0.0, 0.0, 0.3))
    y_axis, fingers = (0.0, 1.0, 0.0), ("left", "right")
    joints = (
        Joint("shoulder", "revolute", "base", "upper", up, y_axis, -2.0, 2.0),
        Joint("elbow", "revolute", "upper", "hand", up, y_axis, -2.5, 2.5),
        *(
            Joint(f"{side}_slide", "prismatic", "hand", side, up, (0.0, sign, 0.0), 0.0, 0.04)
            for side, sign in zip(fingers, (1.0, -1.0), strict=True)
        ),
    )
    links = ("base", "upper", "hand", *fingers)
    meshes = {link: f"two_link/{link}" for link in links}
    return RobotModel(
        links=links,
        joints=joints,
        visuals=meshes,
        collisions=meshes,
        home=(0.4, 0.9, 0.04, 0.04),
        gripper=Gripper("hand", SE3((0.0, 0.0, 0.35)), ("left_slide", "right_slide"), 0.08),
        no_collide=frozenset(),
    )


def rng_of(name: str = "test", scene: int = 0, index: int = 0) -> Rng:
    return Streams(seed=7, scene=scene, index=index).rng(name)


def surface_scene(
    size_m: tuple[float, float] = (1.2, 0.8),
    *,
    assets: tuple[str, ...] = ("bottle", "brick", "can?seed=0", "can?seed=1"),
    placement: str = "drop",
    clearance_m: float = 1.5,
    keep_out: tuple[Vec3, ...] = (),
    levels: int = 1,
) -> Scene:
    """An empty group ``clutter`` on surfaces above each other, the lowest 1 m over the floor."""
    surfaces = tuple(
        SupportSurface(f"s{k}", "s", SE3((0.2, -0.1, 1.0 + k * clearance_m)), size_m, clearance_m)
        for k in range(levels)
    )
    group = ObjectGroup(
        "clutter",
        tuple(s.name for s in surfaces),
        assets,
        0,
        placement,  # type: ignore[arg-type]
        keep_out=keep_out,
    )
    return Scene("test", surfaces=surfaces, groups=(group,))


def _asset(
    asset_id: str,
    kind: str,
    category: str,
    tags: tuple[str, ...],
    mass_kg: float = 0.0,
    stackable: bool = False,
) -> Asset:
    return Asset(
        asset_id,
        kind,  # type: ignore[arg-type]
        category,
        tuple(sorted(tags)),
        licence="CC0-1.0",
        author="test",
        source="test",
        sha256="0" * 64,
        mass_kg=mass_kg,
        stackable=stackable,
    )


def box_of(body: Body) -> tuple[Array, Array, Array]:
    """Centre [m], axes (columns) and half extents [m] of a body's box in the world."""
    low, high = (np.array(corner) * body.scale for corner in FakeAssets().bounds_m(body.asset))
    center = body.T_world_body.apply(0.5 * (low + high))
    return center, body.T_world_body.rotation(), 0.5 * (high - low)


def corners_of(body: Body) -> Array:
    center, axes, half = box_of(body)
    signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    corners: Array = center + (signs * half) @ axes.T
    return corners


def overlap_m(one: Body, other: Body) -> float:
    """Penetration depth of two boxes [m]; negative if they are apart.

    Separating axes of two oriented boxes: Gottschalk, Lin and Manocha, "OBBTree", 1996.
    """
    (c1, a1, h1), (c2, a2, h2) = box_of(one), box_of(other)
    crossed = [np.cross(a1[:, i], a2[:, j]) for i in range(3) for j in range(3)]
    axes = [*a1.T, *a2.T, *(v / np.linalg.norm(v) for v in crossed if np.linalg.norm(v) > 1e-9)]
    return min(
        float(np.abs(a1.T @ n) @ h1 + np.abs(a2.T @ n) @ h2 - abs(n @ (c2 - c1))) for n in axes
    )


def deepest_overlap_m(bodies: Sequence[Body]) -> float:
    pairs = combinations(bodies, 2)
    return max((overlap_m(one, other) for one, other in pairs), default=-np.inf)
