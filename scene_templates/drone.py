"""Drones, which carry a camera on a gimbal."""

from dataclasses import replace
from typing import Literal

from gen_data.core import interfaces, se3
from gen_data.core.scene import Rig, Scene
from gen_data.scene_templates.element import Element, add_background

GIMBAL_BELOW_M = 0.09
"""From the optical centre of the camera up to the airframe's centre (assumed)."""


T_BODY_AIRFRAME = se3.SE3((0.0, 0.0, 0.03))
T_BODY_GIMBAL = se3.SE3((0.037, 0.0, 0.02))
"""Rigs on their bodies: the centre of the trunk, and the optical centre, before the lens."""


class Drone(Element):
    """A quadrotor with two rigs, both X forward and Z up; never labelled.

    The rig of its name is the airframe, which banks; ``<name>_gimbal`` is the optical centre of
    the camera below it, which the gimbal holds level. Sensors name one of them as ``rig``; the
    randomizer ``drone_flight`` moves both.

    Attributes:
        asset: Id of the airframe.
        at_m: Position of the airframe before it flies, world.
    """

    type: Literal["drone"] = "drone"
    asset: str = "drone?seed=0"
    at_m: se3.Vec3 = (0.0, 0.0, 50.0)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add airframe and gimbal with their rigs."""
        x, y, z = self.at_m
        rigs = {
            self.name: (self.asset, se3.SE3(self.at_m), T_BODY_AIRFRAME),
            f"{self.name}_gimbal": (
                "gimbal?seed=0",
                se3.SE3((x, y, z - GIMBAL_BELOW_M)),
                T_BODY_GIMBAL,
            ),
        }
        for name, (asset, T_world_rig, T_body_rig) in rigs.items():
            scene = add_background(scene, assets, name, asset, T_world_rig @ T_body_rig.inverse())
            scene = replace(scene, rigs=(*scene.rigs, Rig(name, name, T_body_rig)))
        return scene
