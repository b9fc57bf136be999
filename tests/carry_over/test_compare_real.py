"""``report --compare-real``: planted differences are named first, with their fields."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from gen_data.cli.report_command import report
from gen_data.core.errors import ConfigError, GenDataError, NoLabels, StorageError
from gen_data.lab.carry_over.carry_over_report import make_tables
from gen_data.lab.carry_over.compare_real import CarryOver, compare_real
from tests.carry_over.labelled import write_coco


def run(*arguments: str | Path) -> Result:
    return CliRunner(env={"COLUMNS": "80"}).invoke(report, [*map(str, arguments)])


@pytest.fixture
def real(tmp_path: Path) -> Path:
    return write_coco(tmp_path / "real", 5)


def test_a_set_compared_with_itself_names_nothing(real: Path) -> None:
    found = compare_real(str(real), real)
    assert not any(row.differs for row in found.rows)
    assert len(found.rows) == 2 + 3 * 9
    assert found.remedies == ()


@pytest.mark.parametrize(
    ("planted", "quantities"),
    [({"scale": 2.0}, {"long side", "height px", "area share", "centre x", "centre y"}),
     ({"exposure": 2.0}, {"grey", "grey in box", "dark share", "dark in box"}),
     ({"most": 9}, {"count", "area share"})],
)  # fmt: skip
def test_a_planted_difference_is_all_that_is_named(
    planted: dict[str, Any], quantities: set[str], real: Path, tmp_path: Path
) -> None:
    """Larger boxes, a longer exposure, more objects."""
    found = compare_real(str(write_coco(tmp_path / "ours", 6, **planted)), real)
    differing = [row for row in found.rows if row.differs]
    assert {row.quantity for row in differing} <= quantities
    assert differing[0].quantity in quantities - {"centre x", "centre y"}
    assert differing[0].direction == "larger"


def test_names_correspond_but_for_case_or_by_an_option(real: Path, tmp_path: Path) -> None:
    """Two real classes may be one of ours; boxes of classes without a counterpart are counted."""
    ours = write_coco(tmp_path / "ours", 6, names=("Cup", "dish"))
    by_case = compare_real(str(ours), real)
    both = compare_real(str(ours), real, classes=["cup=dish", "plate=dish"])
    assert {row.label for row in by_case.rows} == {"pictures", "Cup"}
    assert [[*side] for side in by_case.unmatched] == [["plate"], ["dish"]]
    assert {row.label for row in both.rows} == {"pictures", "dish"}
    assert [[*side] for side in both.unmatched] == [[], ["Cup"]]


def test_the_command_prints_80_columns_and_writes_a_page(real: Path, tmp_path: Path) -> None:
    """The page has all rows and requests nothing; the file next to it has the figures."""
    ours = write_coco(tmp_path / "ours", 6, scale=2.0, names=("cup", "plate", "fork"))
    page = tmp_path / "page.html"
    done = run(ours, "--compare-real", real, "--html", page)
    assert done.exit_code == 0, done.output
    without_paths = done.output.replace(str(tmp_path), "").replace(str(real), "")
    assert max(map(len, without_paths.splitlines())) <= 80
    assert "not compared: class fork" in done.output
    assert "set randomizer camera_pose: distance_m" in done.output.replace("\n", " ").replace(
        "  ", ""
    )
    text = page.read_text("utf-8")
    assert "Without a difference" in text
    assert "default-src 'none'" in text
    figures = json.loads(page.with_suffix(".json").read_text("utf-8"))
    assert figures["layout"] == "coco"
    assert figures["rows"][0]["differs"]
    assert all(row["change"] for row in figures["rows"] if row["differs"])


def error_of(*arguments: str | Path) -> GenDataError:
    done = run(*arguments)
    assert isinstance(done.exception, GenDataError), done.output
    return done.exception


def test_every_unusable_folder_has_one_error_with_its_exit_code(real: Path, tmp_path: Path) -> None:
    """No folder, no labels, no image, no object."""
    (tmp_path / "empty").mkdir()
    bare = write_coco(tmp_path / "bare", 1, pictures=3)
    shutil.rmtree(bare / "images")
    write_coco(tmp_path / "blank", 1, names=())
    for folder, kind, text in (
        ("reall", StorageError, "there is no folder"),
        ("empty", ConfigError, "there are no labels"),
        ("bare", StorageError, "be used: 3 x image that is missing (such as 0.png);"),
        ("blank", NoLabels, "its labels have no object"),
    ):
        error = error_of(real, "--compare-real", tmp_path / folder)
        assert type(error) is kind
        assert text in str(error)
        assert str(tmp_path / folder) in str(error)
    assert [kind.exit_code for kind in (ConfigError, StorageError, NoLabels)] == [2, 4, 9]


def test_classes_without_counterpart_are_refused(real: Path, tmp_path: Path) -> None:
    ours = write_coco(tmp_path / "ours", 6, names=("fork",))
    error = error_of(ours, "--compare-real", real)
    assert type(error) is ConfigError
    assert str(error) == (
        f"{real}: no class agrees with one of {ours}; it has cup, plate, and {ours} has fork: "
        "name pairs with --classes REAL=OURS"
    )
    wrong = error_of(ours, "--compare-real", real, "--classes", "cups=fork")
    assert str(wrong) == (
        f"--classes cups=fork: {real} has no class 'cups'; expected one of cup, plate "
        "(did you mean 'cup'?), as REAL=OURS"
    )
    for pairs, fact in ((["cup"], "expected REAL=OURS"), (["cup=fork"] * 2, "'cup' has a class")):
        options = [word for pair in pairs for word in ("--classes", pair)]
        assert fact in str(error_of(ours, "--compare-real", real, *options))
    assert "exclude each other" in str(error_of(real, "--compare", real, "--compare-real", real))


SCENE = """\
elements:
  - {type: surface, name: table, asset: table, top_size_m: [0.5, 0.5], height_m: 0.7}
  - {type: objects, name: clutter, on: table, count: 3, assets: {ids: [apple]}, placement: scatter}
"""
CONFIG = """\
template: scene.yaml
randomizers:
  - {type: objects, name: clutter, count: {uniform_integer: [2, 4]}}
  - {type: lighting, name: lamps, count: 1, illuminance_lux: 500}
  - type: camera_pose
    name: orbit
    distance_m: {uniform: [0.9, 1.1]}
    elevation_deg: {uniform: [40, 60]}
sensors: [{type: rgb_camera, name: color, size_px: [96, 72], hfov_deg: 40, channels: [rgb]}]
annotations: [boxes2d]
splits: {train: 1, val: 0, test: 0}
exporters: [{type: yolo, tasks: [detect]}]
"""


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("config")
    (folder / "scene.yaml").write_text(SCENE)
    (folder / "ours.yaml").write_text(CONFIG)
    return folder / "ours.yaml"


@pytest.fixture(scope="module")
def ours(config: Path) -> Path:
    from gen_data.api.generate import generate

    generate(config, 14, out=config.parent / "ours", workers=0)
    return config.parent / "ours"


def compare_planted(ours: Path, config: Path, override: str) -> CarryOver:
    """Our data set beside one of the same configuration with one changed field."""
    from gen_data.api.generate import generate

    planted = config.parent / "planted"
    shutil.rmtree(planted, ignore_errors=True)
    generate(config, 10, out=planted, seed=3, overrides=[override], workers=0)
    return compare_real(str(ours), planted)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("override", "quantities", "change"),
    [
        ("randomizers.orbit.distance_m={uniform: [0.6, 0.7]}", {"long side", "height px"},
         "lower randomizers.orbit.distance_m"),
        ("sensors.color.image_pipeline.exposure_compensation_ev=1.5", {"grey", "dark share"},
         "raise sensors.color.image_pipeline.exposure_compensation_ev"),
        ("randomizers.clutter.count=8", {"count"}, "raise randomizers.clutter.count"),
    ],
)  # fmt: skip
def test_a_planted_field_is_named_first(
    override: str, quantities: set[str], change: str, ours: Path, config: Path
) -> None:
    """Sizes, exposure and numbers of a data set that the product itself made; YOLO's labels."""
    found = compare_planted(ours, config, override)
    assert found.real.layout == "yolo"
    assert found.rows[0].differs
    assert found.rows[0].quantity in quantities
    assert found.remedies[0][0] == change


@pytest.mark.slow
def test_a_configuration_is_sampled_and_exported_in_the_layout_of_the_folder(
    real: Path, config: Path
) -> None:
    """COCO's, although the configuration writes YOLO; cups are apples here."""
    found = compare_real(str(config), real, classes=["cup=apple"], n=4)
    assert (found.ours.layout, len(found.ours.pictures)) == ("coco", 4)
    assert ("apple", "count") in {(row.label, row.quantity) for row in found.rows} or found.few


@pytest.mark.parametrize(
    ("pictures", "text"),
    [(12, "none of whole pictures; no object was compared"),
     (5, "nothing was compared: every statistic has fewer than 10 values")],
)  # fmt: skip
def test_differences_of_nothing_are_not_none(pictures: int, text: str, tmp_path: Path) -> None:
    """Both sides list bowls and have none; few pictures give no statistic."""
    folders = [tmp_path / "real", tmp_path / "ours"]
    for folder, name in zip(folders, ("cup", "fork"), strict=True):
        path = write_coco(folder, 5, pictures=pictures, names=(name,))
        path /= "annotations/instances_all.json"
        content = json.loads(path.read_text())
        content["categories"].append({"id": 9, "name": "bowl"})
        path.write_text(json.dumps(content))
    found = compare_real(str(folders[1]), folders[0])
    (table,) = (table for table in make_tables(found) if table.title == "Differences")
    assert [row[0] for row in table.rows] == [text]


@pytest.mark.parametrize(
    "arguments",
    [["--classes", "a=b"], ["--pictures", "9"], ["--n", "60"],
     ["--scenes", "9", "--compare-real", "real"]],
)  # fmt: skip
def test_options_without_an_effect_are_refused(real: Path, arguments: list[str]) -> None:
    place = "with" if "--scenes" in arguments else "without"
    text = f"{arguments[0]}: has no effect {place} --compare-real; leave it out"
    assert str(error_of(real, *arguments)) == text


def test_a_page_that_cannot_be_written_is_refused_before_samples_are_made(real: Path) -> None:
    error = error_of("tabletop.yaml", "--compare-real", real, "--html", real)
    assert str(error) == f"{real}: Is a directory; choose another --html"
