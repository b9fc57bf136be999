"""Shards of nuScenes: files of scans, detections, point labels and maps, and a line per sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Literal

from gen_data.core.boxes import OrientedBox
from gen_data.core.capture import Channel as ImageChannel
from gen_data.core.errors import ConfigError
from gen_data.core.interfaces import AssetLibrary, DatasetInfo, table_path
from gen_data.core.sample import Sample
from gen_data.core.se3 import SE3
from gen_data.exporters import (
    measurement_tables,
    nuscenes_can_bus,
    nuscenes_files,
    nuscenes_frames,
    nuscenes_map,
)
from gen_data.exporters.nuscenes_classes import attribute_of, point_classes
from gen_data.exporters.nuscenes_recording import LIDAR_TOP
from gen_data.exporters.nuscenes_tables import Tokens
from gen_data.exporters.point_cloud_io import read_points, scanner_at_sweep
from gen_data.exporters.road_map import road_map
from gen_data.exporters.sensor_selection import has_scans, instant_s
from gen_data.exporters.sequences import (
    Mount,
    frame_facts,
    relative_pose,
    sequence_number,
    write_bytes,
    write_json,
)

FOLDER = "nuscenes"
_LABEL_SUFFIXES = {"lidarseg": ".bin", "panoptic": ".npz"}


def reading_path(
    info: DatasetInfo, shard_dir: Path, channel: nuscenes_frames.Channel, index: int
) -> Path:
    """File of a reading in a shard; images are the ones that all formats share."""
    if channel.modality == "camera":
        return info.media_path(shard_dir, channel.sensor, ImageChannel.RGB, index)
    suffix = reading_suffix(info, channel)
    return shard_dir / FOLDER / channel.name / f"{index:09d}{suffix}"


def reading_suffix(info: DatasetInfo, channel: nuscenes_frames.Channel) -> str:
    """Ending of the files of a channel."""
    if channel.modality == "camera":
        return info.encoding(channel.sensor, ImageChannel.RGB).suffix
    return {"lidar": ".pcd.bin", "radar": ".pcd"}[channel.modality]


def label_path(shard_dir: Path, table: str, index: int) -> Path:
    """File of the point labels of a sample in a shard; tables are ``lidarseg`` and ``panoptic``."""
    return shard_dir / FOLDER / table / f"{index:09d}{_LABEL_SUFFIXES[table]}"


def map_file(world: int) -> str:
    """Path of the map of a world, in the data set and in the exporter's folder of a shard."""
    return f"maps/{world:06d}.png"


def expansion_file(name: object) -> str:
    """Path of a map expansion: of a location in the data set, of a world in a shard."""
    return f"maps/expansion/{name}.json"


@dataclass(frozen=True, eq=False)
class ShardWriter:
    """Writes the samples of one shard.

    Attributes:
        channels: Exported sensors; the first one is LIDAR_TOP.
        boxes_at, box_margin_m: Fields of the exporter.
        roads: Library for map expansions; None = they are not written.
    """

    info: DatasetInfo
    channels: Sequence[nuscenes_frames.Channel]
    shard_dir: Path
    boxes_at: Literal["pulse", "step"]
    box_margin_m: float
    roads: AssetLibrary | None = None
    _areas: dict[int, nuscenes_files.MapArea] = field(default_factory=dict)

    def write(self, sample: Sample) -> dict[str, Any]:
        """Write the files of a sample and return its line."""
        top = self.channels[0]
        T_global_world = self._write_map(sample).T_global_world
        ego = nuscenes_frames.channel_mount(sample.scene, top).rig
        readings: dict[str, Any] = {}
        detections: dict[int, int] = {}
        for channel in self.channels:
            if self._has_reading(sample, channel):
                offset_s = self.info.sensor(channel.sensor).time_offset_s
                time_s = nuscenes_frames.reading_time_s(sample, channel, offset_s)
                row = nuscenes_frames.reading_row(sample, channel, ego, time_s, T_global_world)
                readings[channel.name] = row | {"suffix": reading_suffix(self.info, channel)}
                if channel.modality == "radar":
                    self._write_radar(sample, channel, detections)
                elif channel.modality == "lidar":
                    self._write_lidar(sample, channel, ego)
        boxes = []
        if LIDAR_TOP in readings:
            boxes = self._write_labels(sample, ego, detections, T_global_world)
        return frame_facts(self.info, sample) | {
            "scene": sample.scene_index,
            "vehicle": ego.removeprefix("/"),
            "world_origin": list(T_global_world.translation_m),
            "readings": readings,
            "boxes": boxes,
        }

    def can_messages(self, sample: Sample, assets: AssetLibrary) -> dict[str, Any]:
        """Line of the ego's messages from a sample's instant to the next step's.

        Raises:
            ConfigError: the ego is not a vehicle.
        """
        scene = sample.scene
        ego = nuscenes_frames.channel_mount(scene, self.channels[0]).rig
        if ego.startswith("/") or not scene.rig(ego).body:
            raise ConfigError(
                "exporter 'nuscenes': can_bus needs a vehicle that carries "
                f"'{self.channels[0].sensor}'; add an element 'ego' and mount the sensor on its rig"
            )
        span_s = (scene.time_s, scene.time_s + self.info.step_s)
        T_global_world = self._write_map(sample).T_global_world
        return {
            "sequence": sequence_number(self.info, sample.index),
            "messages": nuscenes_can_bus.can_messages(scene, ego, span_s, T_global_world, assets),
        }

    def _has_reading(self, sample: Sample, channel: nuscenes_frames.Channel) -> bool:
        if channel.modality == "camera":
            return channel.sensor in sample.truth
        if channel.modality == "lidar":
            return has_scans(self.shard_dir, channel.sensor, sample.index)
        return table_path(self.shard_dir, channel.sensor, sample.index).exists()

    def _write_map(self, sample: Sample) -> nuscenes_files.MapArea:
        """Write the map of a sample's world, once per shard, and return its area."""
        world = sample.scene_index
        if world not in self._areas:
            area = self._areas[world] = nuscenes_files.map_area(sample.scene.lanes)
            path = self.shard_dir / FOLDER / map_file(world)
            write_bytes(path, nuscenes_files.map_bytes(sample.scene.lanes, area))
            if self.roads is not None:
                token = partial(_map_token, Tokens(self.info), world)
                expansion = nuscenes_map.map_expansion(
                    road_map(sample.scene, self.roads), area, token
                )
                write_json(self.shard_dir / FOLDER / expansion_file(world), expansion)
        return self._areas[world]

    def _write_radar(
        self, sample: Sample, channel: nuscenes_frames.Channel, detections: dict[int, int]
    ) -> None:
        """Write a radar's detections, and add them to the number of each instance."""
        path = table_path(self.shard_dir, channel.sensor, sample.index)
        rows = measurement_tables.read_rows(path, self.info.sensor(channel.sensor))
        target = reading_path(self.info, self.shard_dir, channel, sample.index)
        write_bytes(target, nuscenes_files.radar_bytes(rows))
        for instance_id in rows["instance_id"].tolist():
            detections[instance_id] = detections.get(instance_id, 0) + 1

    def _write_lidar(self, sample: Sample, channel: nuscenes_frames.Channel, ego: str) -> None:
        points = read_points(self.shard_dir, channel.sensor, sample.index)
        mount = nuscenes_frames.channel_mount(sample.scene, channel)
        turns = nuscenes_files.quarter_turns(relative_pose(sample.scene, Mount(ego, SE3()), mount))
        path = reading_path(self.info, self.shard_dir, channel, sample.index)
        write_bytes(path, nuscenes_files.lidar_bytes(points, turns))

    def _write_labels(
        self, sample: Sample, ego: str, detections: Mapping[int, int], T_global_world: SE3
    ) -> list[dict[str, Any]]:
        """Write the point labels of LIDAR_TOP and return the rows of boxes."""
        top = self.channels[0].sensor
        points = read_points(self.shard_dir, top, sample.index)
        things = nuscenes_frames.annotated_things(sample)
        scanner, time_s = scanner_at_sweep(sample, top), instant_s(sample, top)
        pulses = None
        if self.boxes_at == "pulse":
            pulses = nuscenes_frames.PulseTimes.measure(points, time_s, scanner.sweep_s)
        boxes = {k: self._box(thing, pulses, scanner.T_world_lidar) for k, thing in things.items()}
        found = nuscenes_files.points_in_boxes(points, scanner.T_world_lidar, boxes)
        labels = point_classes(points, found.members, sample.scene, _ego_instance(sample, ego))
        numbers = {k: thing.number for k, thing in things.items()}
        panoptic = nuscenes_files.panoptic_labels(labels, found.members, numbers)
        write_bytes(label_path(self.shard_dir, "lidarseg", sample.index), labels.tobytes())
        path = label_path(self.shard_dir, "panoptic", sample.index)
        write_bytes(path, nuscenes_files.panoptic_bytes(panoptic))
        views = nuscenes_frames.views_by_instance(sample)
        rows = []
        for number, thing in things.items():
            attribute = attribute_of(thing.category, thing.instance, thing.body, sample.scene)
            counts = nuscenes_frames.Points(found.counts[number], detections.get(number, 0))
            box = boxes[number].seen_from(T_global_world)
            rows.append(
                nuscenes_frames.box_row(thing, box, attribute, views.get(number, ()), counts)
            )
        return rows

    def _box(
        self,
        thing: nuscenes_frames.Thing,
        pulses: nuscenes_frames.PulseTimes | None,
        T_world_lidar: SE3,
    ) -> OrientedBox:
        """Box of an object in the world, at the instant that the exporter's fields select."""
        box = thing.box(None, self.box_margin_m)
        if pulses is None or thing.track is None:
            return box
        center = T_world_lidar.inverse() @ box.T_frame_box
        instant = pulses.instant_s(thing.instance.instance_id, center.translation_m)
        return thing.box(instant, self.box_margin_m)


def _map_token(token: Tokens, world: int, layer: str, *identity: object) -> str:
    return token(f"map.{layer}", world, *identity)


def _ego_instance(sample: Sample, ego: str) -> int:
    """Instance id of the body that carries the ego's rig; 0 = none."""
    scene = sample.scene
    body = "" if ego.startswith("/") else scene.rig(ego).body
    return scene.body(body).instance_id if body else 0
