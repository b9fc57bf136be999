"""Mistakes of the first day: each message has the text to type instead."""

from pathlib import Path
from typing import Any

import pytest

import gen_data
from gen_data.core.errors import GenDataError, did_you_mean, one_of
from tests.end_to_end.running import gen_data as run


@pytest.mark.parametrize(("arguments", "expected"), [
    (("generate", "tabletop.yaml", "--n", "3"), "gen-data --config tabletop.yaml --n 3"),
    (("run", "--config", "tabletop.yaml", "--n", "3"), "gen-data --config tabletop.yaml --n 3"),
    (("tabletop.yaml", "-n", "3"), "gen-data --config tabletop.yaml -n 3"),
    (("tabletop",), "gen-data --config tabletop"),
    (("mine.yaml", "--n", "3"), "gen-data --config mine.yaml --n 3"),
    (("verfy", "out/x"), "did you mean 'verify'?"),
    (("frobnicate",), "there is no command 'frobnicate'; see: gen-data --help"),
])  # fmt: skip
def test_what_is_no_command_is_told_what_was_probably_meant(
    arguments: tuple[str, ...], expected: str, tmp_path: Path
) -> None:
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert expected in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("arguments", [
    ("verify", "nosuch"),
    ("certify", "nosuch"),
    ("export", "nosuch", "-f", "coco", "-o", "x"),
    ("rerender", "nosuch", "-o", "x"),
    ("report", "nosuch"),
    ("repair", "nosuch"),
])  # fmt: skip
def test_a_missing_folder_is_called_so(arguments: tuple[str, ...], tmp_path: Path) -> None:
    """With the nearest name next to it."""
    (tmp_path / "nosuchh").mkdir()
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode != 0
    assert "there is no folder 'nosuch' (did you mean 'nosuchh'?)" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_configurations_are_suggested_only_if_similar(tmp_path: Path) -> None:
    """The ending .yaml does not count as similar; thirty names do not help."""
    done = run("plan", "nosuch.yaml", "--n", "3", cwd=tmp_path)
    assert "there is no configuration 'nosuch.yaml'" in done.stderr
    assert "did you mean" not in done.stderr
    assert "gen-data describe" in done.stderr
    assert len(done.stderr) < 300

    near = run("plan", "tabeltop.yaml", "--n", "3", cwd=tmp_path)
    assert "did you mean 'tabletop.yaml'?" in near.stderr


@pytest.mark.parametrize(
    "command", [("repro", "-i", "0"), ("sample", "-i", "0", "-o", "x"), ("contact-sheet",)]
)
def test_commands_that_take_a_configuration_or_a_data_set_expect_both(
    command: tuple[str, ...], tmp_path: Path
) -> None:
    """In one line, whether the name is missing or the folder holds neither."""
    (tmp_path / "photos").mkdir()

    missing = run(*command, "nosuch", cwd=tmp_path)
    folder = run(*command, "photos", cwd=tmp_path)

    assert missing.returncode == folder.returncode == 2
    assert missing.stderr == (
        "gen-data: there is no configuration 'nosuch'; looked for 'nosuch'; expected a file, the "
        "folder of a data set or a shipped name, which gen-data describe lists\n"
    )
    assert folder.stderr == (
        "gen-data: 'photos' is a folder; expected a file with a configuration, or the folder of a "
        "data set\n"
    )


def test_many_names_are_the_nearest_five() -> None:
    few, many = ["coco", "voc"], [f"name_{k}" for k in range(100)]
    assert one_of("cocoo", few) == "expected one of coco, voc (did you mean 'coco'?)"
    text = one_of("name_1", [n for n in many if n != "name_1"])
    assert text.count("name_") <= 6
    assert "99" in text
    assert did_you_mean("nosuch.yaml", ["closeup.yaml"]) == ""
    assert did_you_mean("closup.yaml", ["closeup.yaml"]) == " (did you mean 'closeup.yaml'?)"


DATA = gen_data.Dataset("tabletop.yaml", n=2)


@pytest.mark.parametrize("call", [
    lambda: gen_data.Dataset("tabletop.yaml", n=1.5),
    lambda: gen_data.Dataset("tabletop.yaml", n="5"),
    lambda: gen_data.Dataset("tabletop.yaml", seed=float("nan")),
    lambda: gen_data.Dataset("tabletop.yaml", seed=1.5),
    lambda: gen_data.generate("tabletop.yaml", 1.5, out="x"),
    lambda: gen_data.generate("tabletop.yaml", "5", out="x"),
    lambda: gen_data.open(b"x"),
    lambda: gen_data.open("a\0b"),
    lambda: gen_data.open("ftp://host/data"),
    lambda: gen_data.open(None),
    lambda: gen_data.Dataset(7),
    lambda: gen_data.Dataset("tabletop.yaml", n=2)["val"],
    lambda: gen_data.Dataset("tabletop.yaml", n=2)[0.5],
    lambda: gen_data.Dataset("tabletop.yaml", n=2).relabelled([1]),
    lambda: gen_data.Loader(DATA, str, batch_size=1.5),
    lambda: gen_data.Loader(DATA, str, rank="0"),
    lambda: gen_data.Loader(DATA, str).load_state_dict({"x": 1}),
    lambda: gen_data.Loader(DATA, str).load_state_dict({"epoch": "1", "position": 0, "seed": 0}),
])  # fmt: skip
def test_misuse_from_python_is_one_of_our_errors(call: Any) -> None:
    """Not TypeError, KeyError or ValueError from inside."""
    with pytest.raises(GenDataError) as error:
        call()
    assert "\n" not in str(error.value).split("\n   ")[0]


@pytest.fixture(scope="module")
def data_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The plan and manifest of a data set are enough for messages about formats."""
    folder = tmp_path_factory.mktemp("formats")
    made = run(
        "--config", "tabletop.yaml", "--n", "1", "--workers", "0", "--out", "small",
        "--set", "sensors[0].size_px=[64, 48]", cwd=folder,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    return folder


@pytest.mark.slow
@pytest.mark.parametrize(("text", "expected"), [
    ("kitty", "--format kitty: unknown exporter 'kitty'"),
    ("{type: kitti, rectfy: true}", "--format '{type: kitti, rectfy: true}': rectfy: unknown"),
    ("{type: kitti, cameras: [colr]}", "cameras: 'colr' fits no sensor"),
])  # fmt: skip
def test_faults_of_formats_name_the_option(text: str, expected: str, data_set: Path) -> None:
    """Not the override that it becomes, nor JSON that nobody typed."""
    done = run("export", "small", "--out", "x", "--format", text, cwd=data_set)
    assert done.returncode == 2
    assert expected in done.stderr
    assert "did you mean" in done.stderr
    assert "--set" not in done.stderr
    assert '"type"' not in done.stderr
    assert len(done.stderr.splitlines()) == 1
