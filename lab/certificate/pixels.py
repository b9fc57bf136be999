"""Claim: an independent ray caster meets the same objects at the same depths in sampled pixels."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gen_data.core.capture import Channel, SensorReading
from gen_data.core.distribution import install_command
from gen_data.core.plates import has_plate
from gen_data.core.sample import ImageTruth, Sample
from gen_data.core.se3 import Array
from gen_data.exporters.image_files import DEPTH_UNITS_MAX
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Finding, not_checked
from gen_data.lab.certificate.ray_casting import UNSTATED, Agreement, RayCaster, Seen, has_holes

RELATIVE_TOLERANCE = 1e-4
"""Of distances: 32-bit coordinates of the renderer, in worlds of some hundred metres (assumed)."""
ROLLING_TOLERANCE = 1e-3
"""Of distances in rows of a rolling shutter among moving objects.

Rows share an instant while nothing in them moves farther than 0.25 pixels. A point that comes
nearer at the centre of an image, while points at its border, 600 pixels away, move so far, does so
by 0.25 / 600 of its distance; by more if it is nearer than they are.
"""


def check_pixels(examined: Examined) -> Iterator[Finding]:
    """Cast rays through pixels of random images of every camera."""
    judged = {name: Agreement() for name in sorted(examined.stored.info.cameras)}
    try:
        for sample in examined.chosen_samples():
            for name in sorted(sample.capture.readings):
                _compare(examined, sample, name, judged[name])
    except ImportError as error:
        yield from (
            not_checked(name, f"install open3d: {install_command('certify')} ({error})")
            for name in judged
        )
        return
    for name, agreement in judged.items():
        if agreement.rays:
            yield agreement.finding(name, "images", "pixels")
        else:
            yield not_checked(
                name,
                "no depth, range, image of instances or mask was sampled, or photographs are "
                "behind all scenes, whose foregrounds rays know nothing of",
            )


def _compare(examined: Examined, sample: Sample, name: str, agreement: Agreement) -> None:
    if has_plate(sample.scene):
        return
    reading = sample.capture.readings[name]
    camera, intrinsics = reading.camera, reading.camera.intrinsics
    ids = stated_ids(reading, sample.truth.get(name))
    stored = next((c for c in (Channel.RANGE, Channel.Z_DEPTH) if c in reading.channels), None)
    rng = examined.rng(f"pixels/{sample.index}/{name}")
    v, u = np.nonzero(ids != UNSTATED) if stored is None else np.indices(ids.shape).reshape(2, -1)
    time_s, relative_tolerance = reading.time_s, RELATIVE_TOLERANCE
    if camera.shutter.rolls and sample.scene.tracks and len(v):
        relative_tolerance = ROLLING_TOLERANCE
        # Every row has a separate instant: one row costs one world.
        row = v[int(rng.integers(0, len(v)))]
        u, v = u[v == row], v[v == row]
        time_s += float(camera.shutter.delay_s(row + 0.5, intrinsics.height_px))
    chosen = np.sort(rng.permutation(len(u))[: examined.scope.rays])
    u, v = u[chosen], v[chosen]
    directions = intrinsics.rays(np.stack([u, v], axis=1).astype(np.float64) + 0.5)
    # Pixels outside the lens's field, and depths at the side of the camera, are unknown.
    inside = np.isfinite(directions).all(axis=1)
    if stored is Channel.Z_DEPTH:
        inside &= np.nan_to_num(directions[:, 2]) > 1e-3
    u, v, directions = u[inside], v[inside], directions[inside]
    if not len(u):
        return
    if stored is None:
        unknown = np.full(len(u), np.nan)
        seen = Seen(unknown, unknown, ids[v, u], np.full(len(u), np.inf))
    else:
        image = reading.channels[stored][v, u].astype(np.float64)
        per_ray = np.ones(len(u)) if stored is Channel.RANGE else directions[:, 2]
        scale_m = examined.stored.info.depth_scale_m
        seen = state_distances(image, per_ray, ids[v, u], scale_m, relative_tolerance)
    scene = examined.timeline(sample).at(time_s)
    pose = scene.camera(name).T_world_camera
    origin_m = np.array(pose.translation_m)
    caster = RayCaster(scene, examined.library, origin_m, has_holes(examined.library))
    origins_m = np.broadcast_to(origin_m, directions.shape)
    agreed = caster.agrees(origins_m, pose.rotate(directions), seen)
    agreement.readings += 1
    agreement.rays += len(u)
    agreement.others["empty"] += int(np.isinf(seen.distance).sum())
    for k in np.flatnonzero(~agreed):
        agreement.contradictions.add(
            f"sample {sample.index}, pixel ({u[k]}, {v[k]}): a ray does not meet the stated "
            f"surface, {seen.distance[k]:.3f} m away, instance {seen.instance_id[k]}"
        )


def stated_ids(reading: SensorReading, truth: ImageTruth | None) -> NDArray[np.int64]:
    """Instance ids, [height, width]: of the image of instances, or else of the masks.

    ``UNSTATED`` where neither states an id.
    """
    if Channel.INSTANCE in reading.channels:
        return reading.channels[Channel.INSTANCE].astype(np.int64)
    size = reading.camera.intrinsics
    ids = np.full((size.height_px, size.width_px), UNSTATED, np.int64)
    for thing in truth.objects if truth is not None else ():
        if thing.mask is not None:
            height, width = thing.mask.pixels.shape
            x, y = thing.mask.x_px, thing.mask.y_px
            ids[y : y + height, x : x + width][thing.mask.pixels] = thing.instance.instance_id
    return ids


def state_distances(
    image: Array,
    per_ray: Array,
    ids: NDArray[np.int64],
    scale_m: float,
    relative_tolerance: float = RELATIVE_TOLERANCE,
) -> Seen:
    """Distances along unit rays that the pixels of a depth or range image state; arrays [n].

    Args:
        image: Depths or ranges [m]; inf = nothing, or farther than the file can say.
        per_ray: Depth per distance along the ray; 1 for ranges.
        ids: Instance ids.
        scale_m: Metres per unit of the file.
        relative_tolerance: Relative tolerance of distances, in addition to the rounding of the
            file.
    """
    distance = image / per_ray
    vacant = np.isinf(distance)
    tolerance = 0.51 * scale_m / per_ray + relative_tolerance * np.where(vacant, 0.0, distance)
    reach = (DEPTH_UNITS_MAX - 0.5) * scale_m / per_ray
    # Beyond the reach of the file there may be an object, at an unknown distance.
    return Seen(distance, tolerance, np.where(vacant, UNSTATED, ids), reach)
