"""Runs that go on without the samples that cannot be made."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from gen_data.core import errors
from gen_data.core.errors import OutOfMemory, SampleError, StorageError, WorkerLost
from gen_data.runner.deep_verify import choose_samples
from gen_data.runner.diff import compare
from gen_data.runner.failed_sample import FailedSample
from gen_data.runner.run import Limits, Settings
from gen_data.runner.sample_stages import SampleFiles
from gen_data.runner.stored import StoredSamples
from gen_data.runner.verify import verify
from tests.runner.doubles import Trouble, make, tree_digest, write_raw_images

SKIP = Settings(write_media=write_raw_images, skip_failed=True)
BUG = FailedSample(5, "sample", "ValueError")


def manifest_of(folder: Path) -> Mapping[str, Any]:
    manifest: Mapping[str, Any] = json.loads((folder / "manifest.json").read_text())
    return manifest


def files_of(folder: Path) -> dict[str, bytes]:
    paths = (path for path in (folder / "shards").rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def test_a_failed_sample_is_named_everywhere_and_not_made_again(tmp_path: Path) -> None:
    """Index, stage and class of the error; the summary counts the others."""
    summary = make(tmp_path, trouble=Trouble(bug_at=5), settings=SKIP)
    assert summary.failed == (BUG,)
    assert summary.samples == summary.made == 9
    assert manifest_of(tmp_path)["failed"] == [
        {"index": 5, "stage": "sample", "error": "ValueError"}
    ]
    assert ("skipped", "1 samples:\n5 (sample: ValueError)") in summary.rows()
    entries = [json.loads(line) for line in (tmp_path / "run/log.jsonl").read_text().splitlines()]
    # The log has the whole error, with the end of its traceback.
    [text] = [entry["text"] for entry in entries if "skipped" in entry]
    assert "ValueError: a wheel came off" in text
    assert "Traceback" in text or "raise ValueError" in text
    assert "1 of 10 could not be made" in (tmp_path / "README.md").read_text()
    again = make(tmp_path, settings=SKIP)
    assert again.already_complete
    assert (again.failed, again.samples) == ((BUG,), 9)
    assert verify(tmp_path, full=True).samples == 9
    assert choose_samples(tmp_path, 20) == [0, 1, 2, 3, 4, 6, 7, 8, 9]
    assert 5 not in choose_samples(tmp_path, 8)


def test_the_manifest_of_a_whole_data_set_names_no_failures(
    tmp_path: Path, reference_digest: str
) -> None:
    """Its bytes are the same with and without the option."""
    make(tmp_path / "skipping", settings=SKIP)
    assert "failed" not in manifest_of(tmp_path / "skipping")
    assert tree_digest(tmp_path / "skipping") == reference_digest


@pytest.mark.parametrize(
    "trouble", [Trouble(bug_at=5), Trouble(nan_at=5)], ids=["raises", "fails while written"]
)
def test_a_failed_sample_leaves_no_file_and_no_change(tmp_path: Path, trouble: Trouble) -> None:
    """Against the data set with that sample, only its image and its lines are missing."""
    make(tmp_path / "whole")
    make(tmp_path / "lacking", trouble=trouble, settings=SKIP)
    whole, lacking = files_of(tmp_path / "whole"), files_of(tmp_path / "lacking")
    assert whole.keys() - lacking.keys() == {"shards/000001/color/rgb/000000005.png"}
    changed = {path for path in lacking if lacking[path] != whole[path]}
    assert changed == {
        "shards/000001.json",
        "shards/000001/labels.jsonl",
        "shards/000001/scenes.jsonl",
        "shards/000001/lines/part.jsonl",
    }
    labels = "shards/000001/labels.jsonl"
    lines = whole[labels].splitlines()
    assert lacking[labels].splitlines() == [lines[0], *lines[2:]]


@pytest.mark.slow
@pytest.mark.parametrize("index", [0, 3, 4, 9])
def test_the_bytes_depend_on_the_plan_and_failed_samples(tmp_path: Path, index: int) -> None:
    """Where it fails, and how many workers there are, makes no difference to any data file."""
    make(tmp_path / "early", trouble=Trouble(bug_at=index), settings=SKIP)
    late = Trouble(errors={index: ValueError("another text")})
    make(tmp_path / "late", trouble=late, settings=SKIP, workers=1)
    assert tree_digest(tmp_path / "late") == tree_digest(tmp_path / "early")


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), SystemExit(3), ValueError(), RuntimeError("")]
)
@pytest.mark.parametrize("workers", [0, 1])
def test_whatever_a_plug_in_raises_fails_its_sample_alone(
    tmp_path: Path, error: BaseException, workers: int
) -> None:
    """Also errors that would end a process or have no text."""
    trouble = Trouble(errors={5: error})
    summary = make(tmp_path, trouble=trouble, settings=SKIP, workers=workers)
    assert summary.failed == (FailedSample(5, "sample", type(error).__name__),)
    assert summary.worker_deaths == 0


@pytest.mark.parametrize(
    ("error", "text", "workers"),
    [(KeyboardInterrupt(), "KeyboardInterrupt: ", 1), (SystemExit(3), "SystemExit: ", 1),
     (ValueError("a wheel came off"), "ValueError: a wheel came off", 0),
     (ValueError(), "ValueError: without a message", 0)],
)  # fmt: skip
def test_without_the_option_one_failed_sample_ends_the_run(
    tmp_path: Path, error: BaseException, text: str, workers: int
) -> None:
    """With the sample, the class and a command; the shards before it are kept."""
    with pytest.raises(SampleError, match=rf"sample 5: {text}") as caught:
        make(tmp_path, trouble=Trouble(errors={5: error}), workers=workers)
    assert "--index 5" in str(caught.value)
    assert not (tmp_path / "manifest.json").exists()


@pytest.mark.slow
def test_a_sample_that_hangs_is_killed_after_its_limit_and_skipped(tmp_path: Path) -> None:
    """One try; the samples before it are made again."""
    settings = replace(SKIP, limits=Limits(sample_s=1.5))
    summary = make(tmp_path, trouble=Trouble(hangs_at=5), settings=settings, workers=1)
    assert (summary.failed, summary.worker_deaths) == ((FailedSample(5, "process", "hang"),), 1)
    assert summary.samples == 9
    # Without the other option, its shard is abandoned and all others are finished.
    settings = Settings(write_media=write_raw_images, limits=Limits(sample_s=1.5))
    with pytest.raises(WorkerLost, match="shard 1: its worker process died once, at last in"):
        make(tmp_path / "b", trouble=Trouble(hangs_at=5), settings=settings, workers=1)
    assert sorted(path.name for path in (tmp_path / "b/shards").glob("*.json")) == [
        "000000.json",
        "000002.json",
    ]


def test_a_sample_that_crashes_its_worker_every_time_is_skipped(tmp_path: Path) -> None:
    """After as many tries as without the option, because a worker may die for other reasons."""
    summary = make(tmp_path, trouble=Trouble(killed_at=5), settings=SKIP, workers=1)
    assert (summary.failed[0].index, summary.failed[0].stage) == (5, "process")
    assert summary.worker_deaths == 3


@pytest.mark.slow
def test_a_worker_that_is_killed_once_loses_no_sample(
    tmp_path: Path, reference_digest: str
) -> None:
    """Its shard is made again, as without the option."""
    trouble = Trouble(killed_once_at=5, marker=str(tmp_path / "killed"))
    make(tmp_path / "killed-once", trouble=trouble, settings=SKIP, workers=1)
    assert tree_digest(tmp_path / "killed-once") == reference_digest


@pytest.mark.parametrize("error", [OutOfMemory("no memory"), StorageError("disk full")])
def test_errors_of_the_machine_fail_no_samples(tmp_path: Path, error: BaseException) -> None:
    """They would make a data set that depends on the machine."""
    with pytest.raises(type(error)):
        make(tmp_path, trouble=Trouble(errors={5: error}), settings=SKIP)


def test_if_every_sample_fails_there_is_no_data_set(tmp_path: Path) -> None:
    """The first failure is the error."""
    errors = {index: ValueError("nothing works") for index in range(10)}
    with pytest.raises(SampleError, match="none of the 10 samples could be made; sample 0: "):
        make(tmp_path, trouble=Trouble(errors=errors), settings=SKIP)
    assert not (tmp_path / "manifest.json").exists()


def test_a_shard_in_which_every_sample_fails_is_a_valid_part(tmp_path: Path) -> None:
    """Its labels are empty, and exporters do not see it."""
    errors = {index: ValueError("no") for index in (4, 5, 6, 7)}
    summary = make(tmp_path, trouble=Trouble(errors=errors), settings=SKIP)
    assert summary.samples == verify(tmp_path, full=True).samples == 6
    assert StoredSamples(tmp_path).sample(8).index == 8


def test_an_unfinished_data_set_is_resumed_without_its_failed_samples(tmp_path: Path) -> None:
    """Committed shards stay; the second run makes the missing one."""
    make(tmp_path / "at once", trouble=Trouble(bug_at=1), settings=SKIP)
    first = Trouble(errors={1: ValueError(), 6: OutOfMemory("no memory")})
    with pytest.raises(OutOfMemory):
        make(tmp_path / "resumed", trouble=first, settings=SKIP)
    summary = make(tmp_path / "resumed", settings=SKIP)
    assert summary.failed == (FailedSample(1, "sample", "ValueError"),)
    assert tree_digest(tmp_path / "resumed") == tree_digest(tmp_path / "at once")


def test_repair_tries_failed_samples_again(tmp_path: Path) -> None:
    """Samples that still fail keep their bytes; if all succeed, the data set is complete."""
    whole, lacking, trouble = tmp_path / "whole", tmp_path / "lacking", Trouble(bug_at=5)
    make(whole)
    make(lacking, trouble=trouble, settings=SKIP)
    before = tree_digest(lacking)
    repair = replace(SKIP, repair=True)
    assert make(lacking, trouble=trouble, settings=repair).failed == (BUG,)
    assert tree_digest(lacking) == before
    assert make(lacking, settings=repair).failed == ()
    assert tree_digest(lacking) == tree_digest(whole)


def test_stored_samples_have_the_indices_that_exist_and_their_files(tmp_path: Path) -> None:
    """Each is found by its own number; a failed one has an error with the reason."""
    make(tmp_path, trouble=Trouble(errors={i: ValueError() for i in (4, 5)}), settings=SKIP)
    stored = StoredSamples(tmp_path)
    assert stored.n == 8
    assert list(stored.indices) == [0, 1, 2, 3, 6, 7, 8, 9]
    assert [stored.sample(index).index for index in stored.indices] == list(stored.indices)
    with pytest.raises(
        errors.SampleIndexError, match=r"sample 5 does not exist.*sample: ValueError"
    ):
        stored.sample(5)
    # Lines are found by their index, not by their place.
    shard = tmp_path / "shards" / "000001"
    assert [SampleFiles(shard, i).labels["index"] for i in (6, 7)] == [6, 7]
    with pytest.raises(StorageError, match="sample 5 cannot be read"):
        _ = SampleFiles(shard, 5).labels


def test_two_data_sets_differ_in_a_sample_that_one_of_them_lacks(tmp_path: Path) -> None:
    """And two that lack the same one are equal."""
    settings = Settings(skip_failed=True)
    make(tmp_path / "whole", settings=settings)
    for name in ("lacking", "too"):
        make(tmp_path / name, trouble=Trouble(bug_at=5), settings=settings)
    assert compare(tmp_path / "lacking", tmp_path / "too").equal
    found = compare(tmp_path / "whole", tmp_path / "lacking").sample
    assert found is not None
    assert (found.index, found.stage) == (5, "sample")
