"""Oriented boxes in space."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

from generator.core.boxes import OrientedBox
from generator.core.capture import Channel, Reading
from generator.core.sample import ObjectTruth
from generator.core.scene import Instance, Scene
from generator.core.se3 import SE3


@dataclass(frozen=True, slots=True)
class Boxes3d:
    """The instance's tight box along its own axes, in the world frame and in the camera frame."""

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})

    def annotate(self, scene: Scene, reading: Reading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``box3d_world`` and ``box3d_camera``."""
        box_world = oriented_box(truth.instance)
        T_camera_world = reading.camera.T_world_camera.inverse()
        return replace(
            truth, box3d_world=box_world, box3d_camera=box_world.seen_from(T_camera_world)
        )


def oriented_box(instance: Instance) -> OrientedBox:
    """The box around an instance in the world; its frame is the instance's, moved to the centre."""
    (x0, y0, z0), (x1, y1, z1) = instance.box_min_m, instance.box_max_m
    T_instance_box = SE3((0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1)))
    return OrientedBox(instance.T_world_instance @ T_instance_box, (x1 - x0, y1 - y0, z1 - z0))
