"""Views of files: no descriptor each, read-only, returned to the system."""

import gc
import resource
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets.asset_cache import Arrays, DiskCache
from gen_data.core import mapped_files

SIZE = 300_001
"""No multiple of a page."""


@pytest.fixture
def few_descriptors() -> Iterator[int]:
    """A limit of 64 more descriptors than are open now, as ``ulimit -n`` sets it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    limit = len(list(Path("/proc/self/fd").iterdir())) + 64
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, hard))
    yield limit
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def write(path: Path, size: int = SIZE) -> bytes:
    content = np.arange(size, dtype=np.uint32).tobytes()[:size]
    path.write_bytes(content)
    return content


def mapped(path: Path) -> memoryview:
    with path.open("rb") as file:
        return mapped_files.map_file(file.fileno(), path.stat().st_size)


def test_a_view_shows_the_file_and_cannot_change_it(tmp_path: Path) -> None:
    """Also after the file has lost its name."""
    content = write(tmp_path / "file")
    view = mapped(tmp_path / "file")
    (tmp_path / "file").unlink()

    assert view == content
    assert view.readonly
    assert not np.frombuffer(view, np.uint8).flags.writeable


def test_maps_keep_no_descriptors(tmp_path: Path, few_descriptors: int) -> None:
    """Most systems allow 1,024, and a street maps more files than that."""
    cache = DiskCache(tmp_path)
    rng = np.random.default_rng(0)
    made = [rng.integers(0, 255, SIZE, np.uint8) for _ in range(3)]
    computed: list[Callable[[], Arrays]] = [partial(dict, a=array) for array in made]
    names = range(few_descriptors + 1)
    kept = [cache.arrays(f"{k:04x}", computed[k % 3])["a"] for k in names]

    for k, array in enumerate(kept):
        np.testing.assert_array_equal(array, made[k % 3])
        assert mapped_files.owned_bytes(array) == 0


def test_pages_are_dropped_and_come_back(tmp_path: Path) -> None:
    """Eight megabytes leave the memory of the process; their content does not change."""
    content = write(tmp_path / "file", 8 << 20)
    view = np.frombuffer(mapped(tmp_path / "file"), np.uint8)
    assert int(view.sum()) == sum(content)
    resident = mapped_files.read_statm(2)

    mapped_files.limit_mapped_pages(resident)
    assert mapped_files.read_statm(2) > resident - (1 << 20)
    mapped_files.release_mapped_pages()

    assert mapped_files.read_statm(2) < resident - (7 << 20)
    assert view.tobytes() == content


def test_pages_of_files_next_to_each_other_are_dropped(tmp_path: Path) -> None:
    """Every other one is unmapped before: maps are neighbours of maps, and of gaps."""
    contents = [write(tmp_path / f"{k}", 1 << 20) for k in range(16)]
    views = [np.frombuffer(mapped(tmp_path / f"{k}"), np.uint8) for k in range(16)]
    del views[4:12:2], contents[4:12:2]
    gc.collect()
    assert [int(view.sum()) for view in views] == [sum(content) for content in contents]
    resident = mapped_files.read_statm(2)

    mapped_files.release_mapped_pages()

    assert mapped_files.read_statm(2) < resident - (11 << 20)
    assert [view.tobytes() for view in views] == contents


def test_pages_are_dropped_once_enough_were_read(tmp_path: Path) -> None:
    """Pages that were resident before do not count."""
    write(tmp_path / "file", 8 << 20)
    view = np.frombuffer(mapped(tmp_path / "file"), np.uint8)
    limiter = mapped_files.PageLimiter()
    view.sum()
    resident = mapped_files.read_statm(2)

    limiter.limit_growth(16 << 20)
    assert mapped_files.read_statm(2) > resident - (1 << 20)
    limiter.limit_growth(4 << 20)

    assert mapped_files.read_statm(2) < resident - (7 << 20)


@pytest.mark.slow
def test_a_file_is_unmapped_with_its_last_view(tmp_path: Path) -> None:
    """Parts of an array count as views."""
    path = tmp_path / "file"
    write(path)
    part = np.frombuffer(mapped(path), np.uint8)[10:20]
    gc.collect()
    assert str(path) in Path("/proc/self/maps").read_text()
    assert part.tolist() == list(path.read_bytes()[10:20])

    del part
    gc.collect()

    assert str(path) not in Path("/proc/self/maps").read_text()


def test_only_views_of_files_are_not_owned(tmp_path: Path) -> None:
    """Copies and arrays over bytes take their own memory."""
    write(tmp_path / "file")
    view = np.frombuffer(mapped(tmp_path / "file"), np.uint8)
    in_bytes = np.frombuffer(bytes(100), np.uint8)

    assert mapped_files.owned_bytes(view, view[:10].reshape(2, 5)) == 0
    assert mapped_files.owned_bytes(view.copy(), in_bytes[50:]) == SIZE + 50
