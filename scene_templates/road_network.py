"""Roads from an OpenDRIVE file."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetIndex
from gen_data.core.scene import Lane, Scene
from gen_data.core.se3 import SE3
from gen_data.roads.lane_graph import world_points
from gen_data.scene_templates.element import PlacedElement
from gen_data.scene_templates.road import add_street


class RoadNetwork(PlacedElement):
    """The roads of an ``.xodr`` file in one of the user's asset folders, around ``at_m``.

    Attributes:
        asset: Id of the asset: ``user/town`` for ``town.xodr``.
    """

    type: Literal["road_network"] = "road_network"
    asset: str = Field(examples=["user/town"])

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """Add the roads as background, with lanes named ``<name>/<road>.<section>.<lane>``."""
        lanes = assets.lanes(self.asset)
        if not lanes:
            raise ConfigError(
                f"elements.{self.name}.asset: '{self.asset}' has no lanes; expected an .xodr file"
            )
        pose = self.pose(scene)
        placed = tuple(self._place_lane(lane, pose) for lane in lanes)
        return add_street(scene, assets, self.name, self.asset, pose, placed)

    def _place_lane(self, lane: Lane, pose: SE3) -> Lane:
        """Return the lane in the world, with names below this element's."""

        def qualify(name: str) -> str:
            return f"{self.name}/{name}" if name else ""

        return replace(
            lane,
            name=qualify(lane.name),
            center_m=world_points(np.array(lane.center_m), pose),
            road=qualify(lane.road),
            successors=tuple(qualify(name) for name in lane.successors),
            left=qualify(lane.left),
            right=qualify(lane.right),
        )
