"""MJCF files: bodies, joints, geoms, materials and constraints as MuJoCo itself has them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from gen_data.assets.asset_folder import Folder
from gen_data.assets.checking import check_folder
from gen_data.assets.library import open_library
from gen_data.assets.mjcf import read_mjcf
from gen_data.core.errors import AssetError
from tests.assets.robot_files import TETRAHEDRON, poses_at

ARM = """<mujoco model="arm">
<compiler angle="degree" meshdir="parts" texturedir="images"/>
<default>
  <default class="visual"><geom contype="0" conaffinity="0" group="2"/></default>
  <default class="collision"><geom group="3"/></default>
</default>
<asset>
  <mesh name="wedge" file="wedge.obj" scale="0.5 0.5 0.5" refpos="0.2 0.1 0" refquat="1 0 0 1"/>
  <texture name="wood" type="2d" file="wood.png"/>
  <material name="wood" texture="wood" rgba="1 1 1 1" roughness="0.25" metallic="0.5"/>
  <material name="glass" rgba="0 1 0 0.4"/>
</asset>
<worldbody>
  <geom name="floor" type="plane" size="5 5 0.1"/>
  <body name="base" pos="0 0 0.1" euler="0 0 90">
    <geom class="visual" type="mesh" mesh="wedge" pos="0.1 0 0" euler="0 30 0" material="wood"/>
    <geom class="collision" type="box" size="0.1 0.2 0.3"/>
    <body name="upper" pos="0 0.2 0.4">
      <joint name="swing" axis="0 1 0" range="-90 45" pos="0.05 0 0.1" ref="20"/>
      <joint name="lift" type="slide" axis="0 0 2" range="-0.1 0.3"/>
      <geom class="visual" type="capsule" fromto="0 0 0 0 0 0.4" size="0.05" material="glass"/>
      <geom class="collision" type="cylinder" size="0.05 0.2"/>
      <frame pos="0 0 0.4" euler="90 0 0"><body name="hand">
        <joint name="spin" axis="1 0 0" limited="false"/>
        <geom type="ellipsoid" size="0.03 0.04 0.05" material="glass" rgba="0.1 0.2 0.3 0.9"/>
        <site name="tip" pos="0 0 0.1"/>
      </body></frame>
    </body>
  </body>
</worldbody>
</mujoco>"""


def write(folder: Path, text: str = ARM) -> Folder:
    for name in ("parts", "images"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "parts/wedge.obj").write_text(TETRAHEDRON)
    Image.new("RGB", (4, 4), (0, 0, 255)).save(folder / "images/wood.png")
    (folder / "arm.xml").write_text(text)
    return Folder(folder)


@pytest.mark.parametrize("positions", [(0.0, 0.0, 0.0), (0.3, -0.05, 1.2), (-1.5, 0.3, -3.0)])
def test_geoms_are_where_mujoco_has(tmp_path: Path, positions: tuple[float, float, float]) -> None:
    """At any joint positions, with anchors off the origin, a reference and two joints a body."""
    described = read_mjcf(write(tmp_path), "arm.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(model)
    names = ("swing", "lift", "spin")
    for name, value in zip(names, positions, strict=True):
        data.joint(name).qpos = value
    mujoco.mj_forward(model, data)
    poses = poses_at(described, **dict(zip(names, positions, strict=True)))
    (capsule,), (cylinder,) = (getattr(described.links["upper"], k)
                               for k in ("visuals", "collisions"))  # fmt: skip
    (ellipsoid,) = described.links["hand"].visuals
    for geom, link, shape in (
        (3, "upper", capsule),
        (4, "upper", cylinder),
        (5, "hand", ellipsoid),
    ):
        T = (poses[link] @ shape.T_link_shape).matrix()
        assert T[:3, 3] == pytest.approx(data.geom_xpos[geom], abs=1e-7)
        assert T[:3, :3] == pytest.approx(data.geom_xmat[geom].reshape(3, 3), abs=1e-7)
    assert poses["tip"].translation_m == pytest.approx(data.site("tip").xpos, abs=1e-7)


def test_meshes_joints_and_groups_are_those_of_mujoco(tmp_path: Path) -> None:
    """Scale, reference position and reference turn of a mesh; the file's own origin is kept."""
    described = read_mjcf(write(tmp_path), "arm.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    expected = model.mesh_vert @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
    (shape,) = described.links["base"].visuals
    assert shape.file == "parts/wedge.obj"
    pose = described.poses_at_rest()["base"] @ shape.T_link_shape
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]) * shape.size
    assert np.sort(pose.apply(corners), axis=0) == pytest.approx(
        np.sort(expected, axis=0), abs=1e-6
    )
    # -90 to 45 degrees; -0.1 to 0.3 m; without end.
    found = {j.name: (j.kind, j.lower, j.upper) for j in described.joints if j.movable}
    assert found == {
        "swing": ("revolute", pytest.approx(-np.pi / 2), pytest.approx(np.pi / 4)),
        "lift": ("prismatic", -0.1, 0.3),
        "spin": ("continuous", -np.pi, np.pi),
    }
    # A body with visual geoms shows these only; any other shows its collision geoms.
    links = described.links
    kinds = {n: ([s.kind for s in k.visuals], [s.kind for s in k.collisions])
             for n, k in links.items() if k.visuals or k.collisions}  # fmt: skip
    assert kinds == {
        "base": (["mesh"], ["box"]),
        "upper": (["capsule"], ["cylinder"]),
        "hand": (["ellipsoid"], ["ellipsoid"]),
    }
    assert links["base"].collisions[0].size == pytest.approx((0.2, 0.4, 0.6))
    assert links["upper"].collisions[0].size == pytest.approx((0.05, 0.4, 0.0))


def test_materials_are_those_of_the_description(tmp_path: Path) -> None:
    """Images and roughness; colours as MuJoCo's viewer has them, in linear RGB."""
    write(tmp_path)
    (tmp_path / "assets.yaml").write_text("robots: [{id: arm, file: arm.xml}]\n")
    library = open_library([tmp_path], tmp_path / "cache", tmp_path)
    (wood,) = library.materials("user/arm/base")
    assert library.texture(wood.texture).albedo[0, 0].tolist() == [0, 0, 255]
    assert (wood.roughness, wood.metallic) == (0.25, 0.5)
    (glass,) = library.materials("user/arm/upper")
    (tinted,) = library.materials("user/arm/hand")
    shown = shown_colors(tmp_path)
    for material, rgba in ((glass, shown["upper"]), (tinted, shown["hand"])):
        linear = [min(((c + 0.055) / 1.055) ** 2.4 if c > 0.04 else c / 12.92, 0.85) for c in rgba]
        assert material.base_color == pytest.approx(linear[:3], abs=1e-6)
        assert material.opacity == pytest.approx(rgba[3])


def shown_colors(folder: Path) -> dict[str, list[float]]:
    """Colours of the last visible geom of each body as MuJoCo's viewer shows them."""
    model = mujoco.MjModel.from_xml_path(str(folder / "arm.xml"))
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, 100)
    mujoco.mj_forward(model, data)
    options, camera = mujoco.MjvOption(), mujoco.MjvCamera()
    every = mujoco.mjtCatBit.mjCAT_ALL
    mujoco.mjv_updateScene(model, data, options, None, camera, every, scene)
    geoms = [g for g in scene.geoms[: scene.ngeom] if g.objtype == mujoco.mjtObj.mjOBJ_GEOM]
    return {model.body(model.geom_bodyid[g.objid]).name: g.rgba.round(6).tolist() for g in geoms}


def test_a_joint_constraint_is_a_mimic_joint(tmp_path: Path) -> None:
    """Lift = 0.1 - 0.5 (swing - ref); a keyframe ``home`` gives the home positions."""
    extra = """<equality><joint joint1="lift" joint2="swing" polycoef="0.1 -0.5 0 0 0"/></equality>
    <keyframe><key name="home" qpos="0.5 0.2 1"/></keyframe></mujoco>"""
    described = read_mjcf(write(tmp_path, ARM.replace("</mujoco>", extra)), "arm.xml")
    (lift,) = (j for j in described.joints if j.name == "lift")
    ref = np.radians(20.0)
    assert (lift.mimic, lift.mimic_multiplier) == ("swing", -0.5)
    assert lift.mimic_offset == pytest.approx(0.1 + 0.5 * ref)
    assert described.home == {"swing": 0.5, "lift": 0.2, "spin": 1.0}


def test_what_is_not_used_is_named_and_a_height_fields_file_not_opened(tmp_path: Path) -> None:
    """In the result and by ``assets check``."""
    ball = """<body name="eye"><joint type="ball" name="look"/><geom size="0.1"/></body>
    </worldbody>"""
    described = read_mjcf(write(tmp_path, ARM.replace("</worldbody>", ball)), "arm.xml")
    assert described.remarks == (
        "not used: 1 ball joint (it stays at its origin)",
        "not used: 1 plane geom",
    )
    (tmp_path / "assets.yaml").write_text("robots: [{id: arm, file: arm.xml, licence: MIT}]\n")
    library = open_library([tmp_path], tmp_path / "cache", tmp_path)
    (finding,) = check_folder(tmp_path, library)
    place = tmp_path / "arm.xml"
    assert finding.warnings == tuple(f"{place}: {text}" for text in described.remarks)
    terrain = '<asset><hfield name="h" file="/etc/passwd" size="1 1 1 1"/>'
    ground = '<worldbody><geom type="hfield" hfield="h"/>'
    text = ARM.replace("<asset>", terrain).replace("<worldbody>", ground)
    described = read_mjcf(write(tmp_path, text), "arm.xml")
    assert described.remarks == ("not used: 1 hfield geom", "not used: 1 plane geom")
    assert len(described.joints) > 3


@pytest.mark.parametrize("aabb", ["false", "true"])
@pytest.mark.parametrize("kind", ["box", "capsule", "cylinder", "sphere", "ellipsoid"])
def test_primitives_are_fitted_to_their_meshes_as_mujoco_does(
    tmp_path: Path, kind: str, aabb: str
) -> None:
    """Next to a geom that shows the same mesh, at a scale and turned, in a file or inline."""
    placed = 'scale="2 1 0.5" refpos="0.1 0.2 0.3"'
    points = "0 0 0  0.3 0 0  0 0.2 0  0 0 1"
    text = f"""<mujoco><compiler fitaabb="{aabb}" meshdir="parts"/><asset>
      <mesh name="wedge" file="wedge.obj" inertia="exact" {placed}/>
      <mesh name="inline" vertex="{points}" inertia="convex"/></asset>
    <worldbody><body name="b" pos="0 0 1"><geom type="mesh" mesh="wedge" group="2" contype="0"
        conaffinity="0"/>
      <geom type="{kind}" mesh="wedge" group="3" pos="0.1 0.2 0.3" euler="10 20 30"/>
      <geom type="{kind}" mesh="inline" group="3" fitscale="0.9"/></body></worldbody></mujoco>"""
    described = read_mjcf(write(tmp_path, text), "arm.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)

    (seen,) = described.links["b"].visuals
    assert (seen.kind, seen.file) == ("mesh", "parts/wedge.obj")
    assert described.included == ("parts/wedge.obj",)
    shapes = described.links["b"].collisions
    assert [shape.kind for shape in shapes] == [kind, kind]
    for g, shape in enumerate(shapes, 1):
        a, b, c = model.geom_size[g]
        expected = {
            "box": (2 * a, 2 * b, 2 * c),
            "sphere": (a, 0.0, 0.0),
            "ellipsoid": (a, b, c),
        }.get(kind, (a, 2 * b, 0.0))
        assert shape.size == pytest.approx(expected, abs=1e-6)
        pose = poses_at(described)["b"] @ shape.T_link_shape
        matrix = data.geom_xmat[g].reshape(3, 3)
        np.testing.assert_allclose(pose.matrix()[:3, 3], data.geom_xpos[g], atol=1e-6)
        np.testing.assert_allclose(pose.rotation(), matrix, atol=1e-5)


def test_cameras_and_repeated_images_are_named_as_not_used(tmp_path: Path) -> None:
    text = ARM.replace("</body></frame>", '<camera name="eye"/><light/></body></frame>')
    text = text.replace('texture="wood" rgba', 'texture="wood" texrepeat="3 3" rgba')
    text = text.replace('type="box"', 'type="box" material="wood"')
    text = text.replace(
        "</mujoco>",
        '<actuator><motor joint="lift"/></actuator><sensor><jointpos joint="lift"/></sensor>'
        "</mujoco>",
    )
    assert read_mjcf(write(tmp_path, text), "arm.xml").remarks == (
        "not used: 1 actuator",
        "not used: 1 camera",
        "not used: 1 light",
        "not used: 1 plane geom",
        "not used: 1 repetition of an image (it is wrapped once around its shape)",
        "not used: 1 sensor",
    )


def test_included_files_are_part_of_the_asset(tmp_path: Path) -> None:
    """A change of an included file changes the digest, as one of a mesh does."""
    write(tmp_path, ARM.replace("<default>\n", '<include file="looks.xml"/>\n<default>\n'))
    (tmp_path / "assets.yaml").write_text("robots: [{id: arm, file: arm.xml}]\n")
    digests = []
    for color in ("1 0 0 1", "0 1 0 1"):
        (tmp_path / "looks.xml").write_text(
            f'<mujocoinclude><asset><material name="red" rgba="{color}"/></asset></mujocoinclude>'
        )
        library = open_library([tmp_path], tmp_path / "cache", tmp_path)
        digests.append(library.get("user/arm").sha256)
        assert len(library.robot("user/arm").movable) == 3
    assert digests[0] != digests[1]


def test_without_an_index_it_is_one_object(tmp_path: Path) -> None:
    write(tmp_path)
    (tmp_path / "package.xml").write_text("<package><name>arm</name></package>")
    library = open_library([tmp_path], tmp_path / "cache", tmp_path)
    assert [a.asset_id for a in library.find({"user"})] == ["user/arm"]
    low, high = library.bounds_m("user/arm")
    assert high[2] - low[2] > 0.5


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [("<worldbody>", "<worldbdy>", "malformed XML"),
     ("<mujoco", "<!DOCTYPE a [<!ENTITY b 'c'>]><mujoco", "declares a document type"),
     ('axis="0 0 2"', 'axis="0 0 0"', "MuJoCo refuses it .*lift"),
     ('mesh="wedge"', 'mesh="edge"', "MuJoCo refuses it .*edge"),
     ('file="wedge.obj"', 'file="../../wedge.obj"', "outside"),
     ('type="ellipsoid"', 'type="elipsoid"', "MuJoCo refuses it .*elipsoid"),
     ("<asset>", '<include file="arm.xml"/><asset>', "includes arm.xml twice")],
)  # fmt: skip
def test_faults_have_one_clear_error(tmp_path: Path, old: str, new: str, reason: str) -> None:
    folder = write(tmp_path, ARM.replace(old, new, 1))
    with pytest.raises(AssetError, match=rf"arm\.xml.*{reason}"):
        read_mjcf(folder, "arm.xml")
