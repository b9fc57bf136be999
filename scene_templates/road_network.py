"""Roads from an OpenDRIVE file."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from gen_data.generator.core.errors import ConfigError
from gen_data.generator.core.interfaces import AssetIndex
from gen_data.generator.core.scene import Lane, Scene
from gen_data.generator.core.se3 import SE3
from gen_data.generator.roads.lane_graph import world_points
from gen_data.scene_templates.element import PlacedElement
from gen_data.scene_templates.road import add_street


class RoadNetwork(PlacedElement):
    """The roads of an ``.xodr`` file in one of the user's asset folders, around ``at_m``.

    Attributes:
        asset: Its id: ``user/town`` for ``town.xodr``.
    """

    type: Literal["road_network"] = "road_network"
    asset: str

    def add(self, scene: Scene, assets: AssetIndex) -> Scene:
        """The roads are background; their lanes are named ``<name>/<road>.<section>.<lane>``."""
        lanes = assets.lanes(self.asset)
        if not lanes:
            raise ConfigError(
                f"elements.{self.name}.asset: '{self.asset}' has no lanes; expected an .xodr file"
            )
        pose = self.pose(scene)
        placed = tuple(self._placed(lane, pose) for lane in lanes)
        return add_street(scene, assets, self.name, self.asset, pose, placed)

    def _placed(self, lane: Lane, pose: SE3) -> Lane:
        """The lane in the world, under this element's name."""

        def named(name: str) -> str:
            return f"{self.name}/{name}" if name else ""

        return replace(
            lane,
            name=named(lane.name),
            center_m=world_points(np.array(lane.center_m), pose),
            road=named(lane.road),
            successors=tuple(named(name) for name in lane.successors),
            left=named(lane.left),
            right=named(lane.right),
        )
