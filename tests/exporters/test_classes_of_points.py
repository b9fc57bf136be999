"""Category ids of laser points in exports with a label map: its classes, as readers name them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from gen_data.core.capture import POINT
from gen_data.exporters.kitti import Kitti
from gen_data.exporters.label_map import LabelMap, MappedExporter
from gen_data.exporters.mcap import Mcap
from gen_data.exporters.rerun import Rerun
from gen_data.exporters.webdataset import WebDataset
from tests.exporters.label_readers import tar_samples
from tests.wheels import NO_RERUN

CLASSES = {"walker": ("pedestrian",), "vehicle": ("car",)}
"""In another order than the categories, of which crates are left out."""


def in_tar(folder: Path) -> Any:
    (sample,) = tar_samples(folder / "train")
    assert sample["json"]["categories"] == [*CLASSES]
    column = sample["json"]["columns"]["top.points.npy"].index("category_id")
    return sample["top.points.npy"][:, column]


def in_mcap(folder: Path) -> Any:
    (path,) = folder.glob("train/*.mcap")
    with path.open("rb") as file:
        read = make_reader(file, decoder_factories=[DecoderFactory()])
        ((*_, cloud),) = read.iter_decoded_messages(topics=["/lidar/top/points"])
    return np.frombuffer(cloud.data, POINT)["category_id"]


def in_rerun(folder: Path) -> Any:
    reader = pytest.importorskip("rerun.chunk", reason=NO_RERUN).RrdReader
    (path,) = folder.glob("train/*.rrd")
    (found,) = (
        chunk.to_record_batch()["Points3D:class_ids"].to_pylist()
        for chunk in reader(str(path)).store().stream()
        if "Points3D:class_ids" in chunk.to_record_batch().schema.names
    )
    return found[0]


def in_kitti(folder: Path) -> Any:
    return np.fromfile(folder / "training/velodyne_labels/000000.label", "<u4") & 0xFFFF


@pytest.mark.parametrize(
    ("exporter", "read"),
    [(WebDataset(), in_tar), (Mcap(), in_mcap), (Rerun(), in_rerun),
     (Kitti(types="category"), in_kitti)],
)  # fmt: skip
def test_points_have_the_classes_of_their_instances(
    exporter: Any, read: Callable[[Path], Any], world: Any, tmp_path: Path
) -> None:
    """From 1 in the order of the map; 0 for instances that it leaves out."""
    sample = world.samples[0]
    numbers = {"pedestrian": 1, "car": 2}
    class_of = {i.instance_id: numbers.get(i.category, 0) for i in sample.scene.instances}
    hit = sample.capture.clouds["top"].points["instance_id"].tolist()
    expected = [class_of.get(number, 0) for number in hit]
    assert {*expected} == {0, 1, 2}
    mapped = MappedExporter(exporter, LabelMap(classes=CLASSES))
    folder = world.export(mapped, world.info(1, lidars=("top",)), [sample], tmp_path)
    assert list(map(int, read(folder))) == expected
