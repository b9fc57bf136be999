"""Ego vehicles, which carry the sensors."""

from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core import errors, interfaces, lane_geometry
from gen_data.core.scene import Body, Instance, Rig, Scene
from gen_data.scene_templates.element import Element, next_instance_id
from gen_data.traffic.axles import find_axles

CATEGORY = "ego"
"""Category of its pixels; no data set lists it: they have no category id."""


class Ego(Element):
    """A vehicle that carries a sensor rig of the same name; never labelled.

    The rig's origin is on the ground below the middle of the rear axle, X forward, Z up, as in
    nuScenes (Caesar et al. 2020).

    Attributes:
        asset: Id of the asset; empty = the first asset with all of ``tags``.
        tags: Tags of the asset if ``asset`` is empty.
        lane: Name of the lane in the middle of which it stands; empty = the first driving lane.
    """

    related: ClassVar[tuple[str, ...]] = ("lane",)

    type: Literal["ego"] = "ego"
    asset: str = ""
    tags: tuple[str, ...] = Field(("car",), min_length=1)
    lane: str = ""

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the vehicle and its rig."""
        asset = self.asset or self._find_asset(assets)
        lanes = [lane for lane in scene.lanes if lane.name == self.lane or not self.lane]
        lanes = [lane for lane in lanes if lane.kind == "driving" and not lane.junction]
        if not lanes:
            wanted = f"driving lane '{self.lane}'" if self.lane else "driving lane"
            raise errors.ConfigError(
                f"elements.{self.name}.lane: there is no {wanted}; list the road before it"
            )
        line = lane_geometry.LaneLine(lanes[0])
        T_body_rig = find_axles(assets, asset, 1.0).T_body_rear
        place = line.pose(0.5 * line.length_m)
        instance_id = next_instance_id(scene)
        pose = (place @ T_body_rig.inverse()).rounded()
        body = Body(self.name, asset, pose, instance_id=instance_id, collides=False)
        instance = Instance(instance_id, self.name, CATEGORY, 0, asset, annotated=False)
        return replace(
            scene,
            bodies=(*scene.bodies, body),
            instances=(*scene.instances, instance),
            rigs=(*scene.rigs, Rig(self.name, self.name, T_body_rig)),
        )

    def _find_asset(self, assets: interfaces.AssetIndex) -> str:
        found = assets.find(self.tags)
        if not found:
            raise errors.ConfigError(
                f"elements.{self.name}.tags: no asset is tagged {', '.join(self.tags)}"
            )
        return found[0].asset_id
