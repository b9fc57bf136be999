"""Whether a data set fits, before anything is written and while it grows."""

from pathlib import Path
from typing import NoReturn

import pytest

from gen_data.core.errors import StorageError
from gen_data.runner import merge, store
from gen_data.runner.free_space import DOCUMENTS_BYTES, RESERVE_BYTES, SpaceCheck
from gen_data.runner.merge import gather_shards
from gen_data.runner.plan import plan_bytes
from gen_data.runner.run import Settings
from gen_data.runner.store import LocalStore
from tests.runner.doubles import fake_plan, make, write_raw_images

FREE_BYTES = 8_000_000
"""Of the disk in these tests."""


@pytest.fixture(autouse=True)
def _disk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(store, "free_bytes", lambda path: FREE_BYTES)


def estimated(sample_bytes: float, *, force: bool = False) -> Settings:
    return Settings(write_media=write_raw_images, sample_bytes=sample_bytes, is_forced=force)


def test_a_data_set_that_will_not_fit_is_refused_before_anything_is_written(tmp_path: Path) -> None:
    """Ten samples of 1 MB on a disk with 8 MB: need, free space and remedies; no shard.

    Plan, card, sums and manifest take 0.2 MB more.
    """
    with pytest.raises(StorageError) as caught:
        make(tmp_path / "out", settings=estimated(1e6))
    assert str(caught.value) == (
        f"{tmp_path}/out: 10 samples need about 10.2 MB and 8.0 MB are free; expected 10.7 MB or "
        "more.\n  Make room, choose a folder on another disk with --out, reduce --n, or generate "
        "until the disk is full with --force."
    )
    assert not (tmp_path / "out/plan.json").exists()


def test_the_need_has_a_margin_of_5_percent_unless_forced_or_there_already(tmp_path: Path) -> None:
    """At 1.05 times the need and the reserve, a run starts; with less it does not."""
    documents = 2 * len(plan_bytes(fake_plan())) + DOCUMENTS_BYTES
    fits = ((FREE_BYTES - RESERVE_BYTES) / 1.05 - documents) / 10
    with pytest.raises(StorageError):
        make(tmp_path / "out", settings=estimated(fits + 1.0))
    assert make(tmp_path / "out", settings=estimated(fits - 1.0)).made == 10
    # The estimate may be wrong, and the user may know better.
    assert make(tmp_path / "forced", settings=estimated(1e12, force=True)).made == 10
    # A finished data set is accepted on a full disk.
    assert make(tmp_path / "out", settings=estimated(1e12)).already_complete


def test_a_run_ends_before_the_disk_is_full_but_hard_links_need_no_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 3 MB in a sample, 2.9 MB are links: 50 samples need 5 MB of the 8."""
    linked = SpaceCheck(LocalStore(tmp_path, "again"), linked_bytes=2.9e6)
    copied = SpaceCheck(LocalStore(tmp_path, "again"))
    assert linked.after_shard(3e6, 50) is None
    assert "the other 50 samples need about 150.0 MB" in str(copied.after_shard(3e6, 50))
    # Even with --force: the log of the run needs space.
    monkeypatch.setattr(store, "free_bytes", lambda path: RESERVE_BYTES - 1)
    check = SpaceCheck(LocalStore(tmp_path, "again"), 1.0, is_forced=True)
    assert "65.5 kB are free; stopped before the disk is full" in str(check.after_shard(100.0, 5))
    assert check.after_shard(100.0, 0) is None
    # A temporary folder cannot be resumed.
    check = SpaceCheck(LocalStore(tmp_path, ""), 1.0)
    assert str(check.after_shard(100.0, 5)).endswith("; stopped before the disk is full.")


def test_a_merge_that_will_not_fit_is_refused_before_anything_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Files are copied where the parts are on another disk; links need no space."""
    make(tmp_path / "part", 10)
    plan, out = fake_plan(10), LocalStore(tmp_path / "out", "again")
    shards = sum((LocalStore(tmp_path / "part").record(s) or fail()).size_bytes for s in range(3))
    documents = 2 * len(plan_bytes(plan)) + DOCUMENTS_BYTES
    room = 1.05 * (shards + documents) + RESERVE_BYTES
    monkeypatch.setattr(merge, "_is_same_disk", lambda part, place: False)
    monkeypatch.setattr(store, "free_bytes", lambda path: room - 1)
    with pytest.raises(StorageError, match=r"the parts need about .* here and .* are free"):
        gather_shards(plan, [tmp_path / "part"], out, allow_mixed_numerics=False)
    assert not out.root.exists()
    monkeypatch.setattr(merge, "_is_same_disk", lambda part, place: True)
    gather_shards(plan, [tmp_path / "part"], out, allow_mixed_numerics=False)


def fail() -> NoReturn:
    raise AssertionError
