"""Unused content of a file is reported: by checks, plans, ``init`` and generation."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from PIL import Image

from gen_data.assets.checking import NO_LICENCE, Finding, check_folder
from gen_data.assets.file_remarks import collect_remarks, warn_of_remarks
from gen_data.assets.importer import FileRemarks
from gen_data.assets.library import Library, open_library
from gen_data.cli.asset_commands import assets
from gen_data.core.errors import AssetError, AssetWarning

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
FACE = "f 1/1 2/2 3/3\n"
STL = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"  # noqa: E501


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with an OBJ whose MTL has a height image, which is not used."""
    root = tmp_path / "props"
    root.mkdir()
    (root / "a.obj").write_text(f"mtllib a.mtl\n{TRIANGLE}usemtl m\n{FACE}l 1 2\n")
    (root / "a.mtl").write_text("newmtl m\nKd 1 0 0\nmap_Bump rough.png\n")
    return root


def opened(folder: Path) -> Library:
    return open_library((folder,), folder.parent / "cache", folder.parent / "packs")


def findings(folder: Path) -> dict[str, Finding]:
    return {f.asset_id: f for f in check_folder(folder, opened(folder))}


REMARKS = ("material 'm': map_Bump (a height image) is not used", "lines are not read")


@pytest.mark.slow
def test_remarks_name_the_file_and_survive_the_cache(folder: Path) -> None:
    """A second library reads them from the cache, without the reader."""
    expected = (FileRemarks(str(folder / "a.obj"), REMARKS),)
    assert opened(folder).remarks("user/a", read=False) is None
    assert opened(folder).remarks("user/a") == expected
    assert opened(folder).remarks("user/a", read=False) == expected


@pytest.mark.slow
def test_check_lists_remarks_and_still_succeeds(folder: Path) -> None:
    """The picture is right except for listed parts."""
    result = CliRunner().invoke(assets, ["check", str(folder)])
    assert result.exit_code == 0, result.output
    for text in REMARKS:
        assert f"{folder / 'a.obj'}: {text}" in result.output
    assert NO_LICENCE in result.output


@pytest.mark.parametrize(
    ("files", "reason"),
    [({"a.mtl": "newmtl m\nmap_Kd gone.png\n"}, "gone.png: no such image"),
     ({"a.mtl": "newmtl m\nmap_Kd t.png\n", "t.png": "text"}, "t.png: unreadable image"),
     ({"a.mtl": "newmtl other\nKd 1 0 0\n"}, "material 'm' is not defined in a.mtl"),
     ({"a.mtl": "newmtl M\nKd 1 0 0\n"}, "is not defined in a.mtl (did you mean 'M'")],
    ids=["missing image", "no image", "unknown material", "another case"],
)  # fmt: skip
def test_check_refuses_wrong_looks(folder: Path, files: dict[str, str], reason: str) -> None:
    """Each is found without rendering anything, and ends with exit code 3."""
    for name, text in files.items():
        (folder / name).write_text(text)
    result = CliRunner().invoke(assets, ["check", str(folder)])
    assert isinstance(result.exception, AssetError)
    assert reason in findings(folder)["user/a"].error


def test_warnings_are_given_once_a_file_and_large_folders_not_read_for_them(folder: Path) -> None:
    """Unless the file was read before."""
    assert collect_remarks(opened(folder), ["user/a"], read_max=0) == ()
    library = opened(folder)
    with pytest.warns(AssetWarning, match="map_Bump") as told:
        known = warn_of_remarks(library, ["user/a", "mug?seed=3"])
    assert len(told) == 1
    assert known == {str(folder / "a.obj")}
    assert warn_of_remarks(library, ["user/a"], told=known) == known
    assert len(collect_remarks(opened(folder), ["user/a"], read_max=0)) == 1


def test_files_of_one_stem_are_told_apart(folder: Path) -> None:
    """YCB's folders: both have their suffix in their ids; the category is the object's folder."""
    ycb = folder / "003_cracker_box" / "google_16k"
    ycb.mkdir(parents=True)
    (ycb / "textured.obj").write_text(TRIANGLE + FACE)
    (ycb / "nontextured.stl").write_text(STL)
    (ycb / "nontextured.ply").write_text("ply\nformat ascii 1.0\nend_header\n")
    found = findings(folder)
    base = "user/003_cracker_box/google_16k"
    assert sorted(found) == [
        f"{base}/nontextured.ply", f"{base}/nontextured.stl", f"{base}/textured", "user/a",
    ]  # fmt: skip
    assert [name for name, f in found.items() if f.error] == [f"{base}/nontextured.ply"]
    assert {f.category for name, f in found.items() if name != "user/a"} == {"003_cracker_box"}
    assert opened(folder).mesh(f"{base}/nontextured.stl").materials[0].texture == ""


@pytest.mark.parametrize(
    ("file", "category"),
    [("Ecoforms_Pot/meshes/model.obj", "Ecoforms_Pot"),
     ("ycbv/models/obj_000004.ply", "obj_000004"),
     ("02876657/1071fa4cddb2da2fc8724d5673a063a6/models/model_normalized.obj", "02876657"),
     ("tools/hammer.stl", "tools"), ("meshes/hammer.stl", "meshes")],
    ids=["Google Scanned Objects", "BOP", "ShapeNet", "own", "only a sorting folder"],
)  # fmt: skip
def test_categories_of_published_layouts(tmp_path: Path, file: str, category: str) -> None:
    """The nearest folder with a meaningful name."""
    path = tmp_path / "props" / file
    path.parent.mkdir(parents=True)
    path.write_text(TRIANGLE + FACE if file.endswith(".obj") else STL)
    (found,) = findings(tmp_path / "props").values()
    assert found.category == category


def test_ids_defined_in_two_folders_are_refused_with_both_files(folder: Path) -> None:
    other = folder.parent / "more"
    other.mkdir()
    (other / "a.stl").write_text(STL)
    library = open_library((folder, other), folder.parent / "cache", folder.parent / "packs")
    with pytest.raises(AssetError, match=rf"{folder}/a\.obj and by {other}/a\.stl"):
        library.mesh("user/a")


def test_show_tells_the_shift_to_the_origin(folder: Path) -> None:
    """The triangle's box has its middle at (0.5, 0.5, 0)."""
    result = CliRunner().invoke(assets, ["show", "user/a", "--folder", str(folder)])
    assert "shift_m      -0.5, -0.5, 0" in result.output
    assert "not used" in result.output


def test_digests_cover_images_with_spaces_and_other_case(folder: Path) -> None:
    """A changed image changes the asset, however the MTL spells it."""
    (folder / "a.mtl").write_text("newmtl m\nmap_Kd MY wood.PNG\n")
    Image.new("RGB", (2, 2), (200, 0, 0)).save(folder / "my wood.png")
    before = opened(folder).get("user/a").sha256
    Image.new("RGB", (2, 2), (0, 200, 0)).save(folder / "my wood.png")
    assert opened(folder).get("user/a").sha256 != before
    texture = opened(folder).mesh("user/a").materials[0].texture
    assert opened(folder).texture(texture).albedo[0, 0].tolist() == [0, 200, 0]


def test_bop_models_state_the_files_origin(folder: Path) -> None:
    """Added to the coordinates of the file; with ``origin: file``, models keep them."""
    from gen_data.core.se3 import IDENTITY
    from gen_data.exporters.rigid_models import Piece, build_model

    for origin, offset, low in (("center", [-500, -500, 0], -500), ("file", [0, 0, 0], 0)):
        text = json.dumps({"assets": [{"file": "a.obj", "id": f"a_{origin}", "origin": origin}]})
        (folder / "assets.yaml").write_text(text)
        model = build_model([Piece(f"user/a_{origin}", 1.0, IDENTITY)], opened(folder))
        assert model.info["file_origin_mm"] == offset
        assert float(model.vertices["x"].min()) == low


@pytest.mark.parametrize("name", ["part[1].obj", "a b.obj", "ü.obj", f"{'long' * 40}.obj"])
def test_any_name_of_a_file_is_listed(tmp_path: Path, name: str) -> None:
    """Names that are patterns, hold spaces or accents, or are longer than an id in an index."""
    root = tmp_path / "props"
    root.mkdir()
    (root / name).write_text(TRIANGLE + FACE)
    (found,) = findings(root).values()
    assert (found.triangles, found.error) == (1, "")


BODY_AND_RIM = f"mtllib a.mtl\n{TRIANGLE}usemtl body\n{FACE}usemtl rim\n{FACE}"
INDEX = "assets: [{file: FILE, materials: {NAME: {base_color: [0, 1, 0]}}}]\n"
REGION = "assets: [{file: FILE, regions: [{material: NAME, low_m: [0, 0, 0], high_m: [1, 1, 1], finish: {roughness: 0.1}}]}]\n"  # noqa: E501


LACKS = "of the index: the file has no material"


@pytest.mark.parametrize(("index", "file", "name", "remark"), [
    (INDEX, "a.obj", "bdoy",
     f"materials.bdoy {LACKS} 'bdoy'; expected one of body, rim (did you mean 'body'?)"),
    (INDEX, "a.obj", "lid", f"materials.lid {LACKS} 'lid'; expected one of body, rim"),
    (REGION, "a.obj", "bdoy",
     f"regions[0].material {LACKS} 'bdoy'; expected one of body, rim (did you mean 'body'?)"),
    (INDEX, "'*.obj'", "bdoy",
     f"materials.bdoy {LACKS} 'bdoy'; expected one of body, rim (did you mean 'body'?)"),
    (INDEX, "'*.obj'", "lid", ""), (INDEX, "a.obj", "r?m", ""), (INDEX, "a.obj", "'*'", ""),
    (REGION, "a.obj", "b*", ""),
])  # fmt: skip
def test_finishes_for_materials_that_the_file_lacks_are_named(
    folder: Path, index: str, file: str, name: str, remark: str
) -> None:
    """Entries for several files may have finishes that only some of them need."""
    (folder / "a.obj").write_text(BODY_AND_RIM)
    (folder / "a.mtl").write_text("newmtl body\nKd 1 0 0\nnewmtl rim\nKd 1 0 0\n")
    (folder / "assets.yaml").write_text(index.replace("FILE", file).replace("NAME", name))

    warnings = findings(folder)["user/a"].warnings
    expected = (f"{folder / 'a.obj'}: {remark}",) if remark else ()
    assert warnings == (*expected, NO_LICENCE)
    if remark:
        with pytest.warns(AssetWarning, match=re.escape(remark)):
            warn_of_remarks(opened(folder), ["user/a"])
