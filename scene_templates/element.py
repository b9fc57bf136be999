"""Base classes of elements, and functions that add bodies and surfaces to a Scene."""

import math
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from pydantic import Field

from gen_data.assets.asset_ids import AssetId, ParameterValue
from gen_data.config.base_model import NAME_PATTERN, Strict
from gen_data.core import errors, interfaces, members
from gen_data.core.scene import Body, Instance, Scene, SupportSurface
from gen_data.core.se3 import SE3, Vec3


class Element(Strict):
    """One element of a template.

    Attributes:
        name: Name for other elements, randomizers and labels; unique in the template.
        present: Whether the scene contains it; with ``switch``, districts have their own roads and
            groups. Randomizers leave an absent group alone.
    """

    related: ClassVar[tuple[str, ...]] = ()
    """Fields that name other elements; may be empty texts."""

    name: str = Field(pattern=NAME_PATTERN)
    present: bool = True

    @property
    def follows_others(self) -> bool:
        """Whether it is added after all elements for which this is False."""
        return False

    @property
    def relations(self) -> Mapping[str, str]:
        """Names of the elements that it needs, by the field that names them; no empty names.

        A field may name a part of an element, such as ``cross/0``.
        """
        names: dict[str, str] = {field: getattr(self, field) for field in self.related}
        return {field: name.partition("/")[0] for field, name in names.items() if name}

    def leave_out(self, scene: Scene) -> Scene:
        """Return the scene of an absent element: unchanged, or with its group of no objects."""
        return scene

    @abstractmethod
    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Return the scene with this element at its nominal pose. Draws nothing.

        Raises:
            ConfigError: a relation names an unknown element, or is impossible.
        """


class PlacedElement(Element):
    """An element with a pose.

    Attributes:
        on: Name of the supporting surface or element; empty = the floor.
        at_m: Position on the support (x, y), from its centre; an optional third number is the
            height above it.
        yaw_deg: Rotation about the vertical.
    """

    related: ClassVar[tuple[str, ...]] = ("on",)

    on: str = ""
    at_m: tuple[float, float] | tuple[float, float, float] = (0.0, 0.0)
    yaw_deg: float = 0.0

    def pose(self, scene: Scene) -> SE3:
        """``T_world_element``: origin on the support, Z up."""
        local = level_pose(self.at_m, self.yaw_deg)
        if not self.on:
            return local
        return find_surfaces(scene, self.on, f"elements.{self.name}.on")[0].T_world_surface @ local

    def add_surface(
        self, scene: Scene, height_m: float, size_m: tuple[float, float], **fields: Any
    ) -> Scene:
        """Add a level surface at a height above the element's origin.

        Args:
            scene: Scene with the element's body, which has its name.
            height_m: Height.
            size_m: Extent along the element's X and Y.
            fields: Further fields of ``SupportSurface``.
        """
        pose = (self.pose(scene) @ SE3((0.0, 0.0, height_m))).rounded()
        own = {"name": self.name, "body": self.name, "T_world_surface": pose, "size_m": size_m}
        return replace(scene, surfaces=(*scene.surfaces, SupportSurface(**{**own, **fields})))


def level_pose(at_m: tuple[float, float] | tuple[float, float, float], yaw_deg: float) -> SE3:
    """Pose with Z up at a position, whose height defaults to 0, rotated about the vertical."""
    x, y, *height = at_m
    return SE3.about_z(math.radians(yaw_deg), (x, y, height[0] if height else 0.0))


def find_surfaces(scene: Scene, name: str, field: str) -> tuple[SupportSurface, ...]:
    """Find the surface of a name, or all surfaces of the element of that name.

    Raises:
        ConfigError: there is none.
    """
    found = tuple(s for s in scene.surfaces if name in (s.name, s.body))
    if not found:
        known = sorted({s.name for s in scene.surfaces} | {s.body for s in scene.surfaces})
        listed = ", ".join(known) or "none: list the surface before the elements on it"
        raise errors.ConfigError(
            f"{field}: there is no surface '{name}'; expected one of {listed}"
            f"{errors.did_you_mean(name, known)}"
        )
    return found


def parametric_id(family: str, **parameters: ParameterValue) -> str:
    """Canonical id of a parametric asset."""
    return str(AssetId(family, parameters))


def next_instance_id(scene: Scene) -> int:
    """Smallest free instance id."""
    return members.free_instance_ids(scene, 1)[0]


def add_background(
    scene: Scene, assets: interfaces.AssetIndex, name: str, asset: str, T_world_body: SE3
) -> Scene:
    """Add a static body without an instance, such as walls and ground."""
    assets.get(asset)
    return replace(scene, bodies=(*scene.bodies, Body(name, asset, T_world_body.rounded())))


def add_static(
    scene: Scene,
    assets: interfaces.AssetIndex,
    name: str,
    asset: str,
    T_world_body: SE3,
    *,
    annotated: bool = False,
) -> Scene:
    """Add a static body, and the instance that labels it."""
    number = next_instance_id(scene)
    body = Body(name, asset, T_world_body.rounded(), instance_id=number)
    category = assets.get(asset).category
    instance = Instance(number, name, category, 0, asset, annotated=annotated)
    return replace(scene, bodies=(*scene.bodies, body), instances=(*scene.instances, instance))


def stand_upright(assets: interfaces.AssetIndex, asset: str, T_world_stand: SE3) -> SE3:
    """``T_world_body`` of an upright asset whose lowest point is at a pose's origin."""
    low, _ = assets.bounds_m(asset)
    return T_world_stand @ SE3((0.0, 0.0, -low[2]))


def extent_m(assets: interfaces.AssetIndex, asset: str) -> Vec3:
    """Size of an asset's bounding box along its own axes [m]."""
    low, high = assets.bounds_m(asset)
    return (high[0] - low[0], high[1] - low[1], high[2] - low[2])
