"""Stands that hold sensors: frames in the world without a body."""

import math
from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.core import interfaces, se3
from gen_data.core.scene import Rig, Scene
from gen_data.scene_templates.element import Element


class Stand(Element):
    """An invisible rig of the same name that stands in the world, for sensors that belong together.

    Sensors with ``rig: <name>`` keep their places on it: a stereo pair, or a cluster over a table.
    The randomizer ``camera_pose`` moves it with all of them (``rig: <name>``).

    Attributes:
        position_m: Place of the rig's origin in the world; the middle of the floor is 0, 0, 0.
        yaw_deg, pitch_deg, roll_deg: Rotation from the world's X axis: to the left, then upwards,
            then clockwise as seen from behind. At -90 degrees of pitch, sensors look straight down.
    """

    type: Literal["stand"] = "stand"
    position_m: se3.Vec3 = (0.0, 0.0, 1.5)
    yaw_deg: float = Field(0.0, ge=-180, le=180)
    pitch_deg: float = Field(-90.0, ge=-90, le=90)
    roll_deg: float = Field(0.0, ge=-180, le=180)

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add the rig."""
        del assets
        angles = (math.radians(a) for a in (self.yaw_deg, self.pitch_deg, self.roll_deg))
        pose = se3.turned(self.position_m, *angles).rounded()
        return replace(scene, rigs=(*scene.rigs, Rig(self.name, "", pose)))
