"""Tables of measurements: radar, inertial units, satellite receivers, odometers, event detectors.

::

    columns.json                 {sensor: {"kind", "columns": [{"name", "type", "meaning"}]}}
    <sensor>/000003.csv          one file per sequence: a header, then a line per row, or
    <sensor>/000003.npy          the same as a NumPy array of records
    <sensor>/poses.jsonl         a line per reading: index of the sample, sequence, time, the
                                 device's model, its pose on the rig and in the world

Every row starts with the index of its sample; ``columns.json`` describes the other columns. Units
are the ends of the names. ``nan`` is "nothing".
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from gen_data.core import capture, measurement_dtypes
from gen_data.core.errors import ConfigError, StorageError
from gen_data.core.interfaces import DatasetInfo, SensorInfo, table_path
from gen_data.core.reported import reported
from gen_data.core.sample import Sample
from gen_data.core.serialization import canonical_json
from gen_data.exporters.base import ANY_FORMAT, ExporterBase
from gen_data.exporters.conventions import SAMPLE, Conventions
from gen_data.exporters.npz import npy_bytes
from gen_data.exporters.sensor_selection import stamp_s
from gen_data.exporters.sequences import write_json, write_text

INDEX = "sample"


class Tables(ExporterBase):
    """Rows of every device except cameras and laser scanners, one file per sequence.

    Attributes:
        format: ``csv`` for spreadsheets, ``npy`` for NumPy.
    """

    type: Literal["tables"] = "tables"
    conventions: ClassVar[Conventions] = Conventions(time=SAMPLE)

    image_formats: ClassVar[frozenset[str]] = ANY_FORMAT
    format: Literal["csv", "npy"] = "csv"

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set without such a device. Raises ConfigError if there is none."""
        if not info.devices:
            raise ConfigError(
                "exporter 'tables': no device writes rows; add a sensor such as imu or radar"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write the pose of each device at its readings; the shard already contains the rows."""
        self.check(info)
        kept = list(samples)
        for sensor in info.devices:
            read = [s for s in kept if table_path(shard_dir, sensor, s.index).exists()]
            lines = "".join(canonical_json(_pose(info, s, sensor)) + "\n" for s in read)
            write_text(shard_dir / self.type / sensor / "poses.jsonl", lines)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Join the rows of every sequence."""
        write_json(dataset_dir / "columns.json", _columns(info))
        for sensor in info.devices:
            folder = dataset_dir / sensor
            poses = (d / self.type / sensor / "poses.jsonl" for d in shard_dirs)
            write_text(folder / "poses.jsonl", "".join(path.read_text("utf-8") for path in poses))
            for sequence, rows in sequence_rows(info, shard_dirs, sensor):
                path = folder / f"{sequence:06d}.{self.format}"
                path.write_bytes({"csv": csv_bytes, "npy": npy_bytes}[self.format](rows))


def write_table(table: capture.Measurements, shard_dir: Path, index: int) -> None:
    """Write the rows of one reading to their ``table_path``."""
    path = table_path(shard_dir, table.sensor, index)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(npy_bytes(table.rows))


def read_rows(path: Path, device: SensorInfo) -> NDArray[np.void]:
    """Read the rows of one reading. Raises StorageError if the file is missing or damaged."""
    try:
        rows: NDArray[np.void] = np.load(path, allow_pickle=False)
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{path}: cannot be read ({error}); generate the data set again"
        ) from error
    if rows.dtype != measurement_dtypes.columns_dtype(device.columns):
        raise StorageError(
            f"{path}: contains no rows of kind '{device.kind}'; generate the data set again"
        )
    return rows


def csv_bytes(rows: NDArray[np.void]) -> bytes:
    """Encode rows as CSV: single precision with 7 significant digits, double with all digits."""
    names = rows.dtype.names or ()
    formats = [_choose_format(rows.dtype[name]) for name in names]
    lines = [",".join(names)]
    lines += [
        ",".join([spell(value) for spell, value in zip(formats, row, strict=True)])
        for row in rows.tolist()
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


def _choose_format(kind: np.dtype[Any]) -> Any:
    if kind.kind != "f":
        return str
    return repr if kind.itemsize == 8 else "{:.7g}".format


def sequence_rows(
    info: DatasetInfo, shard_dirs: Sequence[Path], sensor: str
) -> Iterator[tuple[int, NDArray[np.void]]]:
    """Yield number and rows of every sequence with readings of the device, in order."""
    parts: list[NDArray[Any]] = []
    current = -1
    for index, path in _readings(shard_dirs, sensor):
        sequence = index // info.steps_per_scene
        if parts and sequence != current:
            yield current, np.concatenate(parts)
            parts = []
        current = sequence
        parts.append(_add_index(read_rows(path, info.sensor(sensor)), index))
    if parts:
        yield current, np.concatenate(parts)


def _readings(shard_dirs: Sequence[Path], sensor: str) -> Iterator[tuple[int, Path]]:
    """Yield sample index and file of every reading, in order."""
    for shard_dir in shard_dirs:
        for path in sorted(table_path(shard_dir, sensor, 0).parent.glob("*.npy")):
            yield int(path.stem), path


def _add_index(rows: NDArray[np.void], index: int) -> NDArray[Any]:
    numbered: NDArray[Any] = np.zeros(len(rows), [(INDEX, "<u4"), *rows.dtype.descr])
    numbered[INDEX] = index
    for name in rows.dtype.names or ():
        numbered[name] = rows[name]
    return numbered


def _columns(info: DatasetInfo) -> dict[str, Any]:
    first = {"name": INDEX, "type": "<u4", "meaning": "index of the sample"}
    return {
        sensor: {"kind": kind, "columns": [first, *info.sensor(sensor).columns]}
        for sensor, kind in info.devices.items()
    }


def _pose(info: DatasetInfo, sample: Sample, sensor: str) -> dict[str, Any]:
    device = reported(sample.scene.device(sensor))
    return {
        "index": sample.index,
        "sequence": sample.index // info.steps_per_scene,
        "time_s": stamp_s(sample, sensor),
        "model": device.model,
        "T_rig_device": device.T_rig_device.matrix().tolist(),
        "T_world_device": device.T_world_device.matrix().tolist(),
    }
