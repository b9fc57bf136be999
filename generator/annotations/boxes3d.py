"""Oriented 3D boxes."""

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

from gen_data.config.base_model import Strict
from gen_data.core import boxes, interfaces, se3
from gen_data.core.capture import Channel, SensorReading
from gen_data.core.sample import EgoTruth, ObjectTruth
from gen_data.core.scene import Scene


class Boxes3d(Strict):
    """Tight boxes of instances along their own axes, in the world and in sensors' frames.

    By default they leave out the exterior mirrors of vehicles; see ``labels.box3d``.
    """

    channels: ClassVar[frozenset[Channel]] = frozenset({Channel.INSTANCE})
    type: Literal["boxes3d"] = "boxes3d"

    def annotate(self, scene: Scene, reading: SensorReading, truth: ObjectTruth) -> ObjectTruth:
        """Fill in ``box3d_world`` and ``box3d_camera``."""
        box_world = truth.instance.box3d
        T_camera_world = reading.camera.T_world_camera.inverse()
        return replace(
            truth, box3d_world=box_world, box3d_camera=box_world.seen_from(T_camera_world)
        )

    def annotate_frame(
        self, scenes: Mapping[str, Scene], assets: interfaces.AssetLibrary, truth: EgoTruth
    ) -> EgoTruth:
        """Fill in ``boxes3d``: in the ego's frame, and in every laser scanner's at its instant."""
        del assets
        frames = {"ego": annotate_boxes(scenes[""], truth.T_world_ego)} if truth.rig else {}
        for name in sorted(scenes.keys() - {""}):
            frames[name] = annotate_boxes(scenes[name], scenes[name].lidar(name).T_world_lidar)
        return replace(truth, boxes3d=frames)


def annotate_boxes(scene: Scene, T_world_frame: se3.SE3) -> dict[int, boxes.OrientedBox]:
    """The boxes of all annotated instances in a frame, by instance id."""
    T_frame_world = T_world_frame.inverse()
    instances = sorted((i for i in scene.instances if i.annotated), key=lambda i: i.instance_id)
    return {i.instance_id: i.box3d.seen_from(T_frame_world) for i in instances}
