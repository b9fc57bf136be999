"""nuScenes: keyframes and sweeps of a vehicle's sensors, with 3D boxes and point labels.

::

    v1.0-mini/*.json                     the 13 tables, lidarseg, panoptic, and splits.json
    samples/CAM_FRONT/000000012_CAM_FRONT.png        key frames: images, scans, radar detections
    samples/LIDAR_TOP/000000012_LIDAR_TOP.pcd.bin    (000000012 is the sample of the data set)
    samples/RADAR_FRONT/000000012_RADAR_FRONT.pcd
    sweeps/...                           the same between key frames
    lidarseg/v1.0-mini/*_lidarseg.bin    panoptic/v1.0-mini/*_panoptic.npz    of key frames
    maps/000003.png                      driveable surface of world 3
    maps/expansion/<location>.json       its vector map, with ``map_expansion``
    can_bus/scene-2000_pose.json         motion of the ego, with ``can_bus``

* **Scenes** are sequences; a log is a world, with a separate map and location. ``splits.json``
  lists the scenes of ``all`` and of each split of the data set: ``gen_train``, ``gen_val`` and
  ``gen_test``. Official splits have none of their names.
* **Key frames** are scans of LIDAR_TOP at least ``key_frame_s`` apart.
* **The global frame** is the world, with the map's corner at (0, 0), as the devkit expects:
  ``world_origin`` in ``log.json`` is the origin of the world in it.
* **Map expansion**: all layers of version 1.3 (``nuscenes_map.py``). ``NuScenesMap`` reads it
  under the location of the log, once ``map_api.locations`` has that name.
* **CAN bus**: pose, IMU, steering angle and speed (``nuscenes_can_bus.py``); scenes then have the
  names ``scene-2000``, ..., since ``NuScenesCanBus`` accepts no others.
* **The ego** is the rig that carries LIDAR_TOP; every reading has the ego's pose at its instant.
* **Images** are PNG: links to the images of the shards. Pixel centres of ``camera_intrinsic`` are
  whole numbers.
* **Boxes** have the category of ``nuscenes_classes.yaml``, whatever the data set calls it. A box is
  where the pulses of the scan hit the object, as annotators fit boxes to points; ``boxes_at: step``
  puts it where the object is at the instant of the key frame. An object is annotated from the first
  to the last key frame in which a camera, lidar or radar senses it.
* **num_lidar_pts** counts the points in the box: within 2 cm of its faces only hits of the
  object. Point labels agree: points in a box belong to its object, also road points.
* **num_radar_pts** counts the detections that the object caused.

Reference: Caesar et al., "nuScenes: A multimodal dataset for autonomous driving", CVPR 2020, and
the schema of nuscenes-devkit.
"""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene
from gen_data.exporters import (
    base,
    fragments,
    image_files,
    nuscenes_can_bus,
    nuscenes_classes,
    nuscenes_tables,
    sequences,
)
from gen_data.exporters.conventions import PINHOLE, Conventions
from gen_data.exporters.nuscenes_frames import Channel
from gen_data.exporters.nuscenes_recording import LIDAR_TOP, Recording, key_frames, scene_name
from gen_data.exporters.nuscenes_shard import (
    ShardWriter,
    expansion_file,
    label_path,
    map_file,
    reading_path,
)
from gen_data.exporters.sensor_selection import check_pinholes, laser_scanner, rgb_cameras

SPLITS = ("train", "val", "test")
CAN_BUS = "can_bus"


class NuScenes(base.AssetExporter):
    """nuScenes with lidarseg and panoptic labels: all cameras, laser scanners and radars."""

    type: Literal["nuscenes"] = "nuscenes"
    conventions: ClassVar[Conventions] = Conventions(
        pixel_centre="i",
        lens=PINHOLE,
        time="us; middle of the exposure or sweep",
        ring="lowest laser",
        intensity="0 to 255",
    )
    annotators: ClassVar[frozenset[str]] = frozenset({"visibility"})
    own_classes: ClassVar[bool] = True

    image_formats: ClassVar[frozenset[str]] = base.PNG_OR_JPEG
    version: str = Field("v1.0-mini", pattern=r"^[A-Za-z0-9][A-Za-z0-9._-]*$")
    """Folder of the tables."""
    lidar: str = ""
    """Sensor that becomes LIDAR_TOP; empty = the sensor of that name, else the first one by name.
    Other sensors keep their names, in capitals and with CAM_, LIDAR_ or RADAR_ in front."""
    key_frame_s: float = Field(0.5, gt=0)
    """Smallest time between key frames; readings in between are sweeps."""
    boxes_at: Literal["pulse", "step"] = "pulse"
    """Instant of a moving object's box: when pulses hit it, or the step's."""
    box_margin_m: float = Field(0.002, ge=0, le=0.1)
    """How much larger boxes are on every side: points on the surface are inside."""
    map_expansion: bool = False
    """Whether to write the vector map of each world as well."""
    can_bus: bool = False
    """Whether to write the ego's motion between the steps; scenes are named ``scene-2000``, ..."""

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent.

        Raises:
            ConfigError: there is no laser scanner, a camera is not a pinhole, two sensors have the
                same channel, or no category has a class in this format.
        """
        self._channels(info)
        base.check_classes(self.type, info, nuscenes_classes.detectable_categories())
        check_pinholes(info, rgb_cameras(info), self.type)
        if self.map_expansion:
            base.check_installed(self.type, "shapely")
        if self.can_bus:
            sequences.check_sequence_count(info, nuscenes_can_bus.SCENES_MAX, self.type)

    def check_scene(self, scene: Scene) -> None:
        """Reject a map expansion of worlds without a street.

        Raises:
            ConfigError: the text names the missing element.
        """
        if self.map_expansion and not any(lane.kind == "driving" for lane in scene.lanes):
            raise ConfigError(
                f"exporter '{self.type}': map_expansion needs a street, but the scene has no "
                "driving lane; add an element 'road', or leave map_expansion out"
            )

    def write_shard(self, info: DatasetInfo, samples: Iterable[Sample], shard_dir: Path) -> None:
        """Write scans, detections, point labels and maps, and a line per sample.

        Raises:
            ConfigError: see ``check``, too many objects of a category, or ``can_bus`` without a
                vehicle.
        """
        self.check(info)
        roads = self.library if self.map_expansion else None
        channels, margin_m = self._channels(info), self.box_margin_m
        writer = ShardWriter(info, channels, shard_dir, self.boxes_at, margin_m, roads)
        rows, messages = [], []
        for sample in samples:
            rows.append(writer.write(sample))
            if self.can_bus:
                messages.append(writer.can_messages(sample, self.library))
        sequences.write_frames(shard_dir / self.type, rows)
        if self.can_bus:
            fragments.write_fragment(shard_dir / self.type, CAN_BUS, messages)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the tables, sequence by sequence, and link all files."""
        token = nuscenes_tables.Tokens(info)
        channels = {c.name: c.modality for c in self._channels(info)}
        names: dict[str, list[str]] = {"all": [], **{f"gen_{split}": [] for split in SPLITS}}
        worlds: set[int] = set()
        with nuscenes_tables.TableFiles(dataset_dir / self.version) as tables:
            for table, row in nuscenes_tables.constant_rows(token, channels):
                tables.add(table, row)
            for recording in self._recordings(token, shard_dirs):
                first = recording.frames[0]
                world, split = first.row["scene"], first.row["split"]
                if world not in worlds:
                    worlds.add(world)
                    self._add_world(tables, token, first, dataset_dir)
                for table, row in recording.rows():
                    tables.add(table, row)
                self._link_files(info, recording, dataset_dir)
                names["all"].append(recording.name)
                names.setdefault(f"gen_{split}", []).append(recording.name)
                if self.can_bus:
                    _write_can_bus(recording, shard_dirs, dataset_dir / CAN_BUS)
        nuscenes_tables.write_splits(dataset_dir / self.version, names)

    def top(self, info: DatasetInfo) -> str:
        """Sensor that becomes LIDAR_TOP. Raises ConfigError if there is none."""
        named = LIDAR_TOP if not self.lidar and LIDAR_TOP in info.lidars else self.lidar
        top = laser_scanner(info, named, self.type)
        if not top:
            raise ConfigError(
                f"exporter '{self.type}': there is no lidar; add a sensor of that type, such as "
                "{type: lidar, name: LIDAR_TOP, model: HDL-32E}"
            )
        return top

    def _channels(self, info: DatasetInfo) -> tuple[Channel, ...]:
        """Exported sensors, LIDAR_TOP first."""
        top = self.top(info)
        channels = [Channel(top, LIDAR_TOP, "lidar")]
        for name in info.lidars:
            if name != top:
                channels.append(Channel(name, _channel_name("LIDAR_", name), "lidar"))
        for name in rgb_cameras(info):
            channels.append(Channel(name, _channel_name("CAM_", name), "camera"))
        for name, kind in info.devices.items():
            if kind == "radar":
                channels.append(Channel(name, _channel_name("RADAR_", name), "radar"))
        sensors: dict[str, str] = {}
        for channel in channels:
            if channel.name in sensors:
                raise ConfigError(
                    f"exporter '{self.type}': the sensors '{sensors[channel.name]}' and "
                    f"'{channel.sensor}' both become {channel.name}; rename one"
                )
            sensors[channel.name] = channel.sensor
        return tuple(channels)

    def _recordings(
        self, token: nuscenes_tables.Tokens, shard_dirs: Sequence[Path]
    ) -> Iterator[Recording]:
        """Yield the sequences that have key frames; one at a time is in memory."""
        rows = fragments.fragment_rows(shard_dirs, self.type, sequences.FRAMES)
        for _, group in groupby(rows, key=lambda item: item[1]["sequence"]):
            frames = [sequences.Frame(shard_dir, row) for shard_dir, row in group]
            if keys := key_frames(frames, self.key_frame_s):
                name_of = nuscenes_can_bus.scene_name if self.can_bus else scene_name
                yield Recording(token, self.version, frames, keys, name_of)

    def _add_world(
        self,
        tables: nuscenes_tables.TableFiles,
        token: nuscenes_tables.Tokens,
        frame: sequences.Frame,
        dataset_dir: Path,
    ) -> None:
        """Add the log and the map of a world."""
        file = map_file(frame.row["scene"])
        image_files.link_or_copy(frame.shard_dir / self.type / file, dataset_dir / file)
        for table, row in nuscenes_tables.world_rows(token, frame, file):
            tables.add(table, row)
            if self.map_expansion and table == "log":
                source = frame.shard_dir / self.type / expansion_file(frame.row["scene"])
                image_files.link_or_copy(source, dataset_dir / expansion_file(row["location"]))

    def _link_files(self, info: DatasetInfo, recording: Recording, dataset_dir: Path) -> None:
        for frame, channel, target in recording.files():
            reading = frame.row["readings"][channel]
            one = Channel(reading["sensor"], channel, reading["modality"])
            source = reading_path(info, frame.shard_dir, one, frame.index)
            image_files.link_or_copy(source, dataset_dir / target)
        for frame, table, target in recording.point_label_files():
            source = label_path(frame.shard_dir, table, frame.index)
            image_files.link_or_copy(source, dataset_dir / target)


def _write_can_bus(recording: Recording, shard_dirs: Sequence[Path], folder: Path) -> None:
    """Write the messages of a sequence, one file per kind."""
    here = {frame.shard_dir for frame in recording.frames}
    rows = fragments.fragment_rows([d for d in shard_dirs if d in here], "nuscenes", CAN_BUS)
    lines = [row["messages"] for _, row in rows if row["sequence"] == recording.number]
    for kind in nuscenes_can_bus.RATES_HZ:
        messages = [message for line in lines for message in line[kind]]
        stamped = nuscenes_can_bus.stamped(messages, recording.time_us)
        sequences.write_json(folder / f"{recording.name}_{kind}.json", list(stamped))


def _channel_name(prefix: str, sensor: str) -> str:
    name = sensor.upper()
    return name if name.startswith(prefix) else prefix + name
