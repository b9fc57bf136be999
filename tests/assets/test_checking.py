"""A folder is checked asset by asset."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from gen_data.assets.checking import Finding, check_folder
from gen_data.assets.folder_index import FolderIndex
from gen_data.assets.library import open_library
from gen_data.cli.asset_commands import assets
from gen_data.config.problems import Problems
from gen_data.config.validation import validate
from gen_data.config.yaml_tree import parse_yaml
from gen_data.core.errors import AssetError
from tests.assets.test_user_folders import ARM, write_box


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A bolt in millimetres, a broken mesh, a crate, an arm."""
    root = tmp_path / "props"
    write_box(root / "bolt.stl", (8.0, 8.0, 40.0))
    write_box(root / "crate.glb", (0.4, 0.6, 0.3))
    (root / "broken.obj").write_text("v 0 0 0\n")
    (root / "arm.urdf").write_text(ARM)
    (root / "assets.yaml").write_text(
        "licence: CC0-1.0\nrobots: [{id: arm, file: arm.urdf}]\nassets:\n"
        "  - {file: bolt.stl}\n  - {file: broken.obj}\n  - {file: crate.glb, licence: MIT}\n"
    )
    return root


@pytest.mark.slow
def test_every_asset_is_found_out_about(folder: Path, tmp_path: Path) -> None:
    """A broken asset does not hide the others."""
    library = open_library([folder], cache_dir=tmp_path / "cache")
    found = {finding.asset_id: finding for finding in check_folder(folder, library)}
    assert list(found) == ["user/bolt", "user/broken", "user/crate", "user/arm"]
    assert found["user/crate"] == Finding(
        "user/crate", "object", "props", 12, found["user/crate"].size_m, "m (assumed)",
        "y (assumed)",
    )  # fmt: skip
    # Y of a glTF points up.
    assert found["user/crate"].size_m == pytest.approx((0.4, 0.3, 0.6))
    assert "holds no triangles" in found["user/broken"].error
    assert found["user/bolt"].warnings == (
        "40 m long; its unit may be mm (0.04 m), cm (0.4 m), in (1.016 m)",
    )
    assert found["user/arm"].error == ""


def test_a_keypoint_far_from_its_object_is_doubtful(tmp_path: Path) -> None:
    """The corner is 20 mm from the centre; the tip may be beyond the end, the other in mm."""
    write_box(tmp_path / "bolt.stl", (8.0, 8.0, 40.0))
    points = {"corner": [0.004, 0.004, 0.02], "tip": [0, 0, 0.05], "far": [0, 0, 5.02]}
    listed = ", ".join(f"{{name: {name}, position_m: {at}}}" for name, at in points.items())
    (tmp_path / "assets.yaml").write_text(
        f"licence: CC0-1.0\nassets: [{{file: bolt.stl, unit: mm, keypoints: [{listed}]}}]\n"
    )
    library = open_library([tmp_path], cache_dir=tmp_path / "cache")
    (found,) = check_folder(tmp_path, library)
    assert found.warnings == (
        "keypoint 'far' is 5 m away from the object, which is 0.04 m long; expected metres in the "
        "finished frame",
    )


def test_a_robot_is_measured_at_home(folder: Path, tmp_path: Path) -> None:
    """By hand: the shoulder at 1 rad tips 0.4 m of arm and a ball of radius 0.05 m over."""
    library = open_library([folder], cache_dir=tmp_path / "cache")
    (arm,) = (f for f in check_folder(folder, library) if f.kind == "robot")
    assert arm.size_m is not None
    # From the box's corner at -0.1 to the ball's side; from its bottom at -0.05 to the cylinder's
    # upper edge or the ball's top.
    ball_x, ball_z = 0.4 * np.sin(1.0), 0.05 + 0.4 * np.cos(1.0)
    assert arm.size_m[0] == pytest.approx(0.1 + ball_x + 0.05, abs=0.002)
    assert arm.size_m[2] == pytest.approx(0.05 + ball_z + 0.05, abs=0.002)


def test_a_folder_without_assets_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("irreplaceable")
    result = CliRunner().invoke(assets, ["check", str(tmp_path)])
    assert isinstance(result.exception, AssetError)
    assert "has no assets; expected OBJ" in str(result.exception)


@pytest.mark.slow
def test_the_command_fails_if_an_asset_cannot_be_used(folder: Path) -> None:
    result = CliRunner().invoke(assets, ["check", str(folder)])
    assert isinstance(result.exception, AssetError)
    assert "1 of 4 assets cannot be used" in str(result.exception)
    assert "user/broken: " in result.output
    (folder / "broken.obj").unlink()
    (folder / "assets.yaml").write_text("licence: CC0-1.0\nassets: [{file: crate.glb}]\n")
    result = CliRunner().invoke(assets, ["check", str(folder)], catch_exceptions=False)
    assert result.exit_code == 0
    assert "1 asset can be used" in result.output


def test_what_a_check_prints_fits_a_terminal(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """80 columns also where the output is piped, with whole words; the state stands first."""
    name = "a_crate_with_a_long_name"
    (folder / "crate.glb").rename(folder / f"{name}.glb")
    text = (folder / "assets.yaml").read_text()
    (folder / "assets.yaml").write_text(text.replace("crate.glb", f"{name}.glb"))
    monkeypatch.chdir(folder)
    lines = CliRunner().invoke(assets, ["check", "."]).output.splitlines()
    assert max(map(len, lines)) <= 80
    words = [line.split() for line in lines]
    assert [f"user/{name}", "ok", "object", "props"] in words
    assert ["user/broken", "cannot", "be", "used", "object", "props"] in words
    assert not any("…" in line for line in lines)
    assert "unit may be mm (0.04 m), cm (0.4 m), in (1.016 m)" in " ".join(" ".join(lines).split())


def test_pictures_show_every_asset(folder: Path, tmp_path: Path) -> None:
    """Each tile has something brighter than its background, and something of it is seen."""
    (folder / "assets.yaml").write_text("assets: [{file: crate.glb}]\n")
    sheet = tmp_path / "sheet.png"
    CliRunner().invoke(
        assets, ["check", str(folder), "--sheet", str(sheet)], catch_exceptions=False
    )
    image = cv2.imread(str(sheet))
    assert image is not None
    tile = image[4:260, 4:260]
    # The box fills the middle, and a margin stays around it.
    assert tile[100:156, 100:156].min() > 40
    assert tile[:8].max() < 30


def test_a_folder_is_listed(folder: Path) -> None:
    listed = CliRunner().invoke(assets, ["list", "--folder", str(folder)], catch_exceptions=False)
    assert {line.split()[0] for line in listed.output.splitlines()} == {
        "user/arm", "user/bolt", "user/broken", "user/crate",
    }  # fmt: skip


def test_the_schema_describes_the_index_and_the_page_on_assets_shows_a_valid_one() -> None:
    printed = CliRunner().invoke(assets, ["schema"], catch_exceptions=False)
    described = json.loads(printed.output)
    assert {"assets", "robots", "textures", "environments"} <= set(described["properties"])
    assert "SymmetryEntry" in described["$defs"]
    page = Path(__file__).parents[2] / "docs/assets.md"
    examples = page.read_text(encoding="utf-8").split("```yaml\n")[1:]
    text = max((example.partition("```")[0] for example in examples), key=len)
    problems = Problems()
    index = validate(parse_yaml(text, str(page)), FolderIndex, problems)
    problems.raise_if_any()
    assert index is not None
    assert len(index.assets) == 3
