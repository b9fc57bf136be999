"""Which links of a robot may touch."""

from gen_data.assets.folder_index import RobotEntry
from gen_data.assets.robot_description import Link, RobotDescription
from gen_data.assets.robot_models import robot_model
from gen_data.core.asset_types import Joint
from gen_data.core.se3 import SE3


def test_a_shell_fixed_to_a_link_may_touch_the_next_link_wherever_it_is_listed() -> None:
    """The shell of the upper arm is listed after the forearm that turns against it."""

    def joint(name: str, kind: str, parent: str, child: str) -> Joint:
        return Joint(name, kind, parent, child, SE3(), (0.0, 0.0, 1.0), -1.0, 1.0)  # type: ignore[arg-type]

    links = {name: Link(name, (), ()) for name in ("base", "upper", "fore", "hand", "shell")}
    joints = (joint("shoulder", "revolute", "base", "upper"),
              joint("elbow", "revolute", "upper", "fore"),
              joint("wrist", "revolute", "fore", "hand"),
              joint("screws", "fixed", "upper", "shell"))  # fmt: skip
    entry = RobotEntry(id="arm", file="arm.urdf")

    allowed = robot_model("arm", RobotDescription(links, joints), entry, "arm.urdf").no_collide

    assert {("fore", "shell"), ("shell", "fore")} & allowed
    assert not {("hand", "shell"), ("shell", "hand")} & allowed
