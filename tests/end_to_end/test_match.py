"""``gen-data match``: from a folder of recordings to a configuration that generates."""

import json
from pathlib import Path

import pytest

import gen_data
from gen_data.assemble.config import load_config
from tests.end_to_end.running import gen_data as run

BASE = """\
extends: tabletop.yaml
without: {sensors: all, exporters: all, annotations: all, randomizers: [distractors, weights]}
sensors:
  - type: rgb_camera
    name: color
    size_px: [192, 144]
    channels: [rgb]
    image_pipeline: {preset: industrial, focus: null}
exporters: [{type: coco}]
"""
REAL = """\
extends: base.yaml
seed: 99
views_per_scene: 1   # recordings are independent
sensors:
  - name: color
    image_pipeline:
      {exposure_compensation_ev: -1.5, image_sensor: {full_well_e: 2000}, jpeg_quality: 92}
randomizers: [{name: orbit, distance_m: {uniform: [0.6, 1.0]}}]
"""


def record(place: Path, n: int) -> Path:
    (place / "configs").mkdir()
    (place / "configs" / "base.yaml").write_text(BASE, encoding="utf-8")
    (place / "configs" / "real.yaml").write_text(REAL, encoding="utf-8")
    only_train = ("splits={train: 1, val: 0, test: 0}",)
    real = place / "configs" / "real.yaml"
    gen_data.generate(real, n=n, out=place / "real", workers=0, overrides=only_train)
    return place


@pytest.fixture(scope="module")
def unmatched(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("unmatched"), 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = record(tmp_path_factory.mktemp("match"), 20)
    arguments = ("real", "configs/base.yaml", "--out", "fits/a.yaml", "--scenes", "10")
    done = run("match", *arguments, cwd=place, COLUMNS="200")
    assert done.returncode == 0, done.stderr
    (place / "stdout.txt").write_text(done.stdout, encoding="utf-8")
    return place


@pytest.mark.slow
def test_the_fitted_configuration_extends_the_given_one(folder: Path) -> None:
    """Wherever it lies; it differs in the fitted fields only, each under its interval."""
    text = (folder / "fits" / "a.yaml").read_text(encoding="utf-8")
    fitted = load_config(str(folder / "fits" / "a.yaml"))

    assert "extends: ../configs/base.yaml\n" in text
    assert "# exposure: " in text
    assert ", n = 20\n" in text
    assert "jpeg_quality: 92\n" in text
    (camera,) = fitted.sensors
    assert camera.image_pipeline.preset == "industrial"
    assert camera.size_px == (192, 144)


@pytest.mark.slow
def test_the_report_has_the_same_figures_in_all_forms(folder: Path) -> None:
    """The terminal, JSON and the page; known values are within three standard errors.

    Intervals of 95 % reach over 1.96 of them: with each change of the scenes that are drawn, one of
    three intervals would exclude its truth once in seven times.
    """
    figures = json.loads((folder / "fits" / "a.json").read_text(encoding="utf-8"))
    rows = {row["name"]: row for row in figures["quantities"]}
    page = (folder / "fits" / "a.html").read_text(encoding="utf-8")
    shown = (folder / "stdout.txt").read_text(encoding="utf-8")

    for name, truth in (("exposure", -1.5), ("noise", 2000.0), ("box sizes", 1.5)):
        low, high = rows[name]["low"], rows[name]["high"]
        assert abs(truth - 0.5 * (low + high)) <= 3.0 / 1.96 * 0.5 * (high - low), name
    assert rows["reflectance gain"]["note"] == "no scans"
    assert figures["files"][0]["read"] == "20"
    for name in rows:
        assert name in page
        assert name in shown
    (level,) = (row for row in figures["statistics"] if row["name"] == "mean log2 of luminance")
    assert level["apart_after"] < level["apart_before"]


@pytest.mark.slow
def test_a_fitted_configuration_can_be_planned(folder: Path) -> None:
    done = run("plan", "fits/a.yaml", "--n", "4", cwd=folder)

    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("arguments", "message"), [
    (("absent", "configs/base.yaml"), "absent: is not a folder; expected one"),
    (("real", "configs/base.yaml", "--camera", "colour"), "--camera: there is no such sensor"),
    (("real", "configs/base.yaml", "--scenes", "1"), "scenes: 1 is too few; expected"),
    (("real", "configs/base.yaml", "--out", "a.txt"), "a.txt; expected a name"),
    (("real", "configs/base.yaml", "--out", "configs/base.yaml"), "configuration itself"),
    (("real", "real"), "real: is a folder; expected a configuration to extend"),
    (("s3://bucket/real", "configs/base.yaml"), "s3://bucket/real"),
])  # fmt: skip
def test_wrong_arguments_are_told(
    unmatched: Path, arguments: tuple[str, ...], message: str
) -> None:
    done = run("match", *arguments, cwd=unmatched)

    assert done.returncode in (2, 4)
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not (unmatched / "matched.yaml").exists()
