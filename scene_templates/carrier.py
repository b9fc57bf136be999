"""Carriers of sensors in rooms: the base of a robot, or a hand."""

from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.core import interfaces, se3
from gen_data.core.scene import Body, Instance, Rig, Scene
from gen_data.scene_templates.element import Element, next_instance_id

CATEGORY = "ego"
"""Category of its pixels; no data set lists it: they have no category id."""


class Carrier(Element):
    """A body that carries a rig, whose origin is on the floor below it, whatever its height_m.

    The ``offset_m`` of sensors counts from there: 1.7 m up is ``offset_m: [0, 0, 1.7]``. X is
    forward, Z up. The rig has the element's name; the body is never labelled, and the randomizer
    ``room_path`` moves it. For sensors without a body, such as a pair over a table: ``stand``.

    Attributes:
        asset: Id of the asset, whose front is +X.
        height_m: Height of the body's lowest point above the floor: 0 for a robot's base. It does
            not move the rig.
    """

    type: Literal["carrier"] = "carrier"
    asset: str = "pedestal?size_m=0.36,0.36,0.16"
    height_m: float = Field(0.0, ge=0, le=2.5)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the body at the origin, and its rig."""
        low, _ = assets.bounds_m(self.asset)
        instance_id = next_instance_id(scene)
        pose = se3.SE3((0.0, 0.0, self.height_m - low[2])).rounded()
        body = Body(self.name, self.asset, pose, instance_id=instance_id, collides=False)
        instance = Instance(instance_id, self.name, CATEGORY, 0, self.asset, annotated=False)
        return replace(
            scene,
            bodies=(*scene.bodies, body),
            instances=(*scene.instances, instance),
            rigs=(*scene.rigs, Rig(self.name, self.name, pose.inverse())),
        )
