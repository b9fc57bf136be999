"""Parts that different machines generated become the data set that one machine generates."""

from dataclasses import replace
from pathlib import Path

import pytest

from gen_data.api.generate import check_shards
from gen_data.core.errors import ConfigError, DeterminismError, NumericsError, StorageError
from gen_data.runner.merge import common_plan, gather_shards
from gen_data.runner.numerics_guard import NUMERICS_NAME
from gen_data.runner.run import Settings
from gen_data.runner.store import LocalStore
from gen_data.runner.verify import find_deviations
from tests.runner.doubles import make, tree_digest, write_raw_images

N, SHARD_SIZE = 11, 2


def make_part(out: Path, shards: range) -> Path:
    make(out, N, SHARD_SIZE, settings=Settings(shards=shards, write_media=write_raw_images))
    return out


def gather(parts: list[Path], out: Path, allow_mixed_numerics: bool = False) -> None:
    gather_shards(common_plan(parts), parts, LocalStore(out), allow_mixed_numerics)


def test_a_part_holds_its_shards_and_is_no_data_set_and_ranges_are_checked(tmp_path: Path) -> None:
    """Its summary states the remaining work; the same command later changes nothing."""
    settings = Settings(shards=range(4, 6), write_media=write_raw_images)
    for made in (3, 0):
        summary = make(tmp_path / "out", N, SHARD_SIZE, settings=settings)
        # Shard 5 is the last one and has one sample only.
        assert (summary.samples, summary.made, summary.shards_left) == (3, made, 4)
        assert summary.dataset_id == ""
        assert ("unfinished", "4 shards left to other runs") in summary.rows()
    assert not (tmp_path / "out/manifest.json").exists()
    assert {p.name for p in (tmp_path / "out/shards").iterdir()} == {
        "000004", "000004.json", "000005", "000005.json",
    }  # fmt: skip
    # The end may lie beyond the last shard, as in the last task of an array job.
    assert check_shards((4, 50), 6) == range(4, 6)
    for shards in ((6, 8), (3, 3), (4, 2), (-1, 2)):
        with pytest.raises(ConfigError, match=r"none of the 6 shards; expected FIRST:END"):
            check_shards(shards, 6)


def test_the_last_missing_part_finishes_the_data_set(tmp_path: Path) -> None:
    """In one folder, the run that makes the last shards merges and seals."""
    make_part(tmp_path / "out", range(3))
    summary = make(
        tmp_path / "out", N, SHARD_SIZE,
        settings=Settings(shards=range(3, 6), write_media=write_raw_images),
    )  # fmt: skip
    make(tmp_path / "whole", N, SHARD_SIZE)
    assert summary.shards_left == 0
    assert tree_digest(tmp_path / "out") == tree_digest(tmp_path / "whole")


@pytest.mark.parametrize(
    "ranges",
    [[range(3), range(3, 6)], [range(4, 6), range(2), range(2, 4)], [range(4), range(2, 6)],
     [range(1, 3)]],
    ids=["two", "in any order", "overlapping", "with a gap"],
)  # fmt: skip
def test_merged_parts_equal_one_run(tmp_path: Path, ranges: list[range]) -> None:
    """Byte for byte; missing shards are generated, and the parts stay."""
    parts = [make_part(tmp_path / f"part-{k}", shards) for k, shards in enumerate(ranges)]
    before = [tree_digest(part) for part in parts]
    gather(parts, tmp_path / "out")
    made = make(tmp_path / "out", N, SHARD_SIZE).made
    make(tmp_path / "whole", N, SHARD_SIZE)
    assert tree_digest(tmp_path / "out") == tree_digest(tmp_path / "whole")
    assert find_deviations(tmp_path / "out", full=True) == []
    assert [tree_digest(part) for part in parts] == before
    present = set().union(*ranges)
    assert made == sum(1 for i in range(N) if i // SHARD_SIZE not in present)


def test_merging_again_goes_on_and_a_shard_with_a_missing_file_is_missing(tmp_path: Path) -> None:
    """Shards that are there already are compared and kept."""
    parts = [make_part(tmp_path / "a", range(3)), make_part(tmp_path / "b", range(3, 6))]
    gather(parts[:1], tmp_path / "out")
    gather(parts, tmp_path / "out")
    assert make(tmp_path / "out", N, SHARD_SIZE).made == 0
    # It is generated, and the parts stay as they are.
    part = make_part(tmp_path / "part", range(2))
    lost = next((part / "shards/000001").rglob("*.png"))
    lost.unlink()
    gather([part], tmp_path / "lacking")
    assert LocalStore(tmp_path / "lacking").record(0) is not None
    assert LocalStore(tmp_path / "lacking").record(1) is None
    assert (part / "shards/000001.json").exists()


def test_damage_in_a_part_is_not_sealed(tmp_path: Path) -> None:
    part = make_part(tmp_path / "a", range(6))
    make(tmp_path / "whole", N, SHARD_SIZE)
    victim = next(p for p in sorted((part / "shards/000001").rglob("*")) if p.is_file())
    data = victim.read_bytes()
    victim.write_bytes(bytes([data[0] ^ 1]) + data[1:])
    gather([part], tmp_path / "out")
    make(tmp_path / "out", N, SHARD_SIZE)
    assert tree_digest(tmp_path / "out") == tree_digest(tmp_path / "whole")


def test_parts_of_different_data_sets_are_refused(tmp_path: Path) -> None:
    """The field that differs is named, and nothing is written."""
    make_part(tmp_path / "a", range(3))
    make(tmp_path / "b", N + 1, SHARD_SIZE)
    with pytest.raises(StorageError, match=r"part of another data set than .*a: n: "):
        gather([tmp_path / "a", tmp_path / "b"], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_shard_with_two_contents_is_refused(tmp_path: Path) -> None:
    """Two machines that disagree are a violation of determinism, whoever is right."""
    parts = [make_part(tmp_path / "a", range(3)), make_part(tmp_path / "b", range(2, 6))]
    store = LocalStore(parts[1])
    record = store.record(2)
    assert record is not None
    files = (replace(record.files[0], sha256="0" * 64), *record.files[1:])
    store.record_path(2).write_bytes(replace(record, files=files).to_bytes())
    with pytest.raises(DeterminismError, match="shard 2 came out differently"):
        gather(parts, tmp_path / "out")


def test_machines_that_compute_differently_do_not_mix(tmp_path: Path) -> None:
    """Unless the user accepts it; then all of them are recorded."""
    parts = [make_part(tmp_path / "a", range(3)), make_part(tmp_path / "b", range(3, 6))]
    for part, kind in zip(parts, ("cpu", "gpu"), strict=True):
        line = f'{{"digests":{{"render":"{kind}"}},"machine":"x","processor":"{kind}"}}\n'
        (part / "run" / NUMERICS_NAME).write_text(line)
    with pytest.raises(NumericsError, match="render"):
        gather(parts, tmp_path / "out")
    gather(parts, tmp_path / "out", allow_mixed_numerics=True)
    lines = (tmp_path / "out/run" / NUMERICS_NAME).read_text().splitlines()
    assert len(lines) == 2
