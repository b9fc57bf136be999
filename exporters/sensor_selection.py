"""Selection of the sensors that a format exports."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from gen_data.core.capture import Channel, Measurements, PointCloud, SensorReading
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.core.interfaces import DatasetInfo, cloud_path
from gen_data.core.reported import clock_error_s, delayed_s
from gen_data.core.sample import Sample


def rgb_cameras(info: DatasetInfo) -> tuple[str, ...]:
    """Names of the cameras that write the rgb channel, sorted."""
    return tuple(s for s in info.cameras if Channel.RGB in info.media[s])


def photographs(info: DatasetInfo, samples: Iterable[Sample]) -> Iterator[tuple[Sample, str]]:
    """Samples with each camera that took a photograph of them."""
    for sample in samples:
        yield from ((sample, sensor) for sensor in rgb_cameras(info) if sensor in sample.truth)


def rgb_camera(info: DatasetInfo, wanted: str, exporter: str) -> str:
    """Find the camera of a name; for an empty name the first with the rgb channel.

    Raises:
        ConfigError: there is none.
    """
    known = rgb_cameras(info)
    if not wanted and known:
        return known[0]
    if wanted in known:
        return wanted
    if not wanted:
        raise ConfigError(
            f"exporter '{exporter}': no sensor of {_join_names(info.cameras)} writes the rgb "
            "channel; add an rgb_camera"
        )
    raise ConfigError(
        f"exporter '{exporter}': camera '{wanted}' does not write the rgb channel; "
        f"expected one of: {_join_names(known)}{did_you_mean(wanted, known)}"
    )


def check_channels(info: DatasetInfo, channels: Iterable[Channel], exporter: str) -> None:
    """Reject a data set without cameras that write rgb, or with one that lacks other channels.

    Raises:
        ConfigError: a channel is missing.
    """
    rgb_camera(info, "", exporter)
    for camera in rgb_cameras(info):
        require_channels(info, camera, channels, exporter)


def require_channels(
    info: DatasetInfo, camera: str, channels: Iterable[Channel], exporter: str, remedy: str = ""
) -> None:
    """Reject a camera that lacks a channel; ``remedy`` ends the message.

    Raises:
        ConfigError: a channel is missing.
    """
    missing = [c.value for c in channels if c not in info.media[camera]]
    if missing:
        raise ConfigError(
            f"exporter '{exporter}': camera '{camera}' does not write the channel "
            f"{_join_names(missing)}; add it to the channels of the sensor{remedy}"
        )


def check_pinholes(
    info: DatasetInfo, cameras: Iterable[str], exporter: str, field: str = ""
) -> None:
    """Reject lenses that a format of rectified images, or its ``field``, cannot describe.

    Raises:
        ConfigError: a camera is not a pinhole.
    """
    lenses = {camera: info.sensor(camera).lens for camera in cameras}
    bent = [
        f"camera '{camera}' has a lens of the model '{model}'"
        for camera, model in lenses.items()
        if model != "pinhole"
    ]
    if bent:
        place = f"exporter '{exporter}': {field}: " if field else f"exporter '{exporter}': "
        raise ConfigError(
            f"{place}{', '.join(bent)}, but the format holds rectified images; add rectify: true to"
            " the exporter, list the others in its cameras:, use a pinhole, or export such images"
            " as coco"
        )


def check_calibrations(info: DatasetInfo, cameras: Collection[str], exporter: str) -> None:
    """Reject errors of calibrations in a format whose cameras are parallel by definition.

    Raises:
        ConfigError: one of several cameras has the fault ``extrinsics``.
    """
    wrong = [name for name in cameras if "extrinsics" in info.sensor(name).faults]
    if wrong and len(cameras) > 1:
        raise ConfigError(
            f"exporter '{exporter}': sensor '{wrong[0]}': faults.extrinsics: the format's images "
            "are rectified and its cameras parallel; remove the fault, export one camera, or use "
            "another format, such as nuscenes or calibration"
        )


def pinhole_camera(info: DatasetInfo, wanted: str, exporter: str) -> str:
    """Find a camera as ``rgb_camera`` does, for formats that describe pinholes only.

    Raises:
        ConfigError: there is none, or it is not a pinhole.
    """
    camera = rgb_camera(info, wanted, exporter)
    check_pinholes(info, [camera], exporter)
    return camera


def check_partner(info: DatasetInfo, left: str, right: str, exporter: str) -> None:
    """Reject a right camera that is not the one of the left camera's disparities.

    Raises:
        ConfigError: disparities to another camera have another baseline.
    """
    partner = info.sensor(left).stereo_with
    if partner and right != partner:
        raise ConfigError(
            f"exporter '{exporter}': right: the disparities of '{left}' are to the camera "
            f"'{partner}' (stereo_with), not to '{right}'; expected '{partner}'"
        )


def laser_scanner(info: DatasetInfo, wanted: str, exporter: str) -> str:
    """Find the laser scanner of a name; for an empty name the first one, or empty if there is none.

    Raises:
        ConfigError: there is none of that name.
    """
    if wanted and wanted not in info.lidars:
        raise ConfigError(
            f"exporter '{exporter}': there is no lidar '{wanted}'; expected one of: "
            f"{_join_names(info.lidars)}{did_you_mean(wanted, info.lidars)}"
        )
    return wanted or next(iter(info.lidars), "")


def has_scans(shard_dir: Path, lidar: str, index: int) -> bool:
    """Whether a sample has a scan of a laser scanner."""
    return bool(lidar) and cloud_path(shard_dir, lidar, index).exists()


def instant_s(sample: Sample, sensor: str) -> float:
    """Time of a sensor's reading [s]; the sample's own time if it did not read."""
    capture = sample.capture
    for seen in (capture.readings.get(sensor), capture.clouds.get(sensor)):
        if seen is not None:
            return seen.time_s
    return sample.scene.time_s


def stamp_s(sample: Sample, sensor: str) -> float:
    """Reported time of a sensor's reading [s], which formats state.

    It is ``instant_s``, to which labels refer, unless the sensor's clock is wrong.
    """
    return delayed_s(instant_s(sample, sensor), stamp_error_s(sample, sensor))


def times(sample: Sample, sensor: str) -> dict[str, float]:
    """``time_s``, the true instant of a reading, and ``stamp_s``, if its clock is wrong."""
    time_s, stamp = instant_s(sample, sensor), stamp_s(sample, sensor)
    return {"time_s": time_s} if stamp == time_s else {"time_s": time_s, "stamp_s": stamp}


def row_stamp_s(row: Mapping[str, Any]) -> float:
    """Reported time in a row with the items of ``times``."""
    return float(row.get("stamp_s", row["time_s"]))


def stamp_error_s(sample: Sample, sensor: str) -> float:
    """Reported minus true instant of a sensor's reading [s]; 0 if it did not read."""
    capture = sample.capture
    kinds: tuple[Mapping[str, SensorReading | PointCloud | Measurements], ...]
    kinds = (capture.readings, capture.clouds, capture.tables)
    return next((clock_error_s(kind[sensor]) for kind in kinds if sensor in kind), 0.0)


def _join_names(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
