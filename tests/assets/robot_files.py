"""Files of robots: a mesh for them, and the poses of their links by the joints that were read."""

from gen_data.assets.robot_description import RobotDescription
from gen_data.core.kinematics import joint_transform
from gen_data.core.se3 import SE3

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def poses_at(described: RobotDescription, **positions: float) -> dict[str, SE3]:
    """``T_root_link`` at joint positions; 0 unless given."""
    poses = {next(iter(described.links)): SE3()}
    for joint in described.joints:
        pose = poses[joint.parent] @ joint.T_parent_joint
        position = positions.get(joint.name, 0.0)
        poses[joint.child] = pose @ joint_transform(joint, position) if joint.movable else pose
    return poses
