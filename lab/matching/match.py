"""Fit of a configuration to a folder of recordings."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TypeVar

from gen_data.assemble.config import Config, load_config
from gen_data.core import capture, errors, interfaces, system_calls
from gen_data.lab.matching import label_fit, lidar_fit, real_files, recordings, results, simulation
from gen_data.lab.matching.camera_fit import MeasuredPhoto, fit_camera, measure_photo
from gen_data.lab.matching.quantities import base
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.camera.rgb_camera import RgbCamera
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

IMAGES, SCANS, SCENES = 200, 60, 48
PRESET = ImagePipeline().preset
"""Preset of an ``image_pipeline`` that names none."""
LEAST = 4
"""Smallest number of recordings to read, and of scenes to compare them with."""
S = TypeVar("S", RgbCamera, LidarSensor)
Progress = Callable[[str], None]


def match_recordings(  # noqa: PLR0913  (keywords of one front door)
    folder: Path,
    source: str,
    *,
    images: int = IMAGES,
    scans: int = SCANS,
    scenes: int = SCENES,
    camera: str = "",
    lidar: str = "",
    progress: Progress = lambda _: None,
) -> results.Match:
    """Fit the sensors of a configuration to a folder of recordings.

    Args:
        folder: Holds photographs, laser scans and labels at any depth.
        source: Path or shipped name of a configuration.
        images: Largest number of photographs to read, chosen evenly.
        scans: Largest number of scans to read, chosen evenly.
        scenes: Number of scenes of the configuration to simulate.
        camera: Camera to fit; empty = the first.
        lidar: Laser scanner to fit; empty = the first.
        progress: Called with the name of each step when it begins.

    Raises:
        ConfigError: the configuration is wrong, or has no sensor of that name.
        StorageError: the folder holds nothing that can be read.
    """
    for name, number in (("images", images), ("scans", scans), ("scenes", scenes)):
        if number < LEAST:
            raise errors.ConfigError(f"{name}: {number} is too few; expected at least {LEAST}")
    config = load_config(source)
    eye = _find_sensor(config, RgbCamera, camera, "camera")
    scanner = _find_sensor(config, LidarSensor, lidar, "lidar")
    files, inventory = real_files.find_files(folder), real_files.Inventory()
    progress("reading photographs")
    photos = _measure_photos(files, images, inventory)
    progress("reading scans")
    swept = list(real_files.read_scans(files, scans, inventory))
    if not photos and not swept:
        reasons = "; ".join(f"{n} {kind}: {why}" for (kind, why), n in inventory.skipped.items())
        raise errors.StorageError(f"{folder}: nothing in it can be read: {reasons}")
    labels = real_files.read_labels(
        files, {photo.name: photo.size_px for photo in photos}, inventory
    )
    eye = eye if photos else None
    scanner = scanner if swept else None
    placed = label_fit.fit_labels(source, eye, labels, scenes, progress)
    scenes = scenes if eye is None else simulation.scenes_in_memory(eye, scenes)
    simulated = simulation.simulate_scenes(
        label_fit.with_fields(source, placed.fields),
        "" if eye is None else eye.name,
        "" if scanner is None else scanner.name,
        scenes,
        progress,
    )
    progress("fitting the camera")
    seen = fit_camera(simulated.exposures, photos, _position(config, eye))
    seen = replace(
        seen,
        remarks=_other_sizes(eye, photos),
        fields=(*default_preset(config, eye, seen.fields), *seen.fields),
    )
    progress("fitting the laser scanner")
    reached = lidar_fit.fit_lidar(simulated.illuminations, swept, _position(config, scanner))
    parts = (placed, seen, reached)
    return results.Match(folder, source, config.resolved, inventory, scenes, parts)


def _find_sensor(config: Config, kind: type[S], name: str, option: str) -> S | None:
    """The sensor of that name, or the first of the kind; None if there is none.

    Raises:
        ConfigError: there is no sensor of that name.
    """
    known = {
        sensor.name: sensor
        for sensor in config.sensors
        if isinstance(sensor, kind)
        and (not isinstance(sensor, RgbCamera) or capture.Channel.RGB in sensor.media)
    }
    if name and name not in known:
        raise errors.ConfigError(
            f"--{option}: there is no such sensor '{name}'; expected one of"
            f" {', '.join(known) or 'none'}{errors.did_you_mean(name, known)}"
        )
    return known[name] if name else next(iter(known.values()), None)


def _position(config: Config, sensor: interfaces.Sensor | None) -> int:
    """Position of a sensor in the configuration; -1 for none."""
    names = [None if sensor is None else one.name for one in config.sensors]
    return -1 if sensor is None else names.index(sensor.name)


def default_preset(
    config: Config, camera: RgbCamera | None, fields: Sequence[results.FittedField]
) -> Iterator[results.FittedField]:
    """The preset of a camera whose class gives it, as ``plate_camera`` does, if others are set.

    An ``image_pipeline`` that is written replaces the whole default.
    """
    if camera is None or not fields:
        return
    number, preset = _position(config, camera), camera.image_pipeline.preset
    if "image_pipeline" not in config.resolved["sensors"][number] and preset != PRESET:
        yield results.FittedField(
            base.FieldChange("sensors", number, "image_pipeline.preset", preset), ()
        )


def _measure_photos(
    files: real_files.RealFiles, limit: int, inventory: real_files.Inventory
) -> list[MeasuredPhoto]:
    """Measure photographs, of which a few are in memory at a time."""
    measured: list[MeasuredPhoto] = []
    for batch in _batches(
        real_files.read_photos(files, limit, inventory), 4 * system_calls.usable_cores()
    ):
        measured += simulation.map_in_threads(measure_photo, batch)
    return measured


def _batches(items: Iterator[recordings.Photo], size: int) -> Iterator[list[recordings.Photo]]:
    while batch := list(islice(items, size)):
        yield batch


def _other_sizes(camera: RgbCamera | None, photos: Sequence[MeasuredPhoto]) -> tuple[str, ...]:
    """A remark if most photographs have another size than the camera's images."""
    if camera is None:
        return ()
    sizes = Counter(photo.size_px for photo in photos)
    width_px, height_px = camera.size_px
    other = len(photos) - sizes[width_px, height_px]
    if 2 * other <= len(photos):
        return ()
    ((common_width_px, common_height_px), _), *_ = sizes.most_common(1)
    return (
        f"{other} of {len(photos)} photographs are not of the camera's {width_px} x {height_px} px;"
        f" blur and noise are per pixel: consider size_px: [{common_width_px}, {common_height_px}]",
    )
