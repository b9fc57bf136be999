"""WebDataset: tar files of samples, to be read in sequence.

::

    train/street-000000.tar, train/street-000001.tar, ...    val/..., test/...
        000000012.json              labels of the sample
        000000012.color.rgb.png     images: <camera>.<channel>.png
        000000012.top.points.npy    laser scans: <lidar>.points.npy, the columns of ``POINT``
        000000012.imu.rows.npy      rows of other devices: <device>.rows.npy

The key of a sample is its index; everything after the first dot is the name of a field, in lower
case. A sensor that does not read at a sample has no field there.

Arrays are matrices [rows, columns] of float32, or float64 where a column needs it: Hugging Face's
reader of these files refuses records.

``json`` has ``index``, ``scene``, ``view``, ``step``, ``split``, ``time_s``, ``categories``,
``depth_scale_m``, ``cameras``, ``lidars`` and ``columns``: names of the columns by field. A
camera's entry is COCO's row of its image (``gen_data.exporters.coco``) with the rows of its objects
under ``annotations``; a scanner's is its ``T_world_lidar`` and the instant of its sweep.

Tar files hold a fixed number of samples and no time, user or mode of the machine; images are the
shards' PNG files, ``gen_data.exporters.image_files`` states their units.

Reference: https://github.com/webdataset/webdataset, ``WebDataset`` and ``base_plus_ext``.
"""

import io
import math
import tarfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured
from numpy.typing import NDArray
from pydantic import Field

from gen_data.core import errors, serialization
from gen_data.core.interfaces import DatasetInfo, cloud_path, origins_path, table_path
from gen_data.core.reported import reported, reported_s
from gen_data.core.sample import Sample
from gen_data.exporters import base, coco, fragments, sensor_selection, sequences
from gen_data.exporters.conventions import EDGES, READING, Conventions
from gen_data.exporters.point_cloud_io import class_facts, with_classes

SAMPLES = "samples"


class WebDataset(base.ExporterBase):
    """Tar files of samples: images, scans, rows and labels of all sensors.

    Attributes:
        samples_per_tar: Samples in each tar file except the last one of a split.
    """

    type: Literal["webdataset"] = "webdataset"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i + 0.5",
        box=EDGES,
        lens="any; `lens` of cameras",
        time=f"{READING}; `time_s` of points from the start of the sweep",
        ring="highest laser",
        intensity="0 to 1",
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"instance_masks", "boxes2d"})

    image_formats: ClassVar[frozenset[str]] = base.ANY_FORMAT
    samples_per_tar: int = Field(500, ge=1)

    def check(self, info: DatasetInfo) -> None:
        """Reject names of sensors that are equal in lower case.

        Raises:
            ConfigError: two names differ in case only.
        """
        seen: dict[str, str] = {}
        for name in (sensor.name for sensor in info.sensors):
            other = seen.setdefault(name.lower(), name)
            if other != name:
                raise errors.ConfigError(
                    f"exporter '{self.type}': sensors '{other}' and '{name}' differ in case only, "
                    "but fields have lower-case names; rename one of them"
                )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write one JSON line per sample: its labels."""
        self.check(info)
        rows = (
            {"split": s.split, "labels": sample_labels(info, s), **class_facts(info, s.scene)}
            for s in samples
        )
        fragments.write_fragment(shard_dir / self.type, SAMPLES, rows)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Pack the samples of each split, in order."""
        tars: dict[str, _TarFiles] = {}
        try:
            for shard_dir, row in fragments.fragment_rows(shard_dirs, self.type, SAMPLES):
                split, labels = row["split"], row["labels"]
                if split not in tars:
                    stem = "_".join(info.name.split())
                    tars[split] = _TarFiles(dataset_dir / split / stem, self.samples_per_tar)
                key = f"{labels['index']:09d}"
                tars[split].add(key, _fields(info, shard_dir, labels, row.get("classes")))
        finally:
            for files in tars.values():
                files.close()


def sample_labels(info: DatasetInfo, sample: Sample) -> dict[str, Any]:
    """Labels of all sensors of a sample; see the top of this module."""
    return {
        "index": sample.index,
        "scene": sample.scene_index,
        "view": sample.view_index,
        "step": sample.step_index,
        "sequence": sequences.sequence_number(info, sample.index),
        "split": sample.split,
        "time_s": sample.scene.time_s,
        "categories": info.categories,
        "depth_scale_m": info.depth_scale_m,
        "conventions": WebDataset.conventions.facts(),
        "cameras": {name: coco.image_labels(info, sample, name) for name in sorted(sample.truth)},
        "lidars": {
            name: {
                "time_s": reported_s(cloud),
                "T_world_lidar": reported(cloud.lidar).T_world_lidar.matrix().tolist(),
            }
            for name, cloud in sorted(sample.capture.clouds.items())
        },
    }


def _fields(
    info: DatasetInfo,
    shard_dir: Path,
    labels: Mapping[str, Any],
    classes: Mapping[str, int] | None,
) -> Iterator[tuple[str, bytes]]:
    """Yield name and bytes of each field of a sample, sorted by name."""
    index = labels["index"]
    paths = {
        f"{camera}.{channel.value}{info.encoding(camera, channel).suffix}": info.media_path(
            shard_dir, camera, channel, index
        )
        for camera in labels["cameras"]
        for channel in info.media[camera]
    }
    for lidar in info.lidars:
        if sensor_selection.has_scans(shard_dir, lidar, index):
            paths[f"{lidar}.points.npy"] = cloud_path(shard_dir, lidar, index)
        if (path := origins_path(shard_dir, lidar, index)).exists():
            paths[f"{lidar}.origins.npy"] = path
    for device in info.devices:
        path = table_path(shard_dir, device, index)
        if path.exists():
            paths[f"{device}.rows.npy"] = path
    columns: dict[str, list[str]] = {}
    fields: dict[str, bytes] = {}
    for name, path in paths.items():
        if path.suffix == ".npy":
            records = with_classes(np.load(path, allow_pickle=False), classes)
            columns[name.lower()], fields[name] = _plain_npy(records)
        else:
            fields[name] = path.read_bytes()
    fields["json"] = serialization.canonical_json({**labels, "columns": columns}).encode()
    for name in sorted(fields):
        yield name.lower(), fields[name]


def _plain_npy(records: NDArray[np.void]) -> tuple[list[str], bytes]:
    """Names of the columns of an array of records, and the matrix as a file."""
    columns = [
        name if not shape else f"{name}[{k}]"
        for name in records.dtype.names or ()
        for shape in (records.dtype[name].shape,)
        for k in range(math.prod(shape))
    ]
    exact = all(
        np.can_cast(records.dtype[name].base, np.float32) for name in records.dtype.names or ()
    )
    matrix = structured_to_unstructured(records, np.float32 if exact else np.float64)
    file = io.BytesIO()
    np.save(file, matrix, allow_pickle=False)
    return columns, file.getvalue()


class _TarFiles:
    """Tar files of one split; each is opened with its first sample."""

    def __init__(self, stem: Path, samples_per_tar: int) -> None:
        self._stem, self._samples_per_tar = stem, samples_per_tar
        self._samples = 0
        self._tar: tarfile.TarFile | None = None

    def add(self, key: str, fields: Iterable[tuple[str, bytes]]) -> None:
        if self._samples % self._samples_per_tar == 0:
            self._open_next()
        assert self._tar is not None, "opened with the first sample"
        self._samples += 1
        for name, data in fields:
            # A new TarInfo has time 0, user 0 without a name, and mode 0644.
            member = tarfile.TarInfo(f"{key}.{name}")
            member.size = len(data)
            self._tar.addfile(member, io.BytesIO(data))

    def close(self) -> None:
        if self._tar is not None:
            self._tar.close()

    def _open_next(self) -> None:
        self.close()
        number = self._samples // self._samples_per_tar
        path = self._stem.with_name(f"{self._stem.name}-{number:06d}.tar")
        path.parent.mkdir(parents=True, exist_ok=True)
        self._tar = tarfile.open(path, "w", format=tarfile.USTAR_FORMAT)  # noqa: SIM115
