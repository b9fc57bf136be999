"""Data sets from elsewhere: no name in them leads out of a folder.

Every test plants a harmless marker file, and looks for it outside.
"""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fsspec
import pytest

from gen_data.assets.folder_index import MeshEntry
from gen_data.core.errors import StorageError
from gen_data.core.path_names import check_inner_path, check_name
from gen_data.core.serialization import canonical_json
from gen_data.exporters.label_map import LabelMap
from gen_data.runner.labels import parse_labels
from gen_data.runner.merge import common_plan, gather_shards
from gen_data.runner.object_store import ObjectFolder, copy_outline
from gen_data.runner.run import Settings
from gen_data.runner.shard_record import parse_record, parse_unchecked_record
from gen_data.runner.store import LocalStore
from gen_data.runner.stored import StoredSamples
from gen_data.runner.stored_objects import StoredObjects
from tests.runner.doubles import make, write_raw_images

UP = "../../../../../../marker.txt"
OUTSIDE = [
    UP, "/marker.txt", "a/../../marker.txt", "..", "a//b", "./a", "", "a\\..\\b", "C:/marker",
    "C:marker", "a\nb", "a\0b", "a/", "x" * 256,
]  # fmt: skip


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cache several folders below the test's own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a/b/c/d/cache"))


def edit_record(data: bytes, edit: Callable[[dict[str, Any]], None]) -> bytes:
    plain = json.loads(data)
    plain.pop("sha256")
    edit(plain)
    checksum = hashlib.sha256(canonical_json(plain).encode()).hexdigest()
    return (canonical_json({**plain, "sha256": checksum}) + "\n").encode()


def leads_out(plain: dict[str, Any]) -> None:
    """Give the first file of a record a path outside the shard."""
    plain["files"][0]["path"] = UP


def plant(folder: Path, edit: Callable[[dict[str, Any]], None] = leads_out) -> None:
    """Change the record of the first shard, and the manifest's digest of it."""
    path, manifest_path = folder / "shards/000000.json", folder / "manifest.json"
    path.write_bytes(edit_record(path.read_bytes(), edit))
    manifest = json.loads(manifest_path.read_bytes())
    manifest["shards"][0] = hashlib.sha256(path.read_bytes()).hexdigest()
    manifest_path.write_text(canonical_json(manifest))


def publish(folder: Path, url: str) -> ObjectFolder:
    """Copy a data set to a URL, and put an object where its first record points to."""
    objects = ObjectFolder(url)
    files = (path for path in folder.rglob("*") if path.is_file())
    objects.upload({path.relative_to(folder).as_posix(): path for path in files})
    return objects


def escaped(root: Path) -> list[Path]:
    return list(root.rglob("marker.txt"))


NAMES = ["a/b", "..", ".", "", "a\\b", "C:x", "tab\t", "del\x7f", "\u202e"]


@pytest.mark.parametrize(
    ("check", "text"),
    [*((check_inner_path, path) for path in OUTSIDE), *((check_name, name) for name in NAMES)],
)
def test_paths_outside_and_names_with_separators_or_control_characters_are_refused(
    check: Callable[[str], str], text: str
) -> None:
    with pytest.raises(ValueError, match="cannot name a file"):
        check(text)


@pytest.mark.parametrize("name", ["coffee mug", "茶杯", "no", "...", "a.b", "müsli", "50 %"])
def test_ordinary_names_stay(name: str) -> None:
    assert check_name(name) == name
    assert check_inner_path(f"a/{name}") == f"a/{name}"


@pytest.mark.parametrize("key", ["files", "empty_folders"])
def test_a_record_with_a_path_outside_is_no_record(dataset: Path, key: str) -> None:
    def edit(plain: dict[str, Any]) -> None:
        plain[key] = [{**plain["files"][0], "path": UP}] if key == "files" else [UP]

    data = edit_record((dataset / "shards/000000.json").read_bytes(), edit)
    assert parse_record(data) is None
    assert parse_unchecked_record(data) is None


def test_opening_a_url_writes_nothing_outside_its_cache(
    tmp_path: Path, memory: str, dataset: Path
) -> None:
    plant(dataset)
    publish(dataset, memory)
    with pytest.raises(StorageError, match="gen-data verify memory://bucket/set"):
        StoredObjects(memory).sample(0)
    assert escaped(tmp_path) == []


def test_a_data_set_id_that_is_a_path_is_refused(
    tmp_path: Path, memory: str, dataset: Path
) -> None:
    edit_manifest(dataset, dataset_id="../../marker")
    publish(dataset, memory)
    for open_set in (lambda: StoredObjects(memory), lambda: StoredSamples(dataset)):
        with pytest.raises(StorageError, match="dataset_id is not a sha256"):
            open_set()
    assert not list(tmp_path.rglob("marker"))


def test_objects_whose_names_lead_out_are_refused(
    tmp_path: Path, memory: str, dataset: Path
) -> None:
    """As ``verify`` reads data sets at URLs, in part and with all files."""
    objects = publish(dataset, memory)
    system = fsspec.filesystem("memory")
    system.store["/bucket/set/a/../../marker.txt"] = system.store["/bucket/set/plan.json"]
    for read in (lambda: copy_outline(objects, tmp_path / "x"), objects.tree):
        with pytest.raises(StorageError, match=r"marker.txt.*cannot name a file"):
            read()
    assert escaped(tmp_path) == []


def test_an_empty_folder_of_a_manifest_cannot_lie_outside(
    tmp_path: Path, memory: str, dataset: Path
) -> None:
    edit_manifest(dataset, empty_folders=["../marker"])
    objects = publish(dataset, memory)
    with pytest.raises(StorageError, match="cannot name a file"):
        copy_outline(objects, tmp_path / "x")
    assert not (tmp_path / "marker").exists()


def test_merging_a_part_whose_record_leads_out_takes_nothing_of_it(tmp_path: Path) -> None:
    part = tmp_path / "parts/one"
    make(part, 4, 2, settings=Settings(shards=range(1), write_media=write_raw_images))
    path = part / "shards/000000.json"
    path.write_bytes(edit_record(path.read_bytes(), leads_out))
    out = LocalStore(tmp_path / "out/set")
    gather_shards(common_plan([part]), [part], out, allow_mixed_numerics=False)
    assert out.record(0) is None
    assert escaped(tmp_path) == []


@pytest.mark.parametrize("key", ["categories", "sensors", "name"])
def test_names_in_a_manifest_cannot_be_paths(dataset: Path, key: str) -> None:
    info = json.loads((dataset / "manifest.json").read_bytes())["info"]
    if key == "sensors":
        info[key][0]["name"] = UP
    else:
        info[key] = UP if key == "name" else [UP]
    edit_manifest(dataset, info=info)
    with pytest.raises(StorageError, match="cannot name a file"):
        StoredSamples(dataset)


def test_the_split_of_a_sample_cannot_be_a_path(dataset: Path) -> None:
    line = json.loads((dataset / "shards/000000/labels.jsonl").read_text().splitlines()[0])
    with pytest.raises(ValueError, match="cannot name a file"):
        parse_labels(json.dumps({**line, "split": "../train"}))


@pytest.mark.parametrize("name", ["../up", "a/b", "a\nb", "", "x" * 61])
def test_categories_and_classes_name_files(name: str) -> None:
    """COCO's files of keypoints and YOLO's folders have their names."""
    with pytest.raises(ValueError, match=r"class .* cannot name a file"):
        LabelMap(classes={name: ("mug",)})
    with pytest.raises(ValueError, match="cannot name a file"):
        MeshEntry(file="a.obj", category=name)


def edit_manifest(folder: Path, **changes: Any) -> None:
    path = folder / "manifest.json"
    path.write_text(canonical_json({**json.loads(path.read_bytes()), **changes}))
