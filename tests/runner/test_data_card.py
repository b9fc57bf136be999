"""Card and metadata at the root of a data set."""

import hashlib
import json
import logging
import shutil
import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core.asset_types import Asset
from gen_data.core.interfaces import DatasetInfo, Publication
from gen_data.runner.data_card import DatasetFacts, croissant_json, data_card
from gen_data.runner.licence_table import licence_table, licences_in
from gen_data.runner.run import Settings
from gen_data.runner.shard_record import SplitCount
from tests.runner.doubles import FakePipeline, Trouble, fake_plan, make

PUBLICATION = Publication(
    title="Mugs",
    description="Mugs and bowls.",
    license="CC-BY-4.0",
    creators=("A. Author",),
    date_published="2026-01-31",
    cite_as="@misc{mugs}",
    version="2.1.0",
)
LICENCES = "# Assets\n\n| source | licence | author | assets |\n|---|---|---|---|\n"
LICENCES += "| here | MIT | me | mug |\n| there | CC0-1.0 | you | bowl |\n"


def facts(publication: Publication = PUBLICATION) -> DatasetFacts:
    info: DatasetInfo = FakePipeline(10, Trouble()).info
    counts = (SplitCount("train", 8, {"mug": 8}), SplitCount("val", 2, {"bowl": 1}))
    info = replace(info, publication=publication)
    return DatasetFacts(fake_plan(), info, counts, 5, ("coco",), LICENCES)


def test_the_card_counts_and_states_the_publication_or_licences_of_assets() -> None:
    """Splits, categories, sensors, licences and citation."""
    card = data_card(facts())
    assert card.startswith("# Mugs\n\nMugs and bowls.\n")
    for line in (
        "10 samples of 5 scenes: 2 views per scene, one instant per view.",
        "| train | 8 | 8 |",
        "| 1 | bowl | 0 | 1 |",
        "| color | camera | `shards/*/color/rgb/` | photograph, 8-bit sRGB | every step |",
        "- [`coco/`](coco/)",
        "The data set: CC-BY-4.0.",
        "in its scenes: CC0-1.0, MIT.",
        "Creators: A. Author.",
        "@misc{mugs}",
    ):
        assert line in card
    bare = facts(Publication())
    assert "The publisher has stated no licence." in data_card(bare)
    assert "## Publication" not in data_card(bare)
    metadata = json.loads(croissant_json(bare))
    assert (metadata["license"], metadata["name"]) == (["CC0-1.0", "MIT"], "fake")
    few = facts()
    many = replace(few, plan=replace(few.plan, n=90), info=replace(few.info, n=90))
    assert len(croissant_json(many)) == len(croissant_json(few))


def test_texts_of_users_are_no_html_in_the_card_and_the_table_of_licences() -> None:
    """Pages that show Markdown run HTML in it; a bar would begin another cell."""
    tag = "<img src=x>"
    mug = Asset("user/mug", "object", "mug", (), f"{tag}|A", tag, f"{tag}\n# b", "")
    table = licence_table([mug])
    named = replace(
        PUBLICATION, title=tag, description=tag, license=tag, creators=(tag,), cite_as="```" + tag
    )
    card = data_card(replace(facts(named), asset_licences=table))
    assert licences_in(table) == [f"{tag}|A"]
    assert len(table.splitlines()) == 5
    assert tag not in table
    before, quoted, after = card.partition("```\n" + tag + "\n```")
    assert quoted
    assert tag not in before + after
    assert licences_in("# Assets\n\nnone\n") == []
    assert licences_in(LICENCES.rpartition("|---")[0]) == []


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        (None, ["at least 16 pixels are visible, in a box of at least 3 pixels ", "leave out"]),
        (
            {"min_visible_px": 40, "min_box_px": 8, "min_visible_fraction": 0.2, "box3d": "all"},
            ["at least 40 pixels and 0.2 of the silhouette are visible, in a box of at least 8 ",
             "with the mirrors of vehicles"],
        ),
        ({"include_invisible": True}, ["All objects are annotated in every image"]),
        ({"map": {"min_box_px": 20, "ignore": ["bowl"]}}, ["`min_box_px: 20, ignore: [bowl]`"]),
    ],
)  # fmt: skip
def test_a_card_states_what_has_no_labels(labels: dict[str, Any] | None, words: list[str]) -> None:
    """The configuration's limits, or the default ones."""
    given = {} if labels is None else {"labels": labels}
    plan = replace(fake_plan(), config={**fake_plan().config, **given})
    card = data_card(replace(facts(), plan=plan))
    for sentence in words:
        assert sentence in card


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("card") / "out"
    make(out, settings=Settings())
    return out


def test_both_files_are_sealed(dataset: Path) -> None:
    """They are among the sums, and the plan's digest is the right one."""
    sums = (dataset / "SHA256SUMS").read_text()
    for name in ("README.md", "croissant.json"):
        assert f"{hashlib.sha256((dataset / name).read_bytes()).hexdigest()}  {name}\n" in sums
    (plan,) = (
        item
        for item in json.loads((dataset / "croissant.json").read_text())["distribution"]
        if item["@type"] == "cr:FileObject"
    )
    assert plan["sha256"] == hashlib.sha256((dataset / "plan.json").read_bytes()).hexdigest()


def faults(folder: Path) -> list[str]:
    """Differences between the record sets that mlcroissant loads, and the labels and images."""
    logging.disable()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            import mlcroissant

            loaded = mlcroissant.Dataset(jsonld=str(folder / "croissant.json"))
            rows: list[dict[str, Any]] = list(loaded.records("samples"))
            images = list(loaded.records("color-rgb-images"))
    except (mlcroissant.ValidationError, mlcroissant.GenerationError, ValueError) as error:
        return [f"{type(error).__name__}: {error}"]
    finally:
        logging.disable(logging.NOTSET)
    found = []
    if sorted(row["color-rgb-images/sample"] for row in images) != list(range(10)):
        found.append("samples of images")
    if {row["color-rgb-images/content"].size for row in images} != {(8, 6)}:
        found.append("sizes of images")
    read = {row["samples/index"]: (row["samples/split"], row["samples/categories"]) for row in rows}
    written = {
        row["index"]: (row["split"].encode(), [i["category"].encode() for i in row["instances"]])
        for path in folder.glob("shards/*/labels.jsonl")
        for row in map(json.loads, path.read_text().splitlines())
    }
    return found if read == written else [*found, "samples"]


@pytest.mark.slow
def test_mlcroissant_loads_samples_and_images(dataset: Path) -> None:
    """Both record sets are complete and equal the labels."""
    assert faults(dataset) == []


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.slow
@pytest.mark.parametrize(
    "damage",
    [lambda d: edit(d / "croissant.json", '"column": "split"', '"column": "half"'),
     lambda d: edit(d / "croissant.json", "shards/*/color/rgb", "shards/*/colour/rgb"),
     lambda d: edit(d / "croissant.json", '"jsonPath": "category"', '"jsonPath": "name"'),
     lambda d: (d / "shards/000001/color/rgb/000000005.png").unlink()],
    ids=["no such column", "no such folder", "another key", "image missing"],
)  # fmt: skip
def test_damage_is_found(damage: Callable[[Path], Any], dataset: Path, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(dataset, copy)
    damage(copy)
    assert faults(copy)
