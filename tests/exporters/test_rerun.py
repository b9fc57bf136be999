"""Rerun export, read back by rerun-sdk."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun as rr
import rerun.chunk

from gen_data.core.capture import Channel
from gen_data.core.errors import StorageError
from gen_data.core.interfaces import media_path
from gen_data.exporters.rerun import Rerun
from gen_data.exporters.rrd_container import write_recording
from tests.exporters.datasets import made_of

CLI = (sys.executable, "-c", "import sys; from rerun_cli.__main__ import main; sys.exit(main())")
"""The tool ``rerun`` of this environment."""
Table = dict[str, dict[int, Any]]
dataset = made_of(Rerun(samples_per_file=3))


def chunks(*paths: Path) -> Iterator[Any]:
    for path in paths:
        yield from rerun.chunk.RrdReader(str(path)).store().stream()


def tables(*paths: Path) -> dict[str, Table]:
    """Values by entity, component and sample; -1 for values without a time."""
    found: dict[str, Table] = {}
    for chunk in chunks(*paths):
        batch = chunk.to_record_batch()
        names = batch.schema.names
        indices = batch["sample"].to_pylist() if "sample" in names else [-1] * batch.num_rows
        for name, column in zip(names, batch.columns, strict=True):
            if ":" in name:
                values = dict(zip(indices, column.to_pylist(), strict=True))
                found.setdefault(chunk.entity_path, {}).setdefault(name, {}).update(values)
    return found


def problems(root: Path, shards: Path, world: Any) -> list[str]:
    read = tables(*sorted(root.glob("*/*.rrd")))
    image = "/world/cameras/color/image"
    found = []
    for sample in world.samples:
        truth, k = sample.truth["color"], sample.index
        seen = [t for t in truth.objects if t.box3d_world is not None and not t.ignored]
        intrinsics = truth.camera.intrinsics
        stored = media_path(shards / f"{k // 3:06d}", "color", Channel.RGB, k).read_bytes()
        halves = [np.divide(t.box3d_world.size_m, 2) for t in seen]
        classes = [t.instance.category_id for t in seen]
        boxes = [t.box for t in truth.objects if t.box is not None and not t.ignored]
        centres = [((b.x_min + b.x_max) / 2, (b.y_min + b.y_max) / 2) for b in boxes]
        position_m = truth.camera.T_world_camera.translation_m
        expected = {
            "position": (read["/world/cameras/color"]["Transform3D:translation"], [position_m]),
            "pinhole": (read[image]["Pinhole:image_from_camera"], [intrinsics.matrix().T.ravel()]),
            "half sizes": (read["/world/boxes"]["Boxes3D:half_sizes"], halves),
            "classes": (read["/world/boxes"]["Boxes3D:class_ids"], classes),
            "boxes": (read[f"{image}/boxes"]["Boxes2D:centers"], centres),
        }
        for name, (values, wanted) in expected.items():
            got = np.array(values.get(k, []), np.float64)
            if got.shape != np.shape(wanted) or not np.allclose(got, wanted, atol=1e-4):
                found.append(f"{name} {k}")
        blob = read[f"{image}/rgb"]["EncodedImage:blob"].get(k)
        if blob is None or bytes(blob[0]) != stored:
            found.append(f"pixels {k}")
    return found


def test_recordings_hold_the_samples_and_the_tool_verifies_them(dataset: Path, world: Any) -> None:
    """Poses, pinholes, boxes, classes, and the bytes of the photographs."""
    assert problems(dataset, dataset.parent / "shards", world) == []
    assert [p.relative_to(dataset).as_posix() for p in sorted(dataset.glob("*/*"))] == [
        "train/000000.rrd",
        "train/000001.rrd",
        "val/000000.rrd",
    ]
    # The footer, which is written again, fits the chunks; a cut file does not pass.
    path = dataset / "train/000000.rrd"
    cut = dataset.parent / "cut.rrd"
    cut.write_bytes(path.read_bytes()[:-40])
    codes = [
        subprocess.run([*CLI, "rrd", "verify", file], capture_output=True, check=False).returncode
        for file in (path, cut)
    ]
    assert codes[0] == 0
    assert codes[1] != 0


def test_scans_and_instants_of_a_drive(exported: Any, samples: Any) -> None:
    """Points have their classes and poses; the timeline in seconds runs on."""
    (path,) = exported(Rerun()).glob("train/*.rrd")
    read = tables(path)
    drive = [sample for sample in samples if sample.split == "train"]
    scans = read["/world/lidars/top"]
    for sample in drive:
        cloud = sample.capture.clouds["top"]
        points = np.array(scans["Points3D:positions"][sample.index])
        np.testing.assert_array_equal(points, cloud.points["position_m"])
        classes = np.array(scans["Points3D:class_ids"][sample.index])
        np.testing.assert_array_equal(classes, cloud.points["category_id"])
        (position_m,) = scans["Transform3D:translation"][sample.index]
        np.testing.assert_allclose(position_m, cloud.lidar.T_world_lidar.translation_m, atol=1e-4)
    times_s = [value.total_seconds() for _, value in sorted(read_times(path).items())]
    assert times_s == sorted(times_s)
    assert len(times_s) == len(drive)


def read_times(path: Path) -> dict[int, Any]:
    """Instant of each sample on the timeline ``time``."""
    found = {}
    for chunk in chunks(path):
        if chunk.entity_path == "/world/boxes":
            batch = chunk.to_record_batch()
            found.update(zip(batch["sample"].to_pylist(), batch["time"].to_pylist(), strict=True))
    return found


def a_chunk() -> Any:
    """Two rows of points with several components."""
    columns = rr.Points3D.columns(positions=[[0, 0, 1], [0, 1, 0]], class_ids=[1, 2])
    index = rr.TimeColumn("sample", sequence=[0, 1])
    return rerun.chunk.Chunk.from_columns("a/b", indexes=[index], columns=columns)


def test_files_do_not_depend_on_clock_or_hashing(tmp_path: Path) -> None:
    """Files that the SDK itself writes differ every time."""
    ours, theirs = set(), set()
    for k in range(4):
        path = tmp_path / f"{k}.rrd"
        write_recording(path, [a_chunk(), a_chunk()], "name")
        ours.add(path.read_bytes())
        store = rerun.chunk.ChunkStore.from_chunks([a_chunk()])
        store.write_rrd(str(path), application_id="test", recording_id="name")
        theirs.add(path.read_bytes())
    assert (len(ours), len(theirs)) == (1, 4)


_SCRIPT = """
import sys
from pathlib import Path
import rerun, rerun.chunk
from gen_data.exporters.rrd_container import write_recording
columns = rerun.Points3D.columns(positions=[[0, 0, 1], [0, 1, 0]], class_ids=[1, 2])
index = rerun.TimeColumn("sample", sequence=[0, 1])
chunk = rerun.chunk.Chunk.from_columns("a/b", indexes=[index], columns=columns)
write_recording(Path(sys.argv[1]), [chunk, chunk], "name")
"""


@pytest.mark.slow
def test_processes_write_the_same_bytes(dataset: Path, tmp_path: Path) -> None:
    """Maps of the SDK are hashed with another key in each."""
    files = [tmp_path / f"{k}.rrd" for k in range(2)]
    for file in files:
        subprocess.run([sys.executable, "-c", _SCRIPT, file], check=True)
    assert len({file.read_bytes() for file in files}) == 1


def test_an_unknown_container_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another release of rerun-sdk may write one."""
    written = rerun.chunk.ChunkStore.write_rrd

    def other(self: Any, path: str, **facts: str) -> None:
        written(self, path, **facts)
        data = bytearray(Path(path).read_bytes())
        data[-20] ^= 1
        Path(path).write_bytes(bytes(data))

    monkeypatch.setattr(rerun.chunk.ChunkStore, "write_rrd", other)
    with pytest.raises(StorageError, match=r"expected the structure of rerun-sdk 0\.41"):
        write_recording(tmp_path / "a.rrd", [a_chunk()], "name")
