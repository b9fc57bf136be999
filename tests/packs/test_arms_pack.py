"""The arms pack: COLLADA and URDF of example-robot-data become robots with fingers."""

import math
import os
from pathlib import Path

import numpy as np
import pytest

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import open_pipeline
from gen_data.assets.library import Library, open_library
from gen_data.content.packs import example_robot_data
from gen_data.core.asset_types import RobotModel
from gen_data.core.errors import AssetError
from gen_data.core.kinematics import link_poses
from gen_data.core.se3 import SE3
from tests.people.bodies import VARIABLE

PACKS = Path(os.environ.get(VARIABLE, "missing"), "packs")
NEEDS_ARMS = pytest.mark.skipif(
    not (PACKS / "arms").is_dir(), reason=f"{VARIABLE} names no folder with the arms pack"
)
ROOT = "cmeel.prefix/share/example-robot-data/robots/ur_description"
DH = {
    "ur3": (0.1519, -0.24365, -0.21325, 0.11235, 0.08535, 0.0819),
    "ur5": (0.089159, -0.425, -0.39225, 0.10915, 0.09465, 0.0823),
    "ur10": (0.1273, -0.612, -0.5723, 0.163941, 0.1157, 0.0922),
}
"""d1, a2, a3, d4, d5, d6 [m]: Universal Robots, "DH Parameters for calculations of kinematics and
dynamics", CB series. The angles alpha are pi/2, 0, 0, pi/2, -pi/2, 0."""

INPUT = '<input semantic="VERTEX" source="#v" offset="0"/>'
TRIANGLES = f'<triangles count="1" material="blue">{INPUT}<p>0 1 2</p></triangles>'
POLYGONS = f"""<polylist count="1" material="grey">{INPUT}<vcount>4</vcount>
  <p>0 1 3 2</p></polylist>"""
STRAY = f'<lines count="1">{INPUT}<p>0 3</p></lines>'
MATERIAL = """<material id="{0}"><instance_effect url="#{0}-fx"/></material>"""
EFFECT = """<effect id="{0}-fx"><profile_COMMON><technique sid="c"><phong><diffuse>
  <color>{1}</color></diffuse></phong></technique></profile_COMMON></effect>"""
COLORS = {"blue": "0.1 0.2 0.4 1", "grey": "0.5 0.5 0.5 1"}
DAE = f"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects>{"".join(EFFECT.format(*item) for item in COLORS.items())}</library_effects>
<library_materials>{"".join(MATERIAL.format(name) for name in COLORS)}</library_materials>
<library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="p-a" count="12">0 0 0 1 0 0 0 2 0 1 2 0.5</float_array>
    <technique_common><accessor source="#p-a" count="4" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common>
  </source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  {TRIANGLES}{POLYGONS}{STRAY}</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><matrix>1 0 0 0 0 1 0 0 0 0 1 3 0 0 0 1</matrix>
  <instance_geometry url="#g"><bind_material><technique_common>
    {"".join(f'<instance_material symbol="{name}" target="#{name}"/>' for name in COLORS)}
  </technique_common></bind_material></instance_geometry></node></visual_scene>
</library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""
URDF = """<robot name="mini"><link name="base_link"><visual><geometry>
    <mesh filename="package://example-robot-data/robots/ur_description/meshes/mini/base.dae"/>
  </geometry></visual></link>
  <link name="wrist"/><link name="ee_link"><collision><geometry><box size="1 1 1"/></geometry>
  </collision></link><link name="tool0"/>
  <joint name="turn" type="revolute"><parent link="base_link"/><child link="wrist"/>
    <origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint>
  <joint name="e" type="fixed"><parent link="wrist"/><child link="ee_link"/></joint>
  <joint name="t" type="fixed"><parent link="wrist"/><child link="tool0"/>
    <origin rpy="-1.57079632679 0 0" xyz="0 0.1 0"/></joint></robot>"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    mini = example_robot_data.Arm("mini", {"turn": 0.5}, 0.2)
    monkeypatch.setattr(example_robot_data, "ARMS", (mini,))
    for name, text in (("urdf/mini_robot.urdf", URDF), ("meshes/mini/base.dae", DAE)):
        path = tmp_path / ROOT / name
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.slow
def test_an_arm_gets_its_meshes_and_fingers(package: Path, tmp_path: Path) -> None:
    """Three triangles where their node is, linear colours, and no marker at the flange."""
    folder = tmp_path / "packs" / "arms"
    folder.mkdir(parents=True)
    example_robot_data.convert(package, folder)
    library = open_library(cache_dir=tmp_path / "cache", packs=tmp_path / "packs")
    robot = library.robot("arms/mini")
    mesh = library.mesh("arms/mini/base_link")
    assert len(mesh.faces) == 3
    assert library.bounds_m("arms/mini/base_link") == (
        pytest.approx((0.0, 0.0, 3.0), abs=1e-6),
        pytest.approx((1.0, 2.0, 3.5), abs=1e-6),
    )
    colors = sorted(material.base_color for material in mesh.materials)
    assert colors == [
        pytest.approx((0.1, 0.2, 0.4), abs=1e-3),
        pytest.approx((0.5, 0.5, 0.5), abs=1e-3),
    ]
    assert robot.gripper is not None and robot.gripper.cup is None
    assert robot.workspace_from_m == 0.2
    assert robot.home[0] == 0.5
    assert "ee_link" not in robot.links
    # The tool's Z is the flange's, which a quarter turn about -X leads from Z to Y.
    out = link_poses(robot, SE3(), (0.0, 0.0, 0.0))["tool"].rotate(np.array([0.0, 0.0, 1.0]))
    assert out == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)


def test_a_broken_mesh_is_refused_by_its_file(package: Path, tmp_path: Path) -> None:
    (package / ROOT / "meshes/mini/base.dae").write_text(DAE.replace("#v", "#w"), encoding="utf-8")
    (tmp_path / "out").mkdir()
    with pytest.raises(AssetError, match=r"base\.dae: malformed COLLADA"):
        example_robot_data.convert(package, tmp_path / "out")


def flange_by_dh(name: str, positions: tuple[float, ...]) -> np.ndarray:
    """Pose of the flange by Denavit and Hartenberg's convention, 4 x 4."""
    d1, a2, a3, d4, d5, d6 = DH[name]
    lengths = ((d1, 0.0), (0.0, a2), (0.0, a3), (d4, 0.0), (d5, 0.0), (d6, 0.0))
    quarter = 0.5 * math.pi
    pose = np.eye(4)
    for q, (d, a), alpha in zip(
        positions, lengths, (quarter, 0.0, 0.0, quarter, -quarter, 0.0), strict=True
    ):
        c, s, ca, sa = math.cos(q), math.sin(q), math.cos(alpha), math.sin(alpha)
        pose = pose @ np.array(
            [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
        )
    return pose


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> Library:
    return open_library(cache_dir=tmp_path_factory.mktemp("cache"), packs=PACKS)


@NEEDS_ARMS
@pytest.mark.parametrize("name", sorted(DH))
def test_flanges_are_where_their_maker_says(arms: Library, name: str) -> None:
    """The controller's base is turned by half a turn against the description's."""
    robot: RobotModel = arms.robot(f"arms/{name}")
    rng = np.random.default_rng(1)
    for _ in range(20):
        q = tuple(float(v) for v in rng.uniform(-math.pi, math.pi, 6))
        poses = link_poses(robot, SE3(), (*q, 0.0, 0.0))
        found = (poses["base"].inverse() @ poses["tool0"]).matrix()
        assert np.allclose(found, flange_by_dh(name, q), atol=1e-6)


@NEEDS_ARMS
@pytest.mark.parametrize("name", sorted(DH))
def test_hands_look_down_at_home_ahead_of_the_base(arms: Library, name: str) -> None:
    """Within a degree, and less than 3 cm from the middle."""
    robot = arms.robot(f"arms/{name}")
    assert robot.gripper is not None
    pose = link_poses(robot, SE3(), robot.home)[robot.gripper.link] @ robot.gripper.T_link_grasp
    x, y, z = pose.translation_m
    assert robot.workspace_from_m < x < 0.6
    assert abs(y) < 0.03
    assert z > 0.2
    assert pose.rotate(np.array([0.0, 0.0, -1.0]))[2] > math.cos(math.radians(1.0))


@NEEDS_ARMS
@pytest.mark.parametrize("name", sorted(DH))
def test_arms_of_the_pack_open_drawers(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the shipped configuration, with fingers around the handle; physics confirms it."""
    monkeypatch.setenv("GEN_DATA_ASSETS", str(PACKS.parent))
    changes = (f"shared.robot=arms/{name}", "shared.task=open_drawer")
    with open_pipeline(load_config("arm_tasks.yaml", overrides=changes)) as pipeline:
        (arm,) = pipeline.accepted_scene(0).scene.articulations
    assert arm.asset == f"arms/{name}"
    assert arm.episode is not None
    assert arm.episode.succeeded
    assert any("tool_left_finger + things/1" in span.label for span in arm.episode.contacts)
