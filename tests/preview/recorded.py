"""Samples of one camera, and the calls that a recording makes to rerun's stream for samples."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.sample import ImageTruth, Sample
from gen_data.core.scene import Camera, Scene
from gen_data.core.se3 import SE3
from gen_data.preview.rerun_recording import Recorder

CAMERA = Camera("color", SE3(), Intrinsics(80, 60, 50.0, 50.0, 40.0, 30.0))
UNNAMED = DatasetInfo("t", 1, 1, 1, (), ())
GREY = {Channel.RGB: np.full((60, 80, 3), 90, np.uint8)}


def photograph(
    channels: Mapping[Channel, Any] = GREY, camera: Camera = CAMERA, **labels: Any
) -> Sample:
    """A sample of one camera, with the labels of its image."""
    reading = SensorReading(camera.name, camera, dict(channels))
    truth = {camera.name: ImageTruth(camera, **{"objects": (), **labels})}
    scene = Scene("s", cameras=(camera,))
    return Sample(0, 0, 0, "train", scene, Capture({camera.name: reading}), truth)


class Stream:
    """Keeps each path with its value and the time [s] it was logged at, in order."""

    def __init__(self) -> None:
        self.logged: list[tuple[str, Any, float | None]] = []
        self.blueprints: list[Any] = []
        self._time_s: float | None = None

    def log(self, path: str, value: Any, *_: Any, static: bool = False) -> None:
        self.logged.append((path, value, self._time_s))

    def set_time(
        self, timeline: str, *, sequence: int | None = None, duration: float | None = None
    ) -> None:
        if timeline == "time":
            self._time_s = duration

    def send_blueprint(self, blueprint: Any) -> None:
        self.blueprints.append(blueprint)

    def at(self, path: str) -> list[Any]:
        """All values of a path, in order."""
        return [value for name, value, _ in self.logged if name == path]


def recorded(*samples: Sample, info: DatasetInfo = UNNAMED, assets: Any = None) -> Stream:
    """The calls of a recording of samples, from its start."""
    stream = Stream()
    recorder = Recorder(stream, assets, info)  # type: ignore[arg-type]
    recorder.start()
    for sample in samples:
        recorder.record(sample)
    return stream
