"""Jointed objects of a user: parts, joint labels, and parts that open as far as they can."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.library import Library, open_library
from gen_data.core.scene import Body, Instance, Scene
from gen_data.core.se3 import SE3
from gen_data.randomizers.object_states import ObjectStates
from gen_data.scene_templates.prop import Prop
from tests.randomizers.doubles import rng_of


def box(name: str, size: str, at: str) -> str:
    shape = f'<origin xyz="{at}"/><geometry><box size="{size}"/></geometry>'
    return f'<link name="{name}"><visual>{shape}</visual><collision>{shape}</collision></link>'


CABINET = f"""<robot name="cabinet">
{box("body", "0.4 0.6 0.8", "0 0 0")}
{box("drawer", "0.02 0.56 0.2", "0 0 0")}
{box("door", "0.02 0.56 0.4", "0 0.28 0")}
{box("knob", "0.02 0.02 0.02", "0 0 0")}
<joint name="slide" type="prismatic"><origin xyz="0.21 0 0.25"/><parent link="body"/>
<child link="drawer"/><axis xyz="1 0 0"/><limit lower="0" upper="0.3" velocity="1" effort="1"/>
</joint>
<joint name="hinge" type="revolute"><origin xyz="0.21 -0.28 -0.1"/><parent link="body"/>
<child link="door"/><axis xyz="0 0 -1"/><limit lower="0" upper="1.5707963" velocity="1" effort="1"/>
</joint>
<joint name="knob" type="revolute"><origin xyz="0.02 0 0"/><parent link="drawer"/>
<child link="knob"/><axis xyz="1 0 0"/><limit lower="0" upper="1" velocity="1" effort="1"/>
<mimic joint="hinge" multiplier="0.5"/></joint>
</robot>
"""


@pytest.fixture
def library(tmp_path: Path) -> Library:
    (tmp_path / "cabinet.urdf").write_text(CABINET)
    (tmp_path / "assets.yaml").write_text(
        "robots: [{id: cabinet, file: cabinet.urdf, category: cabinet}]\n"
    )
    return open_library([tmp_path], tmp_path / "cache", tmp_path)


def placed(library: Library) -> Scene:
    prop = Prop(name="cabinet", asset="user/cabinet", annotate=True, at_m=(1.0, 2.0), yaw_deg=90.0)
    return prop.add(Scene("test"), library)


def opened(scene: Scene, library: Library) -> tuple[dict[str, Body], dict[str, str]]:
    """Bodies by name, and attributes of the cabinet, with everything open as far as it can be."""
    states = ObjectStates.model_validate(
        {"name": "states", "is_open": {"probability": 1.0}, "opening": 1.0}
    )
    after = states(scene, library, rng_of())
    return {b.name: b for b in after.bodies}, dict(after.instances[0].attributes)


@pytest.mark.slow
def test_a_thing_is_one_instance_whose_parts_are_its_links(library: Library) -> None:
    """It stands on the floor: its body's middle is half of 0.8 m above."""
    scene = placed(library)
    (instance,) = scene.instances
    assert (instance.category, instance.parts) == ("cabinet", ("body", "drawer", "knob", "door"))
    bodies = {b.name: b for b in scene.bodies}
    assert {name: b.part_id for name, b in bodies.items()} == {
        "cabinet/body": 1, "cabinet/drawer": 2, "cabinet/knob": 3, "cabinet/door": 4,
    }  # fmt: skip
    assert bodies["cabinet/body"].T_world_body.translation_m == pytest.approx((1.0, 2.0, 0.4))
    assert bodies["cabinet/drawer"].T_world_body.translation_m == pytest.approx((1.0, 2.21, 0.65))


@pytest.mark.slow
def test_object_states_move_its_parts_and_labels_state_the_joints(library: Library) -> None:
    """The drawer slides 0.3 m along the world's Y, and the door turns by -90 degrees."""
    bodies, attributes = opened(placed(library), library)
    assert bodies["cabinet/drawer"].T_world_body.translation_m == pytest.approx((1.0, 2.51, 0.65))
    knob = bodies["cabinet/knob"].T_world_body
    assert knob.translation_m == pytest.approx((1.0, 2.53, 0.65))
    x, y, _ = bodies["cabinet/door"].T_world_body.rotate(np.array([0.0, 1.0, 0.0]))
    # At home the door's Y is -X of the world; a quarter turn about -Z makes it +Y.
    assert (x, y) == pytest.approx((0.0, 1.0), abs=1e-6)
    assert attributes == {
        "open_slide": "1",
        "joint_slide": "0.3",
        "joint_slide_type": "prismatic",
        "joint_slide_limits": "0 0.3",
        "joint_slide_axis": "1 0 0",
        "open_hinge": "1",
        "joint_hinge": "1.571",
        "joint_hinge_type": "revolute",
        "joint_hinge_limits": "0 1.571",
        "joint_hinge_axis": "0 0 -1",
        "joint_knob": f"{math.pi / 4:.4g}",
        "joint_knob_type": "revolute",
        "joint_knob_limits": "0 1",
        "joint_knob_axis": "1 0 0",
    }


@pytest.mark.slow
def test_a_drawer_opens_only_until_something_is_in_the_way(library: Library) -> None:
    """A box 0.25 m ahead of the drawer leaves room for 0.6 of its way, not for all."""
    scene = placed(library)
    at = SE3((1.0, 2.21 + 0.25 + 0.025, 0.025 + 0.4))
    thing = Instance(9, "box", "box", 0, "box?size_m=0.05,0.05,0.5")
    body = Body("box", thing.asset, at, instance_id=9)
    scene = replace(scene, bodies=(*scene.bodies, body), instances=(*scene.instances, thing))
    bodies, attributes = opened(scene, library)
    assert attributes["open_slide"] == "0.6"
    assert bodies["cabinet/drawer"].T_world_body.translation_m[1] == pytest.approx(2.21 + 0.18)
