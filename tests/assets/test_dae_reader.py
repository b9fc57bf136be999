"""COLLADA files: units, up axis, nodes, polygons, colours and images as the file states them."""

import re
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.asset_folder import Folder
from gen_data.assets.library import open_library
from gen_data.assets.readers import read_mesh
from gen_data.core.errors import AssetError

HEAD = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><contributor><authoring_tool>{tool}</authoring_tool></contributor>
<unit name="centimeter" meter="0.01"/><up_axis>{up}</up_axis></asset>
<library_images><image id="wood"><init_from>my%20wood.png</init_from></image></library_images>
<library_effects>
<effect id="paint-fx"><profile_COMMON><technique sid="common"><phong>
<diffuse><color>0.5 0.25 1 1</color></diffuse>{transparency}
</phong></technique></profile_COMMON></effect>
<effect id="wood-fx"><profile_COMMON>
<newparam sid="s"><surface type="2D"><init_from>wood</init_from></surface></newparam>
<newparam sid="t"><sampler2D><source>s</source></sampler2D></newparam>
<technique sid="common"><lambert>
<diffuse><texture texture="t" texcoord="UV0"/></diffuse>
</lambert></technique></profile_COMMON></effect>
</library_effects>
<library_materials>
<material id="paint" name="paint"><instance_effect url="#paint-fx"/></material>
<material id="wood" name="wood"><instance_effect url="#wood-fx"/></material>
</library_materials>
<library_geometries><geometry id="plate" name="plate"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 100 0 0 100 50 0 0 50 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="u"><float_array id="ua" count="8">0 0 1 0 1 1 0 1</float_array>
<technique_common><accessor source="#ua" count="4" stride="2"><param name="S" type="float"/>
<param name="T" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1" material="look"><input semantic="VERTEX" source="#v" offset="0"/>
<input semantic="TEXCOORD" source="#u" offset="1" set="0"/>
<vcount>4</vcount><p>0 0 1 1 2 2 3 3</p></polylist>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="scene"><node id="top"><translate>0 0 200</translate>
<node id="a"><scale>{scale}</scale><instance_geometry url="#plate"><bind_material>
<technique_common><instance_material symbol="look" target="#{material}"/></technique_common>
</bind_material></instance_geometry></node>{second}</node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#scene"/></scene></COLLADA>
"""
SECOND = """<node id="b"><translate>0 0 100</translate><instance_geometry url="#plate"/></node>"""


def folder_of(tmp_path: Path, **changes: str) -> Folder:
    values = {"tool": "Some CAD", "up": "Z_UP", "scale": "1 1 1", "material": "paint",
              "second": "", "transparency": ""} | changes  # fmt: skip
    (tmp_path / "a.dae").write_text(HEAD.format(**values))
    return Folder(tmp_path)


def edited(tmp_path: Path, old: str, new: str, material: str = "wood") -> Folder:
    folder = folder_of(tmp_path, material=material)
    (tmp_path / "a.dae").write_text((tmp_path / "a.dae").read_text().replace(old, new))
    return folder


def test_nodes_place_mirror_and_name_geometry_and_images_have_coordinates(tmp_path: Path) -> None:
    """A plate of 100 x 50 cm, 200 cm up, and a second one 100 cm above it."""
    soup = read_mesh(folder_of(tmp_path, second=SECOND), "a.dae").soup
    assert len(soup) == 4
    points = soup.corners.reshape(-1, 3)
    assert points.min(axis=0) == pytest.approx([0.0, 0.0, 2.0])
    assert points.max(axis=0) == pytest.approx([1.0, 0.5, 3.0])
    assert soup.face_groups.tolist() == [0, 0, 1, 1]
    # As tools show them; both nodes hold the one geometry ``plate``.
    assert soup.group_names == ("a", "b")
    # Scaled by -1 along X, the quad still faces +Z.
    soup = read_mesh(folder_of(tmp_path, scale="-1 1 1"), "a.dae").soup
    a, b, c = soup.corners[0]
    assert np.cross(b - a, c - a)[2] > 0.0
    assert soup.corners[..., 0].min() == pytest.approx(-1.0)
    # ``my%20wood.png`` is a URI; (0, 0) is the image's bottom left in COLLADA, too.
    soup = read_mesh(folder_of(tmp_path, material="wood"), "a.dae").soup
    assert soup.slots[0].material.texture == "my wood.png"
    assert soup.uvs is not None
    assert soup.uvs[0].tolist() == [[0, 0], [1, 0], [1, 1]]


@pytest.mark.parametrize(("tool", "red"), [("Some CAD", 0.214041), ("Blender 3.6", 0.5)])
def test_colours_are_srgb_but_for_blenders(tmp_path: Path, tool: str, red: float) -> None:
    """SRGB 0.5 is 0.214041 linear (IEC 61966-2-1); Blender writes linear values."""
    slot = read_mesh(folder_of(tmp_path, tool=tool), "a.dae").soup.slots[0]
    assert slot.name == "paint"
    assert slot.material.base_color[0] == pytest.approx(red, abs=1e-6)


@pytest.mark.parametrize(
    ("text", "opacity"),
    [
        ("<transparency><float>0.3</float></transparency>", 0.3),
        ("<transparent opaque='A_ONE'><color>1 1 1 0.4</color></transparent>", 0.4),
        ("<transparent opaque='RGB_ZERO'><color>0.5 0.5 0.5 1</color></transparent>"
         "<transparency><float>0.5</float></transparency>", 0.75),
        ("<transparency><float>0</float></transparency>", 1.0),
    ],
)  # fmt: skip
def test_transparency_is_that_of_the_format(tmp_path: Path, text: str, opacity: float) -> None:
    """A_ONE: alpha times factor; RGB_ZERO: 1 - luminance times factor; never invisible."""
    slot = read_mesh(folder_of(tmp_path, transparency=text), "a.dae").soup.slots[0]
    assert slot.material.opacity == pytest.approx(opacity)


COLORS = """<source id="c"><float_array id="ca" count="16">1 0 0 1 0 0.5 0 1 0 0 1 1 1 1 1 1
</float_array><technique_common><accessor source="#ca" count="4" stride="4">
<param name="R" type="float"/><param name="G" type="float"/><param name="B" type="float"/>
<param name="A" type="float"/></accessor></technique_common></source><vertices"""


@pytest.mark.parametrize("place", ["vertices", "polylist"])
def test_colours_of_vertices_are_srgb_factors_and_images_replace_them(
    tmp_path: Path, place: str
) -> None:
    """A value of 0.5 in sRGB is 0.214041 linear (IEC 61966-2-1)."""
    folder = edited(tmp_path, "<vertices", COLORS, material="paint")
    path = tmp_path / "a.dae"
    where = {"vertices": '<input semantic="POSITION"', "polylist": '<input semantic="TEXCOORD"'}
    offset = ' offset="0"' if place == "polylist" else ""
    given = f'<input semantic="COLOR" source="#c"{offset}/>'
    path.write_text(path.read_text().replace(where[place], given + where[place], 1))
    soup = read_mesh(folder, "a.dae").soup
    assert soup.colors is not None
    corners = np.array([[1, 0, 0], [0, 0.214041, 0], [0, 0, 1], [1, 1, 1]])
    np.testing.assert_allclose(soup.colors, corners[[[0, 1, 2], [0, 2, 3]]], atol=1e-6)
    assert soup.slots[0].material.base_color == pytest.approx((0.214041, 0.050876, 1.0), abs=1e-5)

    path.write_text(path.read_text().replace('target="#paint"', 'target="#wood"'))
    (tmp_path / "my wood.png").write_bytes(b"")
    found = read_mesh(Folder(tmp_path), "a.dae")
    assert found.soup.colors is None
    assert found.remarks == ("vertex colours are not used where an image is",)
    path.write_text(path.read_text().replace('target="#wood"', 'target="#none"'))
    found = read_mesh(Folder(tmp_path), "a.dae")
    assert found.soup.colors is not None
    assert found.soup.slots[0].material.base_color == (1.0, 1.0, 1.0)


def test_an_image_lies_by_the_texture_coordinates_that_its_material_is_bound_to(
    tmp_path: Path,
) -> None:
    """Such as the second set of a file whose first one is for a light map."""
    second = """<source id="w"><float_array id="wa" count="8">0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8
</float_array><technique_common><accessor source="#wa" count="4" stride="2">
<param name="S" type="float"/><param name="T" type="float"/></accessor></technique_common></source>
<vertices"""
    folder = edited(tmp_path, "<vertices", second)
    (tmp_path / "my wood.png").write_bytes(b"")
    path = tmp_path / "a.dae"
    text = path.read_text().replace(
        "<vcount>", '<input semantic="TEXCOORD" source="#w" offset="1" set="3"/><vcount>'
    )
    bound = '<bind_vertex_input semantic="UV0" input_semantic="TEXCOORD" input_set="3"/>'
    node = '<instance_material symbol="look" target="#wood"'
    whole = f"{node}>{bound}</instance_material>"
    for shown, first in ((whole, [0.1, 0.2]), (f"{node}/>", [0, 0])):
        path.write_text(text.replace(f"{node}/>", shown))
        soup = read_mesh(folder, "a.dae").soup
        assert soup.uvs is not None
        np.testing.assert_allclose(soup.uvs[0, 0], first, atol=1e-6)


def values(name: str, kind: str, words: str, count: int, stride: int) -> str:
    return (
        f'<source id="{name}"><{kind}_array id="{name}a" count="{count}">{words}</{kind}_array>'
        f'<technique_common><accessor source="#{name}a" count="{count // stride}" '
        f'stride="{stride}"><param name="X" type="{kind}"/></accessor></technique_common></source>'
    )


UNIT = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
SKIN = (
    '<library_controllers><controller id="skin"><skin source="#plate">'
    f"<bind_shape_matrix>{UNIT}</bind_shape_matrix>{values('j', 'Name', 'bone', 1, 1)}"
    f"{values('b', 'float', UNIT, 16, 16)}{values('w', 'float', '1', 1, 1)}"
    '<joints><input semantic="JOINT" source="#j"/><input semantic="INV_BIND_MATRIX" source="#b"/>'
    '</joints><vertex_weights count="4"><input semantic="JOINT" source="#j" offset="0"/>'
    '<input semantic="WEIGHT" source="#w" offset="1"/><vcount>1 1 1 1</vcount>'
    "<v>0 0 0 0 0 0 0 0</v></vertex_weights></skin></controller></library_controllers>"
)


def test_emission_and_skins_are_named_as_not_used(tmp_path: Path) -> None:
    glow = "<emission><color>0 1 0 1</color></emission><diffuse>"
    folder = edited(tmp_path, "<diffuse>", glow, material="paint")
    assert read_mesh(folder, "a.dae").remarks == ("material 'paint': its emission is not used",)
    dark = (tmp_path / "a.dae").read_text().replace("0 1 0 1</color></em", "0 0 0 1</color></em")
    (tmp_path / "a.dae").write_text(dark)
    assert read_mesh(folder, "a.dae").remarks == ()

    text = dark.replace("<library_visual_scenes>", SKIN + "<library_visual_scenes>")
    skinned = '<node id="man" name="man"><instance_controller url="#skin"/></node></node></visual'
    (tmp_path / "a.dae").write_text(text.replace("</node></visual", skinned))
    assert read_mesh(folder, "a.dae").remarks == ("'man' is skinned and is not read",)
    alone = re.sub(r"<node id=.a.>.*?</node>", "", text.replace("</node></visual", skinned))
    (tmp_path / "a.dae").write_text(
        re.sub(r"(?s)<instance_geometry.*?/instance_geometry>", "", alone)
    )
    with pytest.raises(AssetError, match=r"holds no triangles \(skins are not read\)"):
        read_mesh(folder, "a.dae")


@pytest.mark.slow
def test_alone_a_file_stands_as_its_up_axis_states(tmp_path: Path) -> None:
    """The plate lies in XY for Z up, and stands for Y up."""
    heights = {}
    for up in ("Z_UP", "Y_UP"):
        (tmp_path / up).mkdir()
        library = open_library(
            [folder_of(tmp_path / up, up=up, second=SECOND).root], tmp_path / "cache", tmp_path
        )
        heights[up] = float(np.ptp(library.mesh("user/a").vertices_m[:, 2]))
    assert heights == {"Z_UP": pytest.approx(1.0), "Y_UP": pytest.approx(0.5)}


def test_geometry_with_a_broken_material_or_image_is_kept(tmp_path: Path) -> None:
    """A sampler without its surface, as in ANYmal's foot: the triangles are there, in grey.

    An image without a path, as in Gazebo's ``arm_part``: the remark names the fault.
    """
    soup = read_mesh(edited(tmp_path, "<source>s</source>", "<source>x</source>"), "a.dae").soup
    assert (len(soup), soup.slots[0].material.base_color) == (2, (0.6, 0.6, 0.6))
    image = "<init_from>my%20wood.png</init_from>"
    source = read_mesh(edited(tmp_path, image, "", material="paint"), "a.dae")
    assert len(source.soup) == 2
    assert any("Image has no file path" in remark for remark in source.remarks)


@pytest.mark.parametrize(
    "path", ["model://shed/images/wood.png", "file://C:/me/wood.png", "C:\\me\\WOOD.png"]
)
def test_images_of_other_models_and_computers_are_found(tmp_path: Path, path: str) -> None:
    """Next to the file, or in the folder of the model that has that name."""
    here = "shed/images/wood.png" if path.startswith("model") else "wood.png"
    (tmp_path / here).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / here).write_bytes(b"")
    folder = edited(tmp_path, "my%20wood.png", path)
    assert read_mesh(folder, "a.dae").soup.slots[0].material.texture == here


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [('utf-8"?>', "utf-8\"?><!DOCTYPE a [<!ENTITY b 'c'>]>", "declares a document type"),
     ("3 3</p>", "9 3</p>", "malformed COLLADA"), ("<p>0 0", "<p>x 0", "malformed COLLADA"),
     ("COLLADA", "Collada", "its root element is <Collada>")],
)  # fmt: skip
def test_malformed_files_are_refused(tmp_path: Path, old: str, new: str, reason: str) -> None:
    with pytest.raises(AssetError, match=rf"a\.dae: .*{reason}"):
        read_mesh(edited(tmp_path, old, new, "paint"), "a.dae")
