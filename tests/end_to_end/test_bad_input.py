"""Bad input: one clear error with its own exit code, and no partial output."""

from pathlib import Path

import pytest

from tests.end_to_end.running import SMALL, gen_data

JOB = ("--n", "2", "--workers", "0", *SMALL)
COUNT = "randomizers.clutter.count"


def assert_refused(tmp_path: Path, arguments: tuple[str, ...], code: int, *texts: str) -> None:
    """Exit code and message are as expected; there is no traceback and no data set."""
    done = gen_data(*arguments, cwd=tmp_path)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    for text in texts:
        assert text in done.stderr, done.stderr
    assert not list(tmp_path.rglob("manifest.json"))
    assert not list(tmp_path.rglob("*.png"))


@pytest.mark.parametrize(("arguments", "texts"), [
    (("--config", "tabletop.yaml", "--n", "0"), ("n: 0",)),
    (("--config", "tabletop.yaml", "--n", "-3"), ("n: -3",)),
    (("--config", "tabletop.yaml"), ("--n is missing",)),
    (("--n", "2"), ("--config is missing",)),
    (("--seed", "3", "plan", "shelf.yaml", "--n", "2"), ("--seed cannot precede a command",)),
    (("--config", "tabletop.yaml", "--n", "x"), ("--n",)),
    (("--config", "tabletop.yaml", *JOB, "--seed", "-1"), ("--seed: -1 is negative",)),
    (("--config", "tabletop.yaml", *JOB, "--workers", "-1"), ("workers: -1",)),
    (("--config", "tabletop.yaml", *JOB, "--without", "colour"), ("did you mean 'colors'?",)),
    (("--config", "tabletop.yaml", *JOB, "--set", "views_per_scene"), ("KEY=VALUE",)),
    (("--config", "tabletop.yaml", *JOB, "--set", f"{COUNT}={{uniform_integer: [9, 2]}}"),
     ("[9, 2]", "low <= high")),
])  # fmt: skip
def test_misuse_exits_2(tmp_path: Path, arguments: tuple[str, ...], texts: tuple[str, ...]) -> None:
    """Usage and configuration errors name the argument or field, and the expected value."""
    assert_refused(tmp_path, arguments, 2, *texts)


def test_all_faults_of_a_file_are_told_at_once_with_their_places(tmp_path: Path) -> None:
    """Unknown key, wrong type, unknown plug-in, duplicate name: four faults, four lines."""
    (tmp_path / "wrong.yaml").write_text(
        "template: tabletop\n"
        "views_per_scene: many\n"
        "sed: 3\n"
        "randomizers:\n"
        "  - {type: lightning, name: lamps}\n"
        "  - {type: colors, name: paint}\n"
        "  - {type: colors, name: paint}\n"
        "sensors: [{type: rgb_camera, name: color, size_px: [64, 48], hfov_deg: 60}]\n"
    )
    done = gen_data("--config", "wrong.yaml", "--n", "1", cwd=tmp_path)

    assert done.returncode == 2
    for place in ("wrong.yaml:2:18:", "wrong.yaml:3:1:", "wrong.yaml:5:12:", "wrong.yaml:7:26:"):
        assert place in done.stderr
    assert "did you mean 'lighting'?" in done.stderr


def test_unknown_asset_exits_with_3(tmp_path: Path) -> None:
    """An asset id that nothing has, with the nearest that exists."""
    arguments = ("--config", "tabletop.yaml", *JOB, "--set", "elements.arm.asset=franka_pand")
    assert_refused(tmp_path, arguments, 3, "franka_pand", "did you mean 'franka_panda'?")


def user_assets(folder: Path) -> tuple[str, ...]:
    """Arguments of a job that puts the asset ``bad`` of a folder on the table."""
    return (
        "--config", "tabletop.yaml", *JOB,
        "--set", f"assets.folders=[{folder}]",
        "--set", "elements.clutter.assets={ids: [user/bad]}",
    )  # fmt: skip


TETRAHEDRON = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


@pytest.mark.parametrize(("files", "texts"), [
    ({
         "bad.obj": ("mtllib bad.mtl\nusemtl m\n" + TETRAHEDRON).encode(),
         "bad.mtl": b"newmtl m\nmap_Kd cracked.PNG\n",
         "cracked.PNG": b"\x89PNG\r\n\x1a\n" + bytes(range(200)),
     },
     ("cracked.PNG", "unreadable image", "save it again")),
    ({"bad.glb": b"glTF\x02\0\0\0" + bytes(range(99))}, ("bad.glb", "malformed glTF")),
    ({"bad.usdc": b"PXR-USDC" + bytes(range(256)) * 4}, ("bad.usdc", "unreadable USD")),
    ({"bad.usda": b"#usda 1.0\ndef Mesh {{{"}, ("bad.usda", "unreadable USD")),
], ids=["png", "glb", "usdc", "usda"])  # fmt: skip
def test_corrupt_files_of_assets_exit_with_3(
    tmp_path: Path, files: dict[str, bytes], texts: tuple[str, ...]
) -> None:
    """A picture, a mesh, a stage: the file is named, with a remedy."""
    (tmp_path / "mine").mkdir()
    for name, content in files.items():
        (tmp_path / "mine" / name).write_bytes(content)
    assert_refused(tmp_path, user_assets(tmp_path / "mine"), 3, *texts)


def test_template_that_cannot_be_satisfied_is_rejected_with_reasons(tmp_path: Path) -> None:
    """Sixty objects cannot lie on a small table: a bounded number of attempts, then why."""
    arguments = (
        "--config", "tabletop.yaml", *JOB,
        "--set", "elements.table.top_size_m=[0.7, 0.5]",
        "--set", "randomizers.clutter.count=60",
        "--set", "physics.layout_attempts_max=2",
        "--set", "physics.settle_time_s_max=0.5",
    )  # fmt: skip
    assert_refused(tmp_path, arguments, 6, "scene 0: no valid layout in 2 attempts", "Try: 1.")


def test_folder_with_other_things_in_it_exits_with_4(tmp_path: Path) -> None:
    """A folder without a data set is left unchanged."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("irreplaceable")
    assert_refused(tmp_path, ("--config", "tabletop.yaml", *JOB, "--out", "mine"), 4, "mine")
    assert (tmp_path / "mine" / "thesis.txt").read_text() == "irreplaceable"
