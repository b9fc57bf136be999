"""A furnished room's shell."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.assets.asset_ids import ParameterValue
from gen_data.config.base_model import NAME_PATTERN
from gen_data.core import interfaces, se3
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import Element, add_background, parametric_id

CLEARANCE_M = 0.15
"""Smallest distance of cameras and lights from the walls."""


class Room(Element):
    """Floor, ceiling and four walls around the origin; cameras and lights stay inside.

    Attributes:
        size_m: Length, width and height of the inside.
        door, window: Whether the room has a door and a window.
        walls: Whether it has walls and a ceiling; a floor alone is a terrace under the environment.
    """

    type: Literal["room"] = "room"
    size_m: tuple[float, float, float] = (5.0, 4.0, 2.8)
    door: bool = True
    window: bool = True
    walls: bool = True
    name: str = Field("room", pattern=NAME_PATTERN)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the room as background, without an instance."""
        x, y, z = self.size_m
        shape: dict[str, ParameterValue] = {
            "size_m": self.size_m,
            "door": int(self.door),
            "window": int(self.window),
        }
        # Left out where it is the default: rooms keep their ids.
        if not self.walls:
            shape["walls"] = 0
        asset = parametric_id("room", **shape)
        scene = add_background(scene, assets, self.name, asset, se3.SE3())
        inside = (
            (-x / 2 + CLEARANCE_M, -y / 2 + CLEARANCE_M, CLEARANCE_M),
            (x / 2 - CLEARANCE_M, y / 2 - CLEARANCE_M, z - CLEARANCE_M),
        )
        return replace(scene, interior_m=inside)
