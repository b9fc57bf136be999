"""Views of a data set for exporters: some of its sensors, and bent lenses rectified.

A view works between the samples and an exporter, which receives a data set of pinholes and nothing
else. Shards and ``labels.jsonl`` keep every sensor as it is. Rectified images are written to
``_rectified...`` in the folder of their shard, with links to the files of the other sensors: this
folder is the shard of the data set that the exporter sees. Exporters with equal settings share it.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TypeVar

from gen_data.annotations.annotate import Thresholds
from gen_data.core.capture import Capture, Channel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo, Exporter, Modality, reading_paths
from gen_data.core.sample import EgoTruth, ImageTruth, Sample
from gen_data.core.scene import Camera, Device, Lidar, Scene
from gen_data.exporters.base import (
    ExporterBase,
    Rectify,
    WrappedExporter,
    check_delivery,
    check_image_formats,
    select_names,
)
from gen_data.exporters.image_files import encode_channel, link_or_copy, read_image
from gen_data.pipeline.rectification import (
    NOTHING,
    rectification,
    rectified_tracks,
    rectified_truth,
)

T = TypeVar("T")

FOLDER = "_rectified"
"""Begins like the name of no sensor."""


@dataclass(frozen=True)
class ExporterView(WrappedExporter):
    """An exporter that sees some sensors of a data set, with bent lenses rectified.

    Attributes:
        cameras, sensors: Names and patterns of cameras, and of the other sensors; empty = all.
        rectify: How; None = lenses remain as they are.
        thresholds: For listing objects of rectified images.
    """

    cameras: tuple[str, ...] = ()
    sensors: tuple[str, ...] = ()
    rectify: Rectify | None = None
    thresholds: Thresholds = field(default_factory=Thresholds)

    @property
    def needs(self) -> frozenset[str]:
        """Annotators of the exporter; rectified labels follow from masks."""
        return self.exporter.needs | ({"instance_masks"} if self.rectify else set())

    @property
    def image_formats(self) -> frozenset[str]:
        """As the exporter."""
        formats: frozenset[str] = getattr(self.exporter, "image_formats", frozenset({"png"}))
        return formats

    def info(self, info: DatasetInfo) -> DatasetInfo:
        """The data set as the exporter sees it. Raises ConfigError if a name fits no sensor."""
        cameras = select_names(self.cameras, info.cameras, f"{self._place}: cameras")
        others = [s.name for s in info.sensors if s.modality is not Modality.CAMERA]
        kept = {*cameras, *select_names(self.sensors, others, f"{self._place}: sensors")}
        sensors = []
        for sensor in info.sensors:
            if sensor.name in kept and self.rectify and sensor.lens != "pinhole":
                channels = tuple(c for c in sensor.channels if c in NOTHING)
                sensors.append(replace(sensor, lens="pinhole", channels=channels))
            elif sensor.name in kept:
                sensors.append(sensor)
        return replace(info, sensors=tuple(sensors))

    def check(self, info: DatasetInfo) -> None:
        """Raise the exporter's refusals, and refuse sensors that cannot be rectified.

        Raises:
            ConfigError: also a name that fits no sensor, or texts about images that are rectified.
        """
        seen = self.info(info)
        check_image_formats(self, seen)
        check_delivery(getattr(self.exporter, "exporter", self.exporter), seen)
        if self.rectify and {"language", "text"} & self.exporter.needs:
            raise ConfigError(
                f"{self._place}: rectify: its texts are about the images as they are; "
                "expected a camera with a pinhole"
            )
        self.exporter.check(seen)

    def check_scene(self, scene: Scene) -> None:
        """Refuse lenses that no pinhole can show, before anything is generated."""
        for camera in scene.cameras:
            self._camera(camera)

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write rectified images, and the labels of one shard as the exporter sees them."""
        seen, folder = self.info(info), self._folder(shard_dir)
        folder.mkdir(parents=True, exist_ok=True)

        def view(sample: Sample) -> Sample:
            if self.rectify:
                self._write_media(info, seen, sample, shard_dir)
            return self._sample(seen, sample, folder)

        self.exporter.write_shard(seen, map(view, samples), folder)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Merge all shards."""
        folders = [self._folder(folder) for folder in shard_dirs]
        self.exporter.finalize(self.info(info), folders, dataset_dir)

    @property
    def _place(self) -> str:
        return f"exporter '{self.type}'"

    def _folder(self, shard_dir: Path) -> Path:
        if self.rectify is None:
            return shard_dir
        if self.rectify.hfov_deg is not None:
            return shard_dir / f"{FOLDER}_hfov_{self.rectify.hfov_deg:g}"
        return shard_dir / (f"{FOLDER}_focal" if self.rectify.keep_focal else FOLDER)

    def _camera(self, camera: Camera) -> Camera:
        """A camera as the exporter sees it."""
        if self.rectify is None or camera.intrinsics.straight or not self._is_chosen(camera.name):
            return camera
        try:
            bent = rectification(camera.intrinsics, self.rectify)
        except ConfigError as error:
            raise ConfigError(f"{self._place}: camera '{camera.name}': {error}") from None
        return replace(camera, intrinsics=bent.target)

    def _is_chosen(self, camera: str) -> bool:
        return not self.cameras or any(fnmatchcase(camera, pattern) for pattern in self.cameras)

    def _sample(self, seen: DatasetInfo, sample: Sample, folder: Path) -> Sample:
        """A sample as the exporter sees it, with the image ids of the whole data set."""
        names = {sensor.name for sensor in seen.sensors}
        capture = sample.capture
        readings = {
            name: reading
            if reading.camera.intrinsics.straight or not self.rectify
            else replace(reading, camera=self._camera(reading.camera), channels={})
            for name, reading in capture.readings.items()
            if name in names
        }
        truth = {
            name: self._truth(seen, sample, name, image, folder)
            for name, image in sample.truth.items()
            if name in names
        }
        return replace(
            sample,
            scene=self._scene(sample.scene, names),
            instants={n: self._scene(s, names) for n, s in sample.instants.items() if n in names},
            capture=Capture(
                readings, _chosen(capture.clouds, names), _chosen(capture.tables, names)
            ),
            truth=truth,
            frame=self._frame(sample, names),
        )

    def _frame(self, sample: Sample, names: set[str]) -> EgoTruth | None:
        """Annotations of the sample as a whole: tracked points as the view's sensors have them."""
        frame = sample.frame
        if frame is None or frame.tracks is None:
            return frame
        sensors = {}
        for name, tracks in _chosen(frame.tracks.sensors, names).items():
            image = sample.truth.get(name)
            if self.rectify is None or image is None or image.camera.intrinsics.straight:
                sensors[name] = tracks
            else:
                bent = rectification(image.camera.intrinsics, self.rectify)
                sensors[name] = rectified_tracks(tracks, bent)
        return replace(frame, tracks=replace(frame.tracks, sensors=sensors))

    def _scene(self, scene: Scene, names: set[str]) -> Scene:
        """The scene with the cameras of the view, and those at which other sensors are mounted."""
        mounted: tuple[Lidar | Device, ...] = (*scene.lidars, *scene.devices)
        kept = names | {sensor.camera for sensor in mounted if sensor.name in names}
        cameras = tuple(self._camera(c) for c in scene.cameras if c.name in kept)
        lidars = tuple(lidar for lidar in scene.lidars if lidar.name in names)
        devices = tuple(device for device in scene.devices if device.name in names)
        return replace(scene, cameras=cameras, lidars=lidars, devices=devices)

    def _truth(
        self, seen: DatasetInfo, sample: Sample, name: str, truth: ImageTruth, folder: Path
    ) -> ImageTruth:
        intrinsics = truth.camera.intrinsics
        if self.rectify is None or intrinsics.straight:
            return truth
        parts = None
        if Channel.PART in seen.media[name]:
            path = seen.media_path(folder, name, Channel.PART, sample.index)
            parts = read_image(path, Channel.PART, seen.depth_scale_m)
        bent = rectification(intrinsics, self.rectify)
        return rectified_truth(truth, sample.scene_of(name), bent, self.thresholds, parts)

    def _write_media(
        self, info: DatasetInfo, seen: DatasetInfo, sample: Sample, shard_dir: Path
    ) -> None:
        """Write the rectified images of a sample, and link its other files."""
        folder, index, capture = self._folder(shard_dir), sample.index, sample.capture
        pairs = []
        for name in seen.cameras:
            reading = capture.readings.get(name)
            for channel in seen.media[name] if reading else ():
                source = info.media_path(shard_dir, name, channel, index)
                target = seen.media_path(folder, name, channel, index)
                if reading and self.rectify and not reading.camera.intrinsics.straight:
                    if not target.exists():
                        bent = rectification(reading.camera.intrinsics, self.rectify)
                        size_px = (bent.source.width_px, bent.source.height_px)
                        image = read_image(source, channel, info.depth_scale_m, size_px)
                        encoding = info.encoding(name, channel)
                        data = encode_channel(
                            channel, bent.image(channel, image), info.depth_scale_m, encoding
                        )
                        target.parent.mkdir(parents=True, exist_ok=True)
                        target.write_bytes(data)
                else:
                    pairs.append((source, target))
        sources, targets = (reading_paths(d, capture, index) for d in (shard_dir, folder))
        for name in {sensor.name for sensor in seen.sensors} & sources.keys():
            pairs += zip(sources[name], targets[name], strict=True)
        for source, target in pairs:
            if not target.exists():
                link_or_copy(source, target)


def view_of(own: Exporter, exporter: Exporter, thresholds: Thresholds) -> Exporter:
    """The view that the fields of an exporter ask for; ``exporter`` itself without such fields.

    Args:
        own: As configured.
        exporter: The same, perhaps behind a label map.
        thresholds: Thresholds of the data set.
    """
    if not isinstance(own, ExporterBase):
        return exporter
    rectify = Rectify() if own.rectify is True else own.rectify or None
    if not (own.cameras or own.sensors or rectify):
        return exporter
    return ExporterView(exporter, own.cameras, own.sensors, rectify, thresholds)


def needs_of(own: Exporter) -> frozenset[str]:
    """Names of the annotators that a configured exporter and its view read."""
    return view_of(own, own, Thresholds()).needs


def _chosen(readings: Mapping[str, T], names: set[str]) -> Mapping[str, T]:
    """The readings of some sensors; reads none from disk if that is all."""
    if names >= set(readings):
        return readings
    return {name: readings[name] for name in readings if name in names}
