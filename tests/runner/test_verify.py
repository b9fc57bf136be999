"""verify: every deviation from the manifest is found and named."""

import random
import re
from pathlib import Path

import pytest

from gen_data.core.errors import VerificationError
from gen_data.runner.verify import find_deviations, verify


def flip_bit(path: Path, bit: int) -> None:
    data = bytearray(path.read_bytes())
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


@pytest.mark.parametrize("full", [False, True])
def test_an_untouched_data_set_is_accepted(dataset: Path, full: bool) -> None:
    """The report counts samples and files; copies of hard links are as good as links."""
    report = verify(dataset, full=full)
    assert report.samples == 10
    assert report.files == sum(p.is_file() for p in dataset.rglob("*") if "run" not in p.parts)
    assert ("sha256" in str(report)) == full


def test_every_flipped_bit_is_found_by_full_verification(dataset: Path) -> None:
    """150 random single bits in random files: 150 found, each naming its file."""
    rng = random.Random(0)
    paths = sorted(p for p in dataset.rglob("*") if p.is_file() and "run" not in p.parts)
    sealing = ("SHA256SUMS", "manifest.json", "plan.json")
    for _ in range(150):
        path = rng.choice(paths)
        bit = rng.randrange(path.stat().st_size * 8)
        flip_bit(path, bit)
        named = [finding.path for finding in find_deviations(dataset, full=True)]
        name = path.relative_to(dataset).as_posix()
        assert named, f"bit {bit} of {name} went unnoticed"
        assert name in named or name in sealing, f"bit {bit} of {name}: only {named}"
        flip_bit(path, bit)
    assert find_deviations(dataset, full=True) == []


@pytest.mark.parametrize(
    ("path", "data", "message"),
    [("shards/000001/color/rgb/000000006.png", b"?", " (sample 6): has 1 bytes instead of 144"),
     ("shards/000002/scenes.jsonl", None, " (samples 8 to 9): is missing"),
     ("lines/images/000000003_color.png", None, " (sample 3): is missing"),
     ("lines/all.jsonl", b"short", ": has 5 bytes instead of"),
     ("notes.txt", b"mine", ": does not belong to the data set"),
     ("shards/000001.json", None, " (samples 4 to 7): is missing")],
)  # fmt: skip
def test_deviations_are_told(dataset: Path, path: str, data: bytes | None, message: str) -> None:
    """Once each; sizes, missing and extra files are seen without hashing."""
    if data is None:
        (dataset / path).unlink()
    else:
        (dataset / path).write_bytes(data)
    with pytest.raises(VerificationError, match=re.escape(f"1 deviation(s):\n  {path}{message}")):
        verify(dataset)


def test_swapped_files_are_found(dataset: Path) -> None:
    """Equal sizes, valid content, wrong places: both are named."""
    first = dataset / "shards/000000/color/rgb/000000000.png"
    second = dataset / "shards/000000/color/rgb/000000001.png"
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    assert [finding.samples for finding in find_deviations(dataset, full=True)] == [
        "sample 0",
        "sample 1",
    ]


def test_all_deviations_are_listed_and_no_data_set_is_without_manifest(dataset: Path) -> None:
    """Interrupted runs are told apart from damaged ones."""
    for index in (1, 4, 8):
        (dataset / f"lines/images/{index:09d}_color.png").unlink()
    with pytest.raises(VerificationError, match=r"3 deviation\(s\)") as caught:
        verify(dataset)
    assert all(f"(sample {index})" in str(caught.value) for index in (1, 4, 8))
    (dataset / "manifest.json").unlink()
    with pytest.raises(VerificationError, match=r"not a finished data set.*manifest\.json"):
        verify(dataset)


def test_a_record_edited_together_with_its_file_is_found(dataset: Path) -> None:
    """Whoever changes a file and its record still disagrees with the manifest."""
    record = dataset / "shards/000000.json"
    record.write_text(record.read_text().replace('"rejections":1', '"rejections":0'))
    assert [f.path for f in find_deviations(dataset)] == ["shards/000000.json"]
