"""Claim: an independent ray caster meets the same things at the same depths in sampled pixels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.generator.certificate.examined import Examined
from gen_data.generator.certificate.finding import Finding, not_checked
from gen_data.generator.certificate.ray_casting import (
    MISSING,
    Agreement,
    RayCaster,
    Seen,
    has_holes,
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
    judged = {name: Agreement() for name, channels in cameras.items() if channels}
    for name in sorted({*cameras} - {*judged}):
        yield not_checked(name, "the camera writes none of the channels depth, range and instance")
    try:
        for sample in examined.chosen_samples() if judged else ():
            for name in sorted({*judged} & {*sample.capture.readings}):
                _compare(examined, sample, sample.capture.readings[name], judged[name])
    except ImportError as error:
        yield from (not_checked(name, f"{MISSING} ({error})") for name in sorted(judged))
        return
    for name, agreement in sorted(judged.items()):
        yield agreement.finding(name, "images", "pixels")


def _compare(
    examined: Examined, sample: Sample, reading: SensorReading, agreement: Agreement
) -> None:
    """Compare pixels of one image."""
    camera, intrinsics = reading.camera, reading.camera.intrinsics
    rng = examined.rng(f"pixels/{sample.index}/{reading.sensor}")
    u = rng.integers(0, intrinsics.width_px, examined.scope.rays)
    v = rng.integers(0, intrinsics.height_px, examined.scope.rays)
    time_s = reading.time_s
    if camera.shutter.rolls and sample.scene.tracks:
        # Every row has an instant of its own: one row costs one world.
        v[:] = v[0]
        time_s += float(camera.shutter.delay_s(v[0] + 0.5, intrinsics.height_px))
    directions = intrinsics.rays(np.stack([u, v], axis=1) + 0.5)
    # Nothing is known of pixels outside the lens's field, and of depths beside the camera.
    inside = np.isfinite(directions).all(axis=1)
    if Channel.RANGE not in reading.channels:
        inside &= np.nan_to_num(directions[:, 2]) > 1e-3
    u, v, directions = u[inside], v[inside], directions[inside]
    scene = examined.timeline(sample).at(time_s)
    pose = scene.camera(reading.sensor).T_world_camera
    origin_m = np.array(pose.translation_m)
    caster = RayCaster(scene, examined.library, origin_m, has_holes(examined.library))
    seen = stated_by(reading, u, v, directions, examined.stored.info.depth_scale_m)
    origins_m = np.broadcast_to(origin_m, directions.shape)
    agreed = caster.agrees(origins_m, pose.rotate(directions), seen)
    agreement.readings += 1
    agreement.rays += len(u)
    agreement.others["empty"] += int(np.isinf(seen.distance).sum())
    for k in np.flatnonzero(~agreed):
        agreement.contradictions.add(
            f"sample {sample.index}, pixel ({u[k]}, {v[k]}): a ray does not meet what is stated, "
            f"{seen.distance[k]:.3f} m away, instance {seen.instance_id[k]}"
        )


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
