"""The cache of rendered samples: whole and intact files, up to a total size."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gen_data.runner.sample_cache import SampleCache, content_of
from tests.runner.doubles import fake_plan

KILOBYTE = 1000


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Files of one sample."""
    made = tmp_path / "made"
    (made / "color" / "rgb").mkdir(parents=True)
    (made / "color" / "rgb" / "0.png").write_bytes(bytes(range(250)) * 4)
    (made / "labels.jsonl").write_bytes(b"")
    return made


def open_cache(folder: Path, max_bytes: int = 10**9, content: str = "a") -> SampleCache:
    return SampleCache(content, max_bytes, folder.parent / "cache")


def size(cache: SampleCache) -> int:
    return sum(path.stat().st_size for path in cache.root.glob("*/*"))


def test_a_sample_comes_back_as_it_was_made(folder: Path) -> None:
    files = {"color/rgb/0.png": bytes(range(250)) * 4, "labels.jsonl": b""}

    assert open_cache(folder).find(7) is None
    assert open_cache(folder).add(7, folder) == files
    assert open_cache(folder).find(7) == files
    assert open_cache(folder).find(8) is None
    assert open_cache(folder, content="b").find(7) is None


@pytest.mark.parametrize("length", [0, 3, 31, 32, 35, 60, 500, 1079])
def test_a_cut_file_is_no_sample(folder: Path, length: int) -> None:
    cache = open_cache(folder)
    cache.add(7, folder)
    os.truncate(cache.path(7), length)

    assert cache.find(7) is None


def test_a_changed_bit_is_no_sample(folder: Path) -> None:
    cache = open_cache(folder)
    cache.add(7, folder)
    whole = cache.path(7).read_bytes()
    for place in (*range(0, 90, 4), *range(90, len(whole), 90)):
        cache.path(7).write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        assert cache.find(7) is None

    cache.add(7, folder)
    assert cache.find(7) is not None


def test_the_file_of_another_sample_is_not_taken_for_it(folder: Path) -> None:
    cache, other = open_cache(folder), open_cache(folder, content="b")
    cache.add(7, folder)
    cache.path(7).replace(cache.path(8))
    assert cache.find(8) is None

    other.path(8).parent.mkdir()
    cache.path(8).replace(other.path(7))
    assert other.find(7) is None


def test_the_least_recently_used_samples_go_first(folder: Path) -> None:
    """Files of some 1,080 bytes each; ten fit."""
    cache = open_cache(folder, 11 * KILOBYTE)
    for index in range(30):
        cache.add(index, folder)
        os.utime(cache.path(index), (index, index))
        assert size(cache) <= 11 * KILOBYTE
        assert index < 5 or cache.find(2) is not None  # Read all the time.

    found = [index for index in range(30) if cache.find(index) is not None]
    assert found[0] == 2
    assert len(found) >= 8
    assert found[1:] == list(range(31 - len(found), 30))


def test_the_bound_holds_for_all_plans_together(folder: Path) -> None:
    for content in "abcdefgh":
        open_cache(folder, 4 * KILOBYTE, content).add(0, folder)

    assert 0 < size(open_cache(folder)) <= 4 * KILOBYTE


def test_a_sample_larger_than_the_bound_is_not_kept(folder: Path) -> None:
    cache = open_cache(folder, 100)

    assert cache.add(0, folder)["labels.jsonl"] == b""
    assert size(cache) == 0


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGKILL")
def test_a_killed_writer_leaves_no_sample_and_its_rest_is_removed_first(folder: Path) -> None:
    cache = open_cache(folder, 3 * KILOBYTE)
    script = (
        "import os, signal, sys; from pathlib import Path\n"
        "from gen_data.runner import sample_cache\n"
        "Path.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "root, made = map(Path, sys.argv[1:])\n"
        "sample_cache.SampleCache('a', 10**9, root).add(7, made)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, cache.root, folder], check=False)
    (rest,) = cache.root.glob("*/*")

    assert done.returncode == -9
    assert cache.find(7) is None

    os.utime(rest, (0, 0))
    for index in range(3):
        cache.add(index, folder)
    assert not rest.exists()
    assert cache.find(2) is not None


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="permits no removal of open files")
def test_processes_share_the_folder(folder: Path) -> None:
    """Three processes fill and read it, while samples are removed; each reads the right bytes."""
    cache = open_cache(folder, 20 * KILOBYTE)
    script = (
        "import sys; from pathlib import Path\n"
        "from gen_data.runner.sample_cache import SampleCache\n"
        "root, made = map(Path, sys.argv[1:])\n"
        "cache = SampleCache('a', 20_000, root)\n"
        "for k in range(300):\n"
        "    found = cache.find(k % 37) or cache.add(k % 37, made)\n"
        "    assert bytes(found['color/rgb/0.png']) == bytes(range(250)) * 4\n"
    )
    command = [sys.executable, "-c", script, str(cache.root), str(folder)]
    running = [subprocess.Popen(command) for _ in range(3)]

    assert [process.wait() for process in running] == [0, 0, 0]
    assert size(cache) <= 20 * KILOBYTE
    assert not list(cache.root.glob("*/*.part"))


def test_a_folder_that_cannot_be_written_only_costs_time(folder: Path) -> None:
    cache = open_cache(folder)
    cache.root.write_text("a file")

    assert cache.add(0, folder)["labels.jsonl"] == b""
    assert cache.find(0) is None


@pytest.mark.parametrize(
    ("change", "is_same"),
    [
        ({"n": 9}, True),
        ({"name": "other"}, True),
        ({"shard_size": 1}, True),
        ({"seed": 8}, False),
        ({"config": {}}, False),
        ({"versions": {"numpy": "1"}}, False),
        ({"assets": {"user/block": "0"}}, False),
    ],
)
def test_samples_are_found_by_what_they_depend_on(change: dict[str, object], is_same: bool) -> None:
    from dataclasses import replace

    plan = fake_plan()

    assert (content_of(replace(plan, **change)) == content_of(plan)) == is_same
