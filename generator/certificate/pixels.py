"""Claim: an independent ray caster meets the same things at the same depths in sampled pixels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.certificate.examined import Examined
from gen_data.generator.certificate.finding import Contradictions, Finding, not_checked
from gen_data.generator.certificate.ray_casting import (
    DISAGREEING_MAX,
    MISSING,
    RayCaster,
    Seen,
    is_perforated,
)
from gen_data.generator.core.capture import Channel, SensorReading
from gen_data.generator.core.sample import Sample
from gen_data.generator.core.se3 import Array

DISTANCES = (Channel.Z_DEPTH, Channel.RANGE)
RELATIVE_TOLERANCE = 1e-4
"""Of distances: 32-bit coordinates of the renderer, in worlds of some hundred metres (assumed)."""

UNITS_MAX = 65_535
"""Largest value of a 16-bit image of depths (``exporters.image_files``)."""


def check_pixels(examined: Examined) -> Iterator[Finding]:
    """Cast rays through pixels of random images of every camera."""
    cameras = {
        name: [c for c in (*DISTANCES, Channel.INSTANCE) if c in channels]
        for name, channels in examined.stored.info.media.items()
    }
    judged = {name: Tally() for name, channels in cameras.items() if channels}
    for name in sorted({*cameras} - {*judged}):
        yield not_checked(name, "the camera writes none of the channels depth, range and instance")
    if not judged:
        return
    try:
        for sample in examined.chosen_samples():
            for name in sorted({*judged} & {*sample.capture.readings}):
                judged[name].add(examined, sample, sample.capture.readings[name])
    except ImportError:
        yield from (not_checked(name, MISSING) for name in sorted(judged))
        return
    for name, tally in sorted(judged.items()):
        yield tally.finding(name)


class Tally:
    """Agreement of the pixels of one camera."""

    def __init__(self) -> None:
        self._contradictions = Contradictions()
        self._images = self._pixels = self._empty = 0

    def add(self, examined: Examined, sample: Sample, reading: SensorReading) -> None:
        """Compare pixels of one image."""
        camera = reading.camera
        intrinsics = camera.intrinsics
        rng = examined.rng(f"pixels/{sample.index}/{reading.sensor}")
        u = rng.integers(0, intrinsics.width_px, examined.scope.rays)
        v = rng.integers(0, intrinsics.height_px, examined.scope.rays)
        timeline, time_s = examined.timeline(sample), reading.time_s
        if camera.shutter.rolls and sample.scene.tracks:
            # Every row has an instant of its own: one row costs one world.
            v[:] = v[0]
            time_s += float(camera.shutter.delay_s(v[0] + 0.5, intrinsics.height_px))
        scene = timeline.at(time_s)
        pose = scene.camera(reading.sensor).T_world_camera
        directions = intrinsics.rays(np.stack([u, v], axis=1) + 0.5)
        # Nothing is known of pixels outside the lens's field, and of depths beside the camera.
        inside = np.isfinite(directions).all(axis=1)
        if Channel.RANGE not in reading.channels:
            inside &= np.nan_to_num(directions[:, 2]) > 1e-3
        u, v, directions = u[inside], v[inside], directions[inside]
        caster = RayCaster(
            scene,
            examined.library,
            np.array(pose.translation_m),
            is_perforated(examined.library),
        )
        origins = np.broadcast_to(pose.translation_m, directions.shape)
        scale_m = examined.stored.info.depth_scale_m
        seen = stated_by(reading, u, v, directions, scale_m)
        agreed = caster.agrees(origins, pose.rotate(directions), seen)
        self._images += 1
        self._pixels += len(u)
        self._empty += int(np.isinf(seen.distance).sum())
        for k in np.flatnonzero(~agreed):
            self._contradictions.add(
                f"sample {sample.index}, {reading.sensor}, pixel ({u[k]}, {v[k]}): "
                f"{seen.distance[k]:.3f} m, instance {seen.instance_id[k]}, is not what a ray meets"
            )

    def finding(self, camera: str) -> Finding:
        """The finding about the camera."""
        figures = {"images": self._images, "pixels": self._pixels, "empty": self._empty}
        if not self._pixels:
            return not_checked(camera, "no image of the camera was among the sampled ones")
        return self._contradictions.judge(camera, figures, int(DISAGREEING_MAX * self._pixels))


def stated_by(
    reading: SensorReading,
    u: NDArray[np.int64],
    v: NDArray[np.int64],
    directions: Array,
    scale_m: float,
) -> Seen:
    """Distances along unit rays, and ids, that the images of a reading state in pixels.

    Ranges are preferred to depths; a camera with images of ids only states no distance.
    """
    count = len(u)
    ids = np.full(count, -1, np.int64)
    if Channel.INSTANCE in reading.channels:
        ids = reading.channels[Channel.INSTANCE][v, u].astype(np.int64)
    stored = next((c for c in reversed(DISTANCES) if c in reading.channels), None)
    if stored is None:
        return Seen(np.full(count, np.nan), np.zeros(count), ids, np.full(count, np.inf))
    per_ray = np.ones(count) if stored is Channel.RANGE else directions[:, 2]
    distance = reading.channels[stored][v, u].astype(np.float64) / per_ray
    vacant = np.isinf(distance)
    tolerance = 0.51 * scale_m / per_ray + RELATIVE_TOLERANCE * np.where(vacant, 0.0, distance)
    reach = (UNITS_MAX - 0.5) * scale_m / per_ray
    # Beyond the reach of the file there may be a thing, at an unknown distance.
    return Seen(distance, tolerance, np.where(vacant, -1, ids), reach)
