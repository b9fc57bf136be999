"""Fit of where a camera is to the boxes of labels."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.errors import list_names
from gen_data.core.se3 import Array
from gen_data.lab.matching.indirect_inference import estimate, solve
from gen_data.lab.matching.quantities import LABELS, LabelQuantity
from gen_data.lab.matching.quantities.base import FieldChange, NoParameter
from gen_data.lab.matching.recordings import ImageLabels
from gen_data.lab.matching.results import (
    ComparedStatistic,
    FittedField,
    Part,
    fitted_quantity,
    not_fitted,
)
from gen_data.lab.matching.simulation import label_scenes
from gen_data.sensors.camera.rgb_camera import RgbCamera

Progress = Callable[[str], None]
SCENES_MAX = 12
"""Each candidate renders its scenes anew."""
NO_LABELS = "no labels in annotations/*.json (COCO) or label_2/*.txt (KITTI)"


def fit_labels(
    source: str,
    camera: RgbCamera | None,
    labels: Sequence[ImageLabels],
    scenes: int,
    progress: Progress,
) -> Part:
    """Fit where a camera is.

    Args:
        source: The configuration.
        camera: The camera; None = none.
        labels: Real ones.
        scenes: Number of scenes.
        progress: Called with the name of each step.
    """
    if camera is None or not labels:
        return Part(not_fitted(LABELS, "no camera or no photographs" if labels else NO_LABELS))
    real, remarks = _of_common_classes(load_config(source), labels)
    if not any(image.boxes for image in real):
        return Part(
            not_fitted(LABELS, "labels and configuration have no class in common"), remarks=remarks
        )
    part = Part(remarks=remarks)
    for quantity in LABELS:
        progress(f"fitting {quantity.name}")
        try:
            more = _fit(quantity, source, part.fields, camera, real, min(scenes, SCENES_MAX))
        except NoParameter as reason:
            more = Part(not_fitted([quantity], str(reason)))
        part = Part(
            part.quantities + more.quantities,
            part.statistics + more.statistics,
            part.fields + more.fields,
            remarks,
        )
    return part


def with_fields(source: str, fields: Sequence[FittedField]) -> Config:
    """The configuration with fitted fields."""
    return load_config(source, overrides=[_override(field.change) for field in fields])


def _override(change: FieldChange) -> str:
    return f"{change.section}[{change.number}].{change.field}={json.dumps(change.value)}"


def _fit(
    quantity: LabelQuantity,
    source: str,
    earlier: Sequence[FittedField],
    camera: RgbCamera,
    real: Sequence[ImageLabels],
    scenes: int,
) -> Part:
    """Fit one quantity, after others. Raises NoParameter."""
    config = with_fields(source, earlier)
    classes = {box[0].lower() for image in real for box in image.boxes}
    intrinsics = camera.nominal_intrinsics()
    slope = quantity.slope(intrinsics.fy_px / intrinsics.height_px)
    simulated: list[Array] = []

    def simulate(coordinates: Array, count: int) -> Array:
        change = quantity.change(config, camera.name, float(coordinates[0]))
        found = label_scenes(
            with_fields(source, [*earlier, FittedField(change, ())]),
            camera.name,
            min(scenes, count),
        )
        values = [[quantity.measure(_of_classes(image, classes))] for image in found]
        simulated.append(np.array(values))
        return simulated[-1]

    values = np.array([[quantity.measure(image)] for image in real])
    solution = solve(values, simulate, [quantity.axis], np.zeros(1), slopes=np.array([[slope]]))
    (found,) = estimate(values, solution, [quantity.axis])
    change = quantity.change(config, camera.name, found.mean)
    row = fitted_quantity(quantity, found, 0.0, change.value, change.field)
    statistic = ComparedStatistic(
        quantity.statistic, values[:, 0], simulated[0][:, 0], solution.simulated[:, 0]
    )
    fields = (FittedField(change, (row,)),) if row.is_fitted else ()
    return Part((row,), (statistic,), fields)


def _of_common_classes(
    config: Config, labels: Sequence[ImageLabels]
) -> tuple[list[ImageLabels], tuple[str, ...]]:
    """Labels of classes that the configuration has too, and a remark on the others."""
    ours = PipelineFactory(config, n=1).categories
    known = {name.lower() for name in ours}
    theirs = sorted({box[0] for image in labels for box in image.boxes})
    other = [name for name in theirs if name.lower() not in known]
    remark = (
        f"classes without a counterpart, left out: {list_names(other)}; the configuration has"
        f" {list_names(ours)}"
    )
    return [_of_classes(image, known) for image in labels], (remark,) if other else ()


def _of_classes(image: ImageLabels, classes: set[str]) -> ImageLabels:
    return replace(image, boxes=tuple(box for box in image.boxes if box[0].lower() in classes))
