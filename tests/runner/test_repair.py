"""Damage of every kind is found, set aside and undone; no damage is ever sealed."""

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from gen_data.core.errors import DeterminismError, StorageError
from gen_data.runner.run import Settings
from gen_data.runner.verify import find_deviations
from tests.runner.doubles import make, tree_digest, write_raw_images

REPAIR = Settings(repair=True, write_media=write_raw_images)


def files_of(root: Path) -> list[Path]:
    return sorted(
        p for p in root.rglob("*") if p.is_file() and p.relative_to(root).parts[0] != "run"
    )


def flip(path: Path, bit: int) -> None:
    data = bytearray(path.read_bytes())
    data[bit // 8 % len(data)] ^= 1 << bit % 8
    # A new file: hard links must not spread the damage, and each one counts once.
    path.unlink()
    path.write_bytes(data)


def truncate(path: Path, bit: int) -> None:
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(data[: bit % len(data)])


def delete(path: Path, bit: int) -> None:
    del bit
    path.unlink()


def add_file(path: Path, bit: int) -> None:
    (path.parent / f"extra-{bit}").write_bytes(b"?")


def add_folder(path: Path, bit: int) -> None:
    (path.parent / f"empty-{bit}").mkdir()


def replace_by_link(path: Path, bit: int) -> None:
    del bit
    path.unlink()
    path.symlink_to("/etc/hostname")


def replace_by_folder(path: Path, bit: int) -> None:
    del bit
    path.unlink()
    path.mkdir()


def swap(path: Path, bit: int) -> None:
    """Swap two files with different contents, which may have equal sizes."""
    root = next(p for p in path.parents if (p / "shards").exists())
    others = [p for p in files_of(root) if p.read_bytes() != path.read_bytes()]
    other = others[bit % len(others)]
    data = path.read_bytes()
    path.unlink()
    path.write_bytes(other.read_bytes())
    other.unlink()
    other.write_bytes(data)


DAMAGES: tuple[Callable[[Path, int], None], ...] = (
    *(flip, flip, flip, truncate, delete, add_file, add_folder, replace_by_link, replace_by_folder),
    swap,
)


@pytest.mark.parametrize(
    "rounds", [40, pytest.param(1000, marks=pytest.mark.exhaustive)], ids=["some", "many"]
)
def test_every_damage_is_found_and_repaired(
    dataset: Path, rounds: int, reference_digest: str
) -> None:
    """Each one in any file, sealing files included; the bytes are the same afterwards."""
    rng = random.Random(rounds)
    for number in range(rounds):
        path, damage, bit = rng.choice(files_of(dataset)), rng.choice(DAMAGES), rng.getrandbits(30)
        damage(path, bit)
        case = f"round {number}: {damage.__name__} of {path.relative_to(dataset)}"
        assert find_deviations(dataset, full=True), f"{case}: not found"
        make(dataset, settings=REPAIR)
        assert tree_digest(dataset) == reference_digest, f"{case}: not repaired"
        assert find_deviations(dataset, full=True) == [], case
        shutil.rmtree(dataset / "run/quarantine", ignore_errors=True)


@pytest.mark.parametrize("name", ["000001.json", "000001/scenes.jsonl", "000001"])
@pytest.mark.parametrize("damage", [flip, truncate, delete, add_file])
def test_a_damaged_shard_is_made_again_without_the_option(
    dataset: Path, damage: Callable[[Path, int], None], name: str, reference_digest: str
) -> None:
    """The same command hashes existing files; extra files count in unfinished data sets."""
    path = dataset / "shards" / name
    if damage is add_file:
        (dataset / "manifest.json").unlink()
        path = dataset / "shards/000001/scenes.jsonl"
    if path.is_file():
        damage(path, 100)
    else:
        shutil.rmtree(path)
    assert make(dataset).made == 4
    assert tree_digest(dataset) == reference_digest


def test_damage_of_an_unfinished_data_set_is_not_sealed(
    dataset: Path, reference_digest: str
) -> None:
    """Resumption hashes shards of earlier runs; the log names the shard."""
    (dataset / "manifest.json").unlink()
    (dataset / "SHA256SUMS").unlink()
    (dataset / "shards/000002.json").unlink()
    flip(dataset / "shards/000000/color/rgb/000000001.png", 100)
    summary = make(dataset)
    assert summary.made == 4 + 2
    assert tree_digest(dataset) == reference_digest
    assert "1 damaged shard(s) are replaced: 0" in (dataset / "run/log.jsonl").read_text()
    assert (dataset / "run/quarantine/0-000000/color/rgb/000000001.png").exists()


def test_a_changed_digest_in_a_record_is_not_sealed(dataset: Path, reference_digest: str) -> None:
    """The record no longer matches its own checksum: nothing relies on it."""
    record = dataset / "shards/000001.json"
    text = record.read_text()
    digest = json.loads(text)["files"][0]["sha256"]
    record.write_text(text.replace(digest, digest[::-1]))
    (dataset / "manifest.json").unlink()
    assert make(dataset).made == 4
    assert tree_digest(dataset) == reference_digest


def test_a_plan_without_sums_is_restored_from_its_copy_by_its_configuration(
    dataset: Path, reference_digest: str
) -> None:
    """Also of an unfinished data set, whose plan nothing else names."""
    for name in ("manifest.json", "SHA256SUMS"):
        (dataset / name).unlink()
    flip(dataset / "plan.json", 1000)
    make(dataset, settings=REPAIR)
    assert tree_digest(dataset) == reference_digest
    # Another configuration is refused, and nothing is changed.
    (dataset / "plan.json").write_text("{")
    damaged = tree_digest(dataset)
    with pytest.raises(StorageError, match=r"not this data set's; nothing was changed"):
        make(dataset, 11, settings=REPAIR)
    assert tree_digest(dataset) == damaged


def test_other_bytes_than_the_sealed_ones_are_never_sealed(dataset: Path) -> None:
    (dataset / "shards/000001/color/rgb/000000005.png").unlink()

    def write_others(info: object, sample: object, shard_dir: Path) -> None:
        write_raw_images(info, sample, shard_dir)  # type: ignore[arg-type]
        for path in (shard_dir / "color/rgb").iterdir():
            path.write_bytes(b"other")

    with pytest.raises(DeterminismError, match=r"manifest\.json: shards/000001"):
        make(dataset, settings=Settings(write_media=write_others))

    assert not (dataset / "manifest.json").exists()
