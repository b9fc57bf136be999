"""Motion of objects."""

from dataclasses import replace
from typing import ClassVar, Literal

from gen_data.config.base_model import Strict
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import MotionTruth, ObjectTruth
from gen_data.core.scene import Scene
from gen_data.core.scene_time import ego_rig


class Motion(Strict):
    """Velocity, acceleration and angular velocity along the world's, camera's and ego's axes.

    They are relative to the ground, not to a moving camera. The track id of an object is its
    instance id.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["motion"] = "motion"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``motion``."""
        twist = truth.instance.twist
        rig = ego_rig(scene)
        motion = MotionTruth(
            world=twist,
            camera=twist.seen_along(reading.camera.T_world_camera),
            ego=twist.seen_along(scene.rig_pose(rig.name)) if rig is not None else None,
        )
        return replace(truth, motion=motion)
