"""The promises of every exporter, whatever it writes; a new one is tested before it has tests."""

from pathlib import Path
from typing import Any

import pytest

from gen_data import annotations
from gen_data.exporters import TABLE
from gen_data.exporters.label_map import LabelMap, MappedExporter
from tests.exporters.datasets import Source, drive, pairs, reach, scanned_street
from tests.exporters.test_nuscenes_expansions import town
from tests.exporters.test_occupancy import gridded
from tests.exporters.test_scene_text import texts
from tests.exporters.test_tapvid import tracked
from tests.tiers import sampled

PACKED = {"huggingface", "map_vectors", "opendrive", "rlds", "tfrecord", "webdataset", "rerun"}
"""Formats with several samples in a file."""
EVERY_CLASS = {"coco", "tfrecord", "voc", "webdataset"}
"""Formats with regions that a score leaves out class by class; see ``test_ignored_objects``."""
NO_CLASS = {"cityscapes", "hdf5", "kitti", "kitti_tracking", "language", "motchallenge"}
"""Formats with a mark for ignored objects that needs no class, or that only mention them."""
OWN_IMAGES = PACKED | {
    "hdf5", "lerobot", "lidar_flow", "mcap", "occupancy", "pointclouds", "semantickitti", "tables",
    "tapvid", "usd",
}  # fmt: skip
"""Formats without image files of the shards."""
TRACKS = {"argoverse2", "nuscenes"}
"""Formats of tracks, from which an ignored object disappears and a missing one does not."""
WITHOUT_OBJECTS = {
    "calibration", "culane", "graspnet", "kitti_stereo", "lerobot", "lidar_flow",
    "map_vectors", "opendrive", "openlane", "rlds", "scannet", "scene_text", "semantickitti",
    "tables", "tapvid", "tum_rgbd",
}  # fmt: skip
"""Formats that state no object, or of which every surface keeps its class."""


def files(folder: Path) -> dict[str, bytes]:
    found = (p for p in folder.rglob("*") if p.is_file())
    return {str(p.relative_to(folder)): p.read_bytes() for p in found}


SOURCES: dict[str, Source] = {
    "bop": lambda world: (world.info(7), world.with_bodies(world.samples)),
    "kitti_stereo": pairs,
    "lidar_flow": drive,
    "occupancy": gridded,
    "scene_text": texts,
    "tapvid": tracked,
    **dict.fromkeys(("lerobot", "rlds"), reach),
    **dict.fromkeys(("argoverse2", "map_vectors", "opendrive"), town),
}
"""Data sets of formats with needs; of all others the street."""


def given(exporter: Any, world: Any) -> tuple[Any, Any]:
    return SOURCES.get(exporter.type, scanned_street)(world)


@pytest.fixture(scope="module", params=sampled(TABLE.names(), 2))
def exporter(request: pytest.FixtureRequest) -> Any:
    return TABLE.load(request.param)()


def test_no_image_is_stored_twice_and_texts_are_utf8_with_lf(exporter: Any, written: Path) -> None:
    """Files of the data set with the bytes of a file of the shards are links to it."""
    assert exporter.needs <= set(annotations.TABLE), "annotators that exist"
    places: dict[bytes, set[int]] = {}
    for path in written.glob("shards/**/*.[pj][np]g"):
        places.setdefault(path.read_bytes(), set()).add(path.stat().st_ino)
    images = [p for p in (written / "dataset").rglob("*.[pj][np]g") if p.read_bytes() in places]
    assert all(path.stat().st_ino in places[path.read_bytes()] for path in images)
    assert bool(images) == (exporter.type not in OWN_IMAGES)
    for name, data in files(written / "dataset").items():
        if name.endswith((".json", ".txt")):
            assert b"\r" not in data.decode("utf-8").encode()


@pytest.fixture(scope="module")
def written(exporter: Any, world: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three shards in order, and the data set that they are merged to."""
    folder = tmp_path_factory.mktemp(exporter.type)
    world.export(exporter, *given(exporter, world), folder)
    return folder


def test_shards_come_in_any_order_and_their_names_depend_on_indices_only(
    exporter: Any, world: Any, written: Path, tmp_path: Path
) -> None:
    """A shard written alone equals the same shard of the whole data set."""
    info, samples = given(exporter, world)
    backwards = world.export(exporter, info, samples, tmp_path, backwards=True)
    forwards = files(written / "dataset")
    assert forwards == files(backwards)
    assert len(forwards) >= (2 if exporter.type in PACKED else len(samples))
    world.export(exporter, info, samples[3:6], tmp_path / "alone")
    assert files(written / "shards/000001") == files(tmp_path / "alone/shards/000000")


@pytest.mark.parametrize("size", [1, 7])
def test_the_size_of_shards_leaves_no_trace(
    exporter: Any, world: Any, written: Path, tmp_path: Path, size: int
) -> None:
    """Shards of one, three or seven samples: the merged data set has the same bytes.

    Also if the runner keeps arrays of images and points that are written already.
    """
    info, samples = given(exporter, world)
    other = world.export(exporter, info, samples, tmp_path, shard_size=size, keep_arrays=size == 7)
    assert files(other) == files(written / "dataset")


def test_only_formats_with_a_mark_have_ignored_objects_with_or_without_a_class(
    exporter: Any, world: Any, tmp_path: Path
) -> None:
    """All others write the same bytes as without the object."""
    info, samples = given(exporter, world)
    ignored = world.ignoring(samples[0])
    missing = world.with_objects(samples[0], lambda objects: objects[1:])
    marked, left_out = (
        files(world.export(exporter, info, [sample], tmp_path / str(number)))
        for number, sample in enumerate((ignored, missing))
    )
    # Texts of the data set are the same in both cases.
    marks = (EVERY_CLASS | NO_CLASS | TRACKS) - {"language"}
    assert (marked != left_out) == (exporter.type in marks)
    # All others leave them out: their readers would take class 0 for the first or last class.
    classes = {name: (name,) for name in info.categories[1:]}
    maps = [LabelMap(classes=classes, others=others) for others in ("drop", "ignore")]
    dropped, ignored = (
        files(world.export(MappedExporter(exporter, m), info, samples[:1], tmp_path / m.others))
        for m in maps
    )
    assert (dropped != ignored) == (exporter.type in EVERY_CLASS | NO_CLASS)


def test_ignored_categories_are_left_out_by_formats_without_a_mark(
    exporter: Any, world: Any, tmp_path: Path
) -> None:
    """As dropped ones, also from boxes in space, which have no images."""
    info, samples = given(exporter, world)
    maps = {
        "all": LabelMap(),
        "dropped": LabelMap(drop=("car",)),
        "ignored": LabelMap(ignore=("car",)),
    }
    plain, dropped, ignored = (
        files(world.export(MappedExporter(exporter, m), info, samples[:1], tmp_path / name))
        for name, m in maps.items()
    )
    assert (plain != dropped) == (exporter.type not in WITHOUT_OBJECTS)
    assert (dropped != ignored) == (exporter.type in EVERY_CLASS | NO_CLASS)
