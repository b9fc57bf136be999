"""Robot arms."""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gen_data.core import asset_types, interfaces, kinematics, scene_time, se3
from gen_data.core.scene import Articulation, Instance, Rig, Scene
from gen_data.scene_templates.element import PlacedElement, find_surfaces, next_instance_id

CATEGORY = "robot_arm"


class Robot(PlacedElement):
    """A robot arm at its home pose; randomizers move it.

    Its wrist is a rig for sensors, ``<name>_wrist``: X points out of the hand, Y along the opening
    direction of the fingers.

    Attributes:
        asset: franka_panda, kuka_iiwa, xarm6, or the id of a robot in a pack or an asset folder;
            of several, the first that is installed.
        reach_m: Largest horizontal distance of the hand's goals from the base, along each axis.
        annotate: Whether to write labels for it.
    """

    type: Literal["robot"] = "robot"
    asset: str | Annotated[tuple[str, ...], Field(min_length=1)] = "franka_panda"
    reach_m: float = Field(0.75, gt=0)
    annotate: bool = True

    def add(self, scene: Scene, assets: interfaces.AssetIndex) -> Scene:
        """Add an articulation, one instance, and a body per visible link."""
        asset = self._find_installed(assets)
        robot = assets.robot(asset)
        T_world_base = self.pose(scene).rounded()
        instance_id = next_instance_id(scene)
        parts = tuple(link for link in robot.links if link in robot.visuals)
        instance = Instance(instance_id, self.name, CATEGORY, 0, asset, annotated=self.annotate)
        instance = replace(instance, parts=parts, T_world_instance=T_world_base)
        articulation = Articulation(
            name=self.name,
            asset=asset,
            instance_id=instance_id,
            T_world_base=T_world_base,
            joint_positions=robot.home,
            workspace_m=self._workspace_m(scene, T_world_base),
        )
        return replace(
            scene,
            instances=(*scene.instances, instance),
            articulations=(*scene.articulations, articulation),
            bodies=(*scene.bodies, *kinematics.make_link_bodies(articulation, robot, parts)),
            rigs=(*scene.rigs, make_wrist_rig(scene_time.wrist_name(self.name), self.name, robot)),
        )

    def _find_installed(self, assets: interfaces.AssetIndex) -> str:
        """Find its first installed asset; if there is none, the first that needs no pack.

        The error text then is about that one; ids of packs have a slash. A name that its installed
        pack does not have is a mistake, whatever comes after it.

        Raises:
            AssetError: there is such a name.
        """
        wanted = (self.asset,) if isinstance(self.asset, str) else self.asset
        known = {asset.asset_id for asset in assets.find((), kind="robot")}
        installed = {name.rpartition("/")[0] for name in known}
        for name in wanted:
            if name not in known and name.rpartition("/")[0] in installed:
                assets.robot(name)
        without_pack = [name for name in wanted if "/" not in name]
        return next((name for name in wanted if name in known), [*without_pack, wanted[0]][0])

    def _workspace_m(self, scene: Scene, T_world_base: se3.SE3) -> tuple[se3.Vec3, se3.Vec3]:
        """Space for the hand's goals: above the supporting surface, within reach."""
        x, y, z = T_world_base.translation_m
        low, high = [x - self.reach_m, y - self.reach_m], [x + self.reach_m, y + self.reach_m]
        if self.on:
            surface = find_surfaces(scene, self.on, f"elements.{self.name}.on")[0]
            half_x, half_y = (0.5 * size for size in surface.size_m)
            corners = [[sx * half_x, sy * half_y, 0.0] for sx in (-1, 1) for sy in (-1, 1)]
            around = surface.T_world_surface.apply(np.array(corners))
            low = [max(low[k], float(around[:, k].min())) for k in (0, 1)]
            high = [min(high[k], float(around[:, k].max())) for k in (0, 1)]
        low, high = [round(v, 6) for v in low], [round(v, 6) for v in high]
        return (low[0], low[1], z + 0.10), (high[0], high[1], z + 0.50)


def make_wrist_rig(name: str, arm: str, robot: asset_types.RobotModel) -> Rig:
    """Make the rig on a robot's hand, or on its last link if it has no gripper."""
    fixed = [link for link in robot.links if link not in kinematics.finger_links(robot)]
    hand, turn = fixed[-1], se3.SE3().quaternion_wxyz
    if robot.gripper is not None:
        hand, turn = robot.gripper.link, robot.gripper.T_link_grasp.quaternion_wxyz
    # The hand may be a mere frame: the last visible link before it carries the rig.
    with_it = [k for k in fixed if k in robot.visuals and k in kinematics.rigid_group(robot, hand)]
    visible = with_it or [k for k in fixed if k in robot.visuals]
    carrier = hand if hand in visible else visible[-1]
    poses = kinematics.link_poses(robot, se3.SE3(), robot.home)
    T_carrier_hand = poses[carrier].inverse() @ poses[hand]
    T_hand_rig = se3.SE3((0.0, 0.0, 0.0), turn) @ scene_time.HAND_RIG_AXES
    return Rig(name, f"{arm}/{carrier}", (T_carrier_hand @ T_hand_rig).rounded())
