"""Fit of a camera's image pipeline to photographs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from gen_data.core.se3 import Array
from gen_data.lab.matching import indirect_inference, recordings, results
from gen_data.lab.matching.descriptions import PICTURES
from gen_data.lab.matching.picture import Picture
from gen_data.lab.matching.quantities import CAMERA, CameraQuantity, base, jpeg_quality
from gen_data.lab.matching.quantities.noise import NOISE
from gen_data.lab.matching.quantities.read_noise import READ_NOISE
from gen_data.lab.matching.simulation import Exposure, map_in_threads, measure_exposures, photograph
from gen_data.sensors.camera.image_pipeline import ImagePipeline

CLIP = 2.5
"""Standard deviations at which fitted normal distributions are clipped."""
NOISE_EXCESS = 1.0
"""Logarithm, base 2, of the least noise over rounding noise for which a sensor is added."""
Prepare = Callable[[ImagePipeline], ImagePipeline]


@dataclass(frozen=True, slots=True)
class MeasuredPhoto:
    """Statistics of one photograph.

    Attributes:
        name, size_px: Name and size of the photograph.
        statistics: In the order of ``CAMERA``.
        descriptions: In the order of ``descriptions.PICTURES``.
        jpeg_quality: NaN = no compression found.
    """

    name: str
    size_px: tuple[int, int]
    statistics: tuple[float, ...]
    descriptions: tuple[float, ...]
    jpeg_quality: float


def measure_photo(photo: recordings.Photo) -> MeasuredPhoto:
    """Measure everything in a photograph."""
    picture = Picture(photo.rgb)
    return MeasuredPhoto(
        photo.name,
        photo.size_px,
        tuple(quantity.measure(picture) for quantity in CAMERA),
        tuple(describe(picture) for _, describe in PICTURES),
        jpeg_quality.measure(photo),
    )


def fit_camera(
    exposures: Sequence[Exposure], photos: Sequence[MeasuredPhoto], sensor: int
) -> results.Part:
    """Fit a camera's image pipeline.

    Args:
        exposures: Scenes of the configuration.
        photos: Real photographs.
        sensor: Position of the camera among the sensors.
    """
    if not exposures or not photos:
        return results.Part(results.not_fitted(CAMERA, "no camera" if photos else "no photographs"))
    pipeline = exposures[0].pipeline
    real = np.array([photo.statistics for photo in photos])
    jpeg = _fit_jpeg(pipeline, np.array([photo.jpeg_quality for photo in photos]))
    compressed = ImagePipeline.model_validate({"jpeg_quality": jpeg.value}).jpeg_quality
    prepare: Prepare = partial(ImagePipeline.model_copy, update={"jpeg_quality": compressed})
    start = np.array([quantity.start(pipeline) for quantity in CAMERA])
    reasons = _unmeasurable(exposures, real, prepare, start)
    used = [k for k, reason in enumerate(reasons) if not reason]
    axes = [quantity.axis for quantity in CAMERA]

    def simulate(positions: Sequence[int], coordinates: Array, count: int) -> Array:
        quantities = [CAMERA[k] for k in positions]
        return measure_exposures(exposures, quantities, coordinates, count, prepare)

    found = indirect_inference.fit(real, simulate, axes, start, used)
    rows: list[results.FittedQuantity] = [jpeg]
    fields = [_field(sensor, "jpeg_quality", jpeg.value, jpeg)]
    for k, quantity in enumerate(CAMERA):
        if k not in found:
            rows += results.not_fitted([quantity], reasons[k])
            continue
        value = _distribution(quantity, found[k])
        row = results.fitted_quantity(quantity, found[k], float(start[k]), value, quantity.path)
        if quantity.own is not None:
            row = replace(row, before=quantity.own(pipeline))
        rows.append(row)
        if row.is_fitted:
            fields += [_field(sensor, key, v, row) for key, v in quantity.fields(value).items()]
    fitted = [(CAMERA[k], one) for k, one in found.items() if one.determined]
    return results.Part(tuple(rows), _compare(exposures, photos, prepare, fitted), tuple(fields))


def _field(sensor: int, key: str, value: Any, row: results.FittedQuantity) -> results.FittedField:
    return results.FittedField(
        base.FieldChange("sensors", sensor, f"image_pipeline.{key}", value), (row,)
    )


def _fit_jpeg(pipeline: ImagePipeline, qualities: Array) -> results.FittedQuantity:
    """Quality of compression; its value is None if most photographs show none."""
    known = qualities[np.isfinite(qualities)]
    named = (jpeg_quality.NAME, jpeg_quality.UNIT, jpeg_quality.PATH, jpeg_quality.STATISTIC)
    own = pipeline.jpeg_quality
    before = None if own is None else base.typical(own)
    missing = len(qualities) - len(known)
    note = f"no compression found in {missing} of {len(qualities)}" if missing else ""
    if 2 * len(known) <= len(qualities):
        return results.FittedQuantity(*named, before, None, True, n=len(qualities), note=note)
    found = indirect_inference.direct_estimate(known, jpeg_quality.AXIS)
    value = jpeg_quality.distribution(known)
    return results.FittedQuantity(
        *named,
        before,
        value,
        True,
        found.mean,
        *results.interval(found, float),
        results.spread_of(found, float),
        found.n,
        found.n_enough,
        note,
    )


def _unmeasurable(
    exposures: Sequence[Exposure], real: Array, prepare: Prepare, start: Array
) -> list[str]:
    """Reason for each of ``CAMERA`` that cannot be fitted; empty for the others."""
    sensorless = exposures[0].pipeline.image_sensor is None
    added = (NOISE, READ_NOISE) if sensorless else ()
    quiet = [quantity for quantity in CAMERA if quantity not in added]
    own = [float(start[CAMERA.index(quantity)]) for quantity in quiet]

    def measure(exposure: Exposure) -> list[float]:
        pipeline = prepare(exposure.pipeline)
        for quantity, coordinate in zip(quiet, own, strict=True):
            pipeline = quantity.apply(pipeline, coordinate)
        picture = photograph(exposure, pipeline)
        return [quantity.measure(picture) for quantity in CAMERA]

    simulated = np.array(list(map_in_threads(measure, exposures)))
    reasons = []
    for k, quantity in enumerate(CAMERA):
        theirs, ours = (column[np.isfinite(column)] for column in (real[:, k], simulated[:, k]))
        reason = ""
        if not len(theirs):
            reason = "not measurable in any photograph"
        elif not len(ours):
            reason = "not measurable in any simulated photograph"
        elif quantity in added and np.median(theirs) < np.median(ours) + NOISE_EXCESS:
            reason = "no noise beyond the rounding to eight bits; the camera has no image_sensor"
        reasons.append(reason)
    if sensorless:
        # A sensor is added as a whole, or not at all.
        noise, read_noise = (CAMERA.index(quantity) for quantity in (NOISE, READ_NOISE))
        reasons[read_noise] = reasons[noise] or reasons[read_noise]
    return reasons


def _distribution(quantity: CameraQuantity, found: indirect_inference.Estimate) -> Any:
    """YAML of a fitted parameter: a number, or a clipped normal distribution."""
    mean = quantity.to_value(found.mean)
    stddev = base.round_digits(results.spread_of(found, quantity.to_value))
    if not quantity.axis.varies or stddev <= 0.0:
        return base.round_digits(mean)
    lowest, highest = (quantity.to_value(v) for v in (quantity.axis.low, quantity.axis.high))
    clip = max(mean - CLIP * stddev, lowest), min(mean + CLIP * stddev, highest)
    bounds = [base.round_digits(v) for v in clip]
    return {"normal": {"mean": base.round_digits(mean), "stddev": stddev, "clip": bounds}}


def _compare(
    exposures: Sequence[Exposure],
    photos: Sequence[MeasuredPhoto],
    prepare: Prepare,
    fitted: Sequence[tuple[CameraQuantity, indirect_inference.Estimate]],
) -> tuple[results.ComparedStatistic, ...]:
    measures = [*(q.measure for q in CAMERA), *(measure for _, measure in PICTURES)]

    def describe(exposure: Exposure, pipeline: ImagePipeline) -> list[float]:
        picture = photograph(exposure, pipeline)
        return [measure(picture) for measure in measures]

    def before(exposure: Exposure) -> list[float]:
        return describe(exposure, exposure.pipeline)

    def after(exposure: Exposure) -> list[float]:
        pipeline, rng = prepare(exposure.pipeline), exposure.streams.rng("match/after")
        for quantity, found in fitted:
            drawn = found.mean + found.spread * min(max(float(rng.normal()), -CLIP), CLIP)
            drawn = min(max(drawn, quantity.axis.low), quantity.axis.high)
            pipeline = quantity.apply(pipeline, drawn)
        return describe(exposure, pipeline)

    old, new = (np.array(list(map_in_threads(make, exposures))) for make in (before, after))
    real = np.array([(*photo.statistics, *photo.descriptions) for photo in photos])
    names = [*(q.statistic for q in CAMERA), *(name for name, _ in PICTURES)]
    return tuple(
        results.ComparedStatistic(name, real[:, k], old[:, k], new[:, k])
        for k, name in enumerate(names)
    )
