"""Power lines across the land."""

import math
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.assets.families import declared
from gen_data.core import errors, interfaces, se3
from gen_data.core.scene import Scene
from gen_data.scene_templates.element import Element, add_static, parametric_id

CLEAR_M = 20.0
"""Distance between a pylon's middle and the edge of any lane (assumed)."""
_STEP_M = 15.0


class PowerLine(Element):
    """A straight line of pylons with conductors; unlabelled.

    Pylons keep clear of all lanes: the whole line moves along itself until they do.

    Attributes:
        at_m: Position of its middle (x, y).
        yaw_deg: Direction of the line; 0 = world +X.
        span_m: Distance between pylons.
        count: Number of pylons.
        seed: Seed of the pylons' design.
    """

    type: Literal["power_line"] = "power_line"
    at_m: tuple[float, float] = (0.0, 120.0)
    yaw_deg: float = 0.0
    span_m: float = Field(280.0, ge=60, le=declared("power_pylon", "span_max_m"))
    count: int = Field(4, ge=1, le=20)
    seed: int = Field(0, ge=0, le=1_000_000)

    @property
    def follows_others(self) -> bool:
        """True: it keeps clear of every road."""
        return True

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the pylons. Raises ConfigError if there is no place for them."""
        yaw = math.radians(self.yaw_deg)
        asset = parametric_id("power_pylon", seed=self.seed % 4, span_m=self.span_m)
        for number, (x, y) in enumerate(self._places(scene).tolist()):
            pose = se3.SE3.about_z(yaw, (x, y, -0.1))
            scene = add_static(scene, assets, f"{self.name}/{number}", asset, pose)
        return scene

    def _places(self, scene: Scene) -> se3.Array:
        """Feet of the pylons [n, 2], all of them clear of lanes."""
        yaw = math.radians(self.yaw_deg)
        along = np.array([math.cos(yaw), math.sin(yaw)])
        offsets = (np.arange(self.count) - 0.5 * (self.count - 1)) * self.span_m
        feet: se3.Array = np.array(self.at_m) + offsets[:, None] * along
        borders = [
            (np.array(lane.center_m)[:, :2], 0.5 * lane.width_m + CLEAR_M) for lane in scene.lanes
        ]
        for shift in np.arange(0.0, self.span_m, _STEP_M):
            moved: se3.Array = feet + shift * along
            if all(
                np.hypot(*(moved[:, None] - line[None]).transpose(2, 0, 1)).min() > reach
                for line, reach in borders
            ):
                return moved
        raise errors.ConfigError(
            f"elements.{self.name}.at_m: pylons would stand on a lane wherever the line begins; "
            "expected another at_m or yaw_deg"
        )
