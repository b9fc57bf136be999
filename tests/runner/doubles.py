"""A tiny pipeline, exporter and image writer; each can be told to misbehave at one index."""

from __future__ import annotations

import hashlib
import json
import math
import os
import shutil
import signal
import tempfile
import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gen_data.core.boxes import BoxPx
from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.errors import Rejection, SampleError, SceneRejected
from gen_data.core.interfaces import DatasetInfo, Exporter, Modality, SensorInfo, media_path
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, MaskPx, ObjectTruth, Sample
from gen_data.core.scene import Camera, Instance, Light, Scene
from gen_data.core.se3 import IDENTITY
from gen_data.core.serialization import canonical_json
from gen_data.core.streams import Streams
from gen_data.runner.plan import Plan
from gen_data.runner.run import Settings, Summary, run

WIDTH_PX, HEIGHT_PX = 8, 6
CATEGORIES = ("bowl", "mug")
RESUME = "gen-data --config fake.yaml --n 10 --out here"


@dataclass(frozen=True)
class Trouble:
    """Faults by sample index; -1 = no fault.

    Attributes:
        killed_at: The process kills itself.
        killed_once_at: The process kills itself the first time; ``marker`` remembers.
        hangs_once_at: The process stops making progress the first time.
        rejected_at, wrong_at, bug_at: It raises SceneRejected, SampleError, or ValueError.
        hangs_at: It stops making progress every time.
        errors: It raises these.
        nan_at: The light of its scene is NaN, which is found when its images are written.
        start_fails: The pipeline's process dies before it is ready.
        ballast: Makes the description of the work larger.
    """

    killed_at: int = -1
    killed_once_at: int = -1
    hangs_once_at: int = -1
    rejected_at: int = -1
    wrong_at: int = -1
    bug_at: int = -1
    hangs_at: int = -1
    errors: Mapping[int, BaseException] = field(default_factory=dict)
    nan_at: int = -1
    start_fails: bool = False
    marker: str = ""
    delay_s: float = 0.0
    ballast: bytes = b""


@dataclass(frozen=True)
class LinesExporter:
    """One JSON line per annotated object; links every image next to them."""

    needs: frozenset[str] = frozenset()

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        del info
        lines = [
            {"image": s.image_id(sensor), "category": o.instance.category, "px": o.visible_px}
            for s in samples
            for sensor, truth in sorted(s.truth.items())
            for o in truth.objects
        ]
        folder = shard_dir / "lines"
        folder.mkdir()
        (folder / "part.jsonl").write_text("".join(f"{canonical_json(line)}\n" for line in lines))

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        parts = [(d / "lines" / "part.jsonl").read_text() for d in shard_dirs]
        (dataset_dir / "all.jsonl").write_text("".join(parts))
        (dataset_dir / "images").mkdir()
        for shard_dir in shard_dirs:
            for sensor in info.cameras:
                for path in sorted((shard_dir / sensor / "rgb").iterdir()):
                    os.link(path, dataset_dir / "images" / f"{path.stem}_{sensor}.png")


@dataclass(frozen=True)
class FakePipeline:
    """Samples of 8 x 6 pixels, drawn from the index alone; its engine has temporary files."""

    n: int
    trouble: Trouble
    exporters: Mapping[str, Exporter] = field(default_factory=lambda: {"lines": LinesExporter()})
    _closing: ExitStack = field(default_factory=ExitStack)

    @property
    def info(self) -> DatasetInfo:
        color = SensorInfo("color", Modality.CAMERA, channels=(Channel.RGB,))
        return DatasetInfo("fake", 7, self.n, 2, CATEGORIES, (color,))

    def __enter__(self) -> FakePipeline:
        folder = tempfile.mkdtemp(prefix="gen-data-engine-")
        if self.trouble.start_fails:
            os.kill(os.getpid(), signal.SIGKILL)
        self._closing.callback(shutil.rmtree, folder)
        return self

    def __exit__(self, *exception: object) -> None:
        self._closing.close()

    def sample(self, index: int) -> Sample:
        """Sample number ``index``, or the trouble it is in."""
        self._make_trouble(index)
        sample = fake_sample(index)
        if index == self.trouble.nan_at:
            light = replace(sample.scene.lights[0], illuminance_lux=math.nan)
            sample = replace(sample, scene=replace(sample.scene, lights=(light,)))
        return sample

    def _make_trouble(self, index: int) -> None:
        trouble = self.trouble
        time.sleep(trouble.delay_s)
        if index == trouble.killed_at or (
            index == trouble.killed_once_at and first_time(trouble.marker)
        ):
            os.kill(os.getpid(), signal.SIGKILL)
        if index == trouble.hangs_once_at and first_time(trouble.marker):
            time.sleep(600)
        if index == trouble.hangs_at:
            time.sleep(600)
        if index in trouble.errors:
            raise trouble.errors[index]
        if index == trouble.rejected_at:
            raise SceneRejected(index // 2, (Rejection("object fell off", "fewer objects"),))
        if index == trouble.wrong_at:
            raise SampleError("two labels contradict each other")
        if index == trouble.bug_at:
            raise ValueError("a wheel came off")


@dataclass(frozen=True)
class FakeFactory:
    n: int
    trouble: Trouble = Trouble()

    def __call__(self) -> FakePipeline:
        return FakePipeline(self.n, self.trouble)


def first_time(marker: str) -> bool:
    """Whether nobody asked before; the file remembers across processes."""
    try:
        os.close(os.open(marker, os.O_CREAT | os.O_EXCL))
    except FileExistsError:
        return False
    return True


def fake_sample(index: int) -> Sample:
    """A sample whose every byte follows from its index."""
    rng = Streams(7, index).rng("fake")
    rgb = rng.integers(0, 256, (HEIGHT_PX, WIDTH_PX, 3), dtype=np.uint8)
    intrinsics = Intrinsics(WIDTH_PX, HEIGHT_PX, 8.0, 8.0, WIDTH_PX / 2, HEIGHT_PX / 2)
    camera = Camera("color", IDENTITY, intrinsics)
    instance = Instance(1, f"thing-{index}", CATEGORIES[index % 2], index % 2 + 1, "asset")
    pixels = rng.uniform(size=(2, 3)) < 0.7
    # The mask fills its box, as every tight mask does.
    pixels[0, 0] = pixels[-1, -1] = True
    mask = MaskPx(1, 1, pixels)
    truth = ObjectTruth(instance, int(pixels.sum()), BoxPx(1, 1, 4, 3), mask=mask)
    light = Light("sun", "sun", illuminance_lux=float(rng.uniform(100.0, 900.0)))
    return Sample(
        index=index,
        scene_index=index // 2,
        view_index=index % 2,
        split="val" if index // 2 % 4 == 3 else "train",
        scene=Scene("fake", instances=(instance,), lights=(light,), cameras=(camera,)),
        capture=Capture({"color": SensorReading("color", camera, {Channel.RGB: rgb})}),
        truth={"color": ImageTruth(camera, (truth,))},
        attempts=1 + index // 2 % 3,
        timings_s={"render": 0.25, "physics": 0.5},
    )


def write_raw_images(info: DatasetInfo, sample: Sample, shard_dir: Path) -> None:
    """The bare bytes of every image, under the name its PNG would have."""
    for sensor in info.cameras:
        for channel in info.media[sensor]:
            path = media_path(shard_dir, sensor, channel, sample.index)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(sample.capture.readings[sensor].channels[channel].tobytes())


def fake_plan(n: int = 10, shard_size: int = 4, **changes: object) -> Plan:
    config = {"camera": {"fov_deg": 50}, "objects": [{"count": 3}], **changes}
    return Plan(
        config, "fake", 7, n, shard_size, versions={"gen-data": "0"}, assets={"asset": "00" * 32}
    )


def make(
    out: Path | str,
    n: int = 10,
    shard_size: int = 4,
    *,
    workers: int = 0,
    trouble: Trouble | None = None,
    settings: Settings | None = None,
) -> Summary:
    return run(
        fake_plan(n, shard_size),
        FakeFactory(n, trouble or Trouble()),
        out,
        replace(
            settings or Settings(write_media=write_raw_images),
            workers=workers,
            resume_command=RESUME,
        ),
        licences=lambda assets: f"# Assets\n\n{', '.join(assets)}\n",
    )


def tree_digest(folder: Path) -> str:
    """sha256 over the sorted lines ``sha256  path`` of every file outside ``run/``."""
    lines = [
        f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder)}"
        for path in folder.rglob("*")
        if path.is_file() and path.relative_to(folder).parts[0] != "run"
    ]
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


def notes_of(out: Path) -> list[str]:
    """Entries of the run's log about its workers."""
    entries = [json.loads(line) for line in (out / "run" / "log.jsonl").read_text().splitlines()]
    return [entry["note"] for entry in entries if "note" in entry]
