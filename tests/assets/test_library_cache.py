"""The cache: same bytes with it, without it, and when it is damaged."""

import os
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from gen_data.assets import asset_cache
from gen_data.assets.asset_cache import DiskCache, Store, content_key
from gen_data.assets.library import open_library
from gen_data.core.asset_types import MeshData

ROOT = Path(__file__).parents[2]
ASSET = "random_urdfs/007"


def assert_same(a: MeshData, b: MeshData) -> None:
    for field in fields(MeshData):
        left, right = getattr(a, field.name), getattr(b, field.name)
        if isinstance(left, np.ndarray):
            assert left.dtype == right.dtype
            assert left.tobytes() == right.tobytes()
        else:
            assert left == right


def entries(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*.arrays"))


@pytest.mark.slow
@pytest.mark.parametrize("asset", ["car?seed=3", ASSET])
def test_stored_bounds_are_those_of_the_mesh_which_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, asset: str
) -> None:
    """Objects without a place in a scene cost no mesh; a car has bounds without mirrors too."""
    first = open_library(cache_dir=tmp_path)
    first.bounds_m(asset)
    vertices_m = first.mesh(asset).vertices_m
    of_body = first.body_bounds_m(asset)
    later = open_library(cache_dir=tmp_path)
    monkeypatch.delattr(type(later), "_imported")
    assert later.bounds_m(asset) == (
        tuple(vertices_m.min(axis=0).tolist()),
        tuple(vertices_m.max(axis=0).tolist()),
    )
    assert later.body_bounds_m(asset) == of_body
    assert (of_body is not None) == asset.startswith("car")


@pytest.mark.slow
def test_cold_warm_and_another_cache_give_the_same_bytes(tmp_path: Path) -> None:
    cold = open_library(cache_dir=tmp_path / "a")
    warm = open_library(cache_dir=tmp_path / "a")
    other = open_library(cache_dir=tmp_path / "b")
    assert_same(cold.mesh(ASSET), warm.mesh(ASSET))
    assert_same(cold.mesh(ASSET), other.mesh(ASSET))
    for one, two in zip(
        cold.convex_parts(ASSET).parts_m, warm.convex_parts(ASSET).parts_m, strict=True
    ):
        assert one.tobytes() == two.tobytes()
    names = [[p.name for p in entries(tmp_path / x)] for x in "ab"]
    assert names[0] == names[1]


@pytest.mark.parametrize("damage", ["truncated", "bit flip", "empty", "foreign"])
def test_a_damaged_entry_is_made_again_without_temporary_files(tmp_path: Path, damage: str) -> None:
    good = open_library(cache_dir=tmp_path).mesh(ASSET)
    (path,) = entries(tmp_path)
    data = bytearray(path.read_bytes())
    if damage == "truncated":
        path.write_bytes(data[: len(data) // 2])
    elif damage == "bit flip":
        data[len(data) // 3] ^= 0x10
        path.write_bytes(data)
    elif damage == "empty":
        path.write_bytes(b"")
    else:
        np.savez(path, vertices_m=np.zeros((3, 3)))
    assert_same(open_library(cache_dir=tmp_path).mesh(ASSET), good)
    assert not list(tmp_path.rglob("*.part"))


def large_arrays() -> dict[str, np.ndarray]:
    return {"x": np.arange(50_000, dtype=np.float32).reshape(-1, 2), "y": np.arange(7)}


def test_large_entries_are_mapped_and_read_only(tmp_path: Path) -> None:
    """Computed or loaded, their arrays are views of the file, with the computed values."""
    disk, key = DiskCache(tmp_path), content_key({"name": "large"})
    for arrays in (disk.arrays(key, large_arrays), disk.arrays(key, dict)):
        for name, expected in large_arrays().items():
            np.testing.assert_array_equal(arrays[name], expected)
            assert not arrays[name].flags.writeable
        assert str(entries(tmp_path)[0]) in Path("/proc/self/maps").read_text()


@pytest.mark.parametrize("damage", ["truncated", "bit flip"])
def test_a_damaged_large_entry_is_made_anew(tmp_path: Path, damage: str) -> None:
    """The checksum is compared before the file is mapped."""
    disk, key = DiskCache(tmp_path), content_key({"name": "large"})
    disk.arrays(key, large_arrays)
    (path,) = entries(tmp_path)
    data = bytearray(path.read_bytes())
    data[150_000] ^= 0x10
    path.unlink()
    path.write_bytes(data[:180_000] if damage == "truncated" else data)
    arrays = disk.arrays(key, large_arrays)
    np.testing.assert_array_equal(arrays["x"], large_arrays()["x"])
    assert path.read_bytes() != data


def test_a_large_entry_is_checked_once_per_start_of_the_machine_and_again_after_a_change(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Caches stand for processes; damage that leaves the time of the last change stays unseen.

    On file systems without attributes, it is seen.
    """
    key = content_key({"name": "large"})
    DiskCache(tmp_path).arrays(key, large_arrays)
    (path,) = entries(tmp_path)
    is_noted = bool(getattr(os, "listxattr", lambda _: ())(path))
    unchanged = path.stat()
    with path.open("r+b") as file:
        file.seek(150_000)
        file.write(b"\xff")
    os.utime(path, ns=(unchanged.st_atime_ns, unchanged.st_mtime_ns))
    assert (DiskCache(tmp_path).find(key) is not None) == is_noted
    monkeypatch.setattr(asset_cache, "_boot", lambda: "another start")
    assert DiskCache(tmp_path).find(key) is None
    monkeypatch.undo()
    os.utime(path, ns=(unchanged.st_atime_ns, unchanged.st_mtime_ns + 1_000_000_000))
    assert DiskCache(tmp_path).find(key) is None


def test_derived_arrays_are_stored_by_asset_and_name(tmp_path: Path) -> None:
    """Another process loads them; another name, or another asset, is computed again."""
    computed: list[int] = []

    def compute() -> dict[str, np.ndarray]:
        computed.append(len(computed))
        return {"k": np.array(computed)}

    def derive(asset: str, name: str) -> list[int]:
        library = open_library(cache_dir=tmp_path)
        return library.derived(asset, name, compute)["k"].tolist()

    assert derive("mug?seed=0", "tree 1") == [0]
    assert derive("mug?seed=0", "tree 1") == [0]
    assert derive("mug?seed=0", "tree 2") == [0, 1]
    assert derive("mug?seed=1", "tree 1") == [0, 1, 2]


def test_bounds_of_a_stride_are_stored_with_the_person(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, person = open_library(cache_dir=tmp_path), "simple_person?pose=walk&seed=3"
    corners = [first.mesh(f"{person}&phase={k / 4}").bounds_m() for k in range(4)]
    expected = (
        tuple(map(min, *(low for low, _ in corners))),
        tuple(map(max, *(high for _, high in corners))),
    )
    assert first.stride_bounds_m(person) == expected

    later = open_library(cache_dir=tmp_path)
    monkeypatch.delattr(type(later), "_imported")
    assert later.stride_bounds_m(person) == expected


def test_people_in_a_given_pose_are_stored_but_not_every_step_of_a_stride(tmp_path: Path) -> None:
    """Poses are few; a walk through a sequence takes hundreds of steps."""
    library = open_library(cache_dir=tmp_path)
    library.mesh("simple_person?pose=walk&phase=0.25&seed=3")
    assert not entries(tmp_path)
    library.mesh("simple_person?pose=talk&seed=3")
    assert len(entries(tmp_path)) == 1


def test_opening_reads_nothing_and_a_cache_not_writable_only_costs_time(tmp_path: Path) -> None:
    """A library opens with a missing folder; the first query reports the fault."""
    library = open_library([tmp_path / "missing"], cache_dir=tmp_path / "cache")
    assert not (tmp_path / "cache").exists()
    with pytest.raises(Exception, match="no such folder"):
        library.get(ASSET)
    # A file stands where the cache folder should be.
    blocked = tmp_path / "blocked"
    blocked.write_text("in the way")
    assert len(open_library(cache_dir=blocked).mesh(ASSET).faces) > 100


@pytest.mark.slow
def test_several_processes_may_share_a_cache(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from hashlib import sha256\n"
        "from gen_data.assets.library import open_library\n"
        "mesh = open_library(cache_dir=Path(sys.argv[1])).mesh(sys.argv[2])\n"
        "print(sha256(mesh.vertices_m.tobytes() + mesh.faces.tobytes()).hexdigest())\n"
    )
    command = [sys.executable, "-c", program, str(tmp_path), ASSET]
    running = [
        subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) for _ in range(2)
    ]
    answers = {process.communicate(timeout=120)[0] for process in running}
    assert {process.returncode for process in running} == {0}
    assert (len(answers), len(entries(tmp_path))) == (1, 1)


def test_memory_is_bounded_and_forgets_the_oldest(tmp_path: Path) -> None:
    """A store of 1,000 bytes holds two results of 400."""
    store = Store(DiskCache(tmp_path / "none"), max_bytes=1000)
    computed: list[str] = []

    def get(name: str) -> float:
        def compute() -> dict[str, np.ndarray]:
            computed.append(name)
            return {"x": np.full(50, float(len(computed)))}

        (tmp_path / "none").mkdir(exist_ok=True)
        return store.get(content_key({"name": name}), compute, lambda arrays: float(arrays["x"][0]))

    assert [get(n) for n in "aba"] == [1.0, 2.0, 1.0]
    get("c")
    assert computed == ["a", "b", "c"]
    assert len(store) == 2


def test_the_least_recently_used_files_on_disk_go_first_above_the_bound(tmp_path: Path) -> None:
    """Of a bound of 20 kB nine tenths remain; files of an earlier format go too."""
    earlier = tmp_path / "format-1" / "ab" / "x.arrays"
    earlier.parent.mkdir(parents=True)
    earlier.write_bytes(bytes(1000))
    os.utime(earlier, (0, 0))
    disk = DiskCache(tmp_path, max_bytes=20_000)

    def add(number: int) -> Path:
        key = f"{0:08x}{number:056x}"
        disk.arrays(key, lambda: {"x": np.zeros(800, np.uint8)})
        (path,) = tmp_path.rglob(f"{key}.arrays")
        return path

    used = add(0)
    for number in range(1, 60):
        os.utime(used)
        os.utime(add(number), (number, number))
        total = sum(path.stat().st_size for path in entries(tmp_path))
        assert total <= 20_000
    kept = [int(path.stem[8:], 16) for path in entries(tmp_path)]
    assert not earlier.exists()
    assert kept[0] == 0
    assert kept[1:] == [*range(60 - len(kept) + 1, 60)]
    assert total > 15_000


def test_surfaces_of_a_shape_that_no_other_street_has_do_not_fill_the_disk(tmp_path: Path) -> None:
    library = open_library(cache_dir=tmp_path)
    for asset in ("road?bends=10,20,30,0.0125", "junction?arms_deg=81,180,270,-1"):
        library.mesh(asset)
        library.bounds_m(asset)
    assert entries(tmp_path) == []
