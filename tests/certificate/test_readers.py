"""Readers of exports find what labels say in good exports, and name what is wrong in others."""

import shutil
from pathlib import Path

import pytest

import gen_data
from gen_data.core.reported import copies
from gen_data.lab.certificate.examined import Examined, Scope
from gen_data.lab.certificate.exports import check_exports
from gen_data.lab.certificate.finding import Finding, Status
from gen_data.lab.certificate.labelled_images import LabelledImage, LabelledObject, compare_images
from gen_data.lab.certificate.readers import READERS
from gen_data.lab.certificate.scoring import average_precision
from gen_data.runner.stored import StoredSamples
from tests.certificate.sealing import SMALL
from tests.tiers import cases

NAMES = cases(sorted(READERS), {"coco", "yolo"})
FORMATS = ", ".join(f"{{type: {name}}}" for name in READERS)
MASKED = {"coco", "webdataset", "huggingface"}
BOXED = MASKED | {"croissant", "hdf5", "tfrecord", "voc", "yolo"}
"""Formats whose readers compare masks, and boxes."""


DATA = {*(".json", ".tar", ".tfrecord", ".parquet", ".csv", ".hdf5"),
        *(".mcap", ".ply", ".usdc", ".txt", ".xml")}  # fmt: skip
"""Endings of files that readers need; of YOLO's tasks, only ``detect`` is read."""


def is_read(path: Path) -> bool:
    """Whether the reader of an export needs a file; that of VOC takes classes from the boxes."""
    is_needed = path.suffix in DATA and path.name != "labelmap.txt"
    return is_needed and "segment" not in path.parts


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("readers") / "table"
    overrides = (*SMALL["overrides"], f"exporters=[{FORMATS}]")
    with pytest.warns(gen_data.ConfigWarning, match="empty"):
        gen_data.generate(
            "tabletop.yaml", 2, out=folder, workers=0, seed=1, **{**SMALL, "overrides": overrides}
        )
    return folder


def read(folder: Path, name: str) -> Finding:
    """The finding about one export; skips the test if its reader is not installed."""
    findings = {f.subject: f for f in check_exports(Examined(StoredSamples(folder), Scope()))}
    if findings[name].status is Status.NOT_CHECKED:
        pytest.skip(findings[name].reason)
    return findings[name]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_readers_find_what_labels_say(exported: Path, name: str) -> None:
    """Two images whose boxes, and masks where the format has them, score 1."""
    finding = read(exported, name)
    assert finding.status is Status.PASSED, finding.evidence
    assert READERS[name].package in str(finding.figures["reader"])
    assert (finding.figures.get("images") == 2) == (name in BOXED)
    assert (finding.figures.get("AP of boxes") == 1.0) == (name in BOXED)
    assert (finding.figures.get("AP of masks") == 1.0) == (name in MASKED)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_export_without_its_main_file_fails(exported: Path, tmp_path: Path, name: str) -> None:
    """Whether the reader refuses it, or misses something."""
    copy = Path(shutil.copytree(exported, tmp_path / "copy"))
    files = [p for p in (copy / name).rglob("*") if is_read(p)]
    max(files, key=lambda p: (p.parent == copy / name, p.stat().st_size)).unlink()
    assert read(copy, name).status is Status.FAILED


def thing(category: str, *box: float) -> LabelledObject:
    return LabelledObject(category, box)  # type: ignore[arg-type]


def image(index: int, *objects: LabelledObject, split: str = "train") -> LabelledImage:
    return LabelledImage(index, "color", split, (64, 48), objects)


CUP, BOWL = thing("cup", 1, 2, 11, 22), thing("bowl", 30, 5, 40, 9)


@pytest.mark.parametrize(
    ("found", "facts"),
    [
        ([image(0, CUP, BOWL)], []),
        ([image(0, BOWL, CUP)], []),
        ([image(0, thing("cup", 1, 2, 11, 22.4), BOWL)], []),
        ([image(0, thing("cup", 1, 2, 11, 23), BOWL)],
         ["sample 0, color: cup: box (1, 2, 11, 23), expected (1, 2, 11, 22)"]),
        ([image(0, CUP)], ["sample 0, color: bowl at (30, 5, 40, 9): is missing"]),
        ([image(0, CUP, BOWL, BOWL)],
         ["sample 0, color: bowl at (30, 5, 40, 9): is not in the labels"]),
        ([image(0, CUP, BOWL, split="val")],
         ["sample 0, color: is in the split val, expected train"]),
        ([], ["sample 0, color: is missing"]),
        ([image(0, CUP, BOWL), image(7)], ["sample 7, color: is not an image of the data set"]),
        ([image(0, CUP, BOWL), image(0, CUP, BOWL)], ["sample 0, color: is there twice"]),
    ],
)  # fmt: skip
def test_contradictions_are_named(found: list[LabelledImage], facts: list[str]) -> None:
    """In either direction; half a pixel is tolerated here, whatever the order."""
    assert list(compare_images([image(0, CUP, BOWL)], found, 0.5)) == facts


def test_a_missing_object_lowers_the_score() -> None:
    """One class of two is not found at all: its AP is 0, so that the mean is 1/2."""
    truth = [image(0, CUP, BOWL)]
    assert average_precision(truth, truth, "bbox") == pytest.approx(1.0, abs=1e-12)
    assert average_precision(truth, [image(0, CUP)], "bbox") == pytest.approx(0.5)
    assert average_precision([image(0)], [image(0)], "bbox") == 1.0


@pytest.mark.slow
def test_images_that_are_lost_on_their_way_are_missing_by_design(tmp_path: Path) -> None:
    """About half of four."""
    faults = "sensors[0].faults={delivery: {lost: 0.5}}"
    formats = "exporters=[{type: coco}, {type: mcap}]"
    overrides = (*SMALL["overrides"], "splits={train: 1}", faults, formats)
    folder = tmp_path / "table"
    gen_data.generate(
        "tabletop.yaml", 4, out=folder, workers=0, seed=1, **{**SMALL, "overrides": overrides}
    )
    readings = [StoredSamples(folder).labelled(k).capture.readings["color"] for k in range(4)]
    assert 0 < sum(map(copies, readings)) < 4
    assert read(folder, "coco").status is Status.PASSED
    assert read(folder, "mcap").status is Status.PASSED
