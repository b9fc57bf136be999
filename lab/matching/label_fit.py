"""Fit of where a camera is to the boxes of labels."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gen_data.assemble.config import Config, load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.core.errors import list_names
from gen_data.core.se3 import Array
from gen_data.lab.matching import indirect_inference, recordings, results, simulation
from gen_data.lab.matching.quantities import LABELS, LabelQuantity
from gen_data.lab.matching.quantities.base import FieldChange, NoParameter
from gen_data.sensors.camera.rgb_camera import RgbCamera

Progress = Callable[[str], None]
SCENES_MAX = 12
"""Each candidate renders its scenes again."""
NO_LABELS = "no labels in annotations/*.json (COCO) or label_2/*.txt (KITTI)"


def fit_labels(
    source: str,
    camera: RgbCamera | None,
    labels: Sequence[recordings.ImageLabels],
    scenes: int,
    progress: Progress,
) -> results.Part:
    """Fit where a camera is.

    Args:
        source: The configuration.
        camera: The camera; None = none.
        labels: Real ones.
        scenes: Number of scenes.
        progress: Called with the name of each step.
    """
    if camera is None or not labels:
        return results.Part(
            results.not_fitted(LABELS, "no camera or no photographs" if labels else NO_LABELS)
        )
    real, remarks = _of_common_classes(load_config(source), labels)
    if not any(image.boxes for image in real):
        return results.Part(
            results.not_fitted(LABELS, "labels and configuration have no class in common"),
            remarks=remarks,
        )
    part = results.Part(remarks=remarks)
    for quantity in LABELS:
        progress(f"fitting {quantity.name}")
        try:
            more = _fit(quantity, source, part.fields, camera, real, min(scenes, SCENES_MAX))
        except NoParameter as reason:
            more = results.Part(results.not_fitted([quantity], str(reason)))
        part = results.Part(
            part.quantities + more.quantities,
            part.statistics + more.statistics,
            part.fields + more.fields,
            remarks,
        )
    return part


def with_fields(source: str, fields: Sequence[results.FittedField]) -> Config:
    """The configuration with fitted fields."""
    return load_config(source, overrides=[_override(field.change) for field in fields])


def _override(change: FieldChange) -> str:
    return f"{change.section}[{change.number}].{change.field}={json.dumps(change.value)}"


def _fit(
    quantity: LabelQuantity,
    source: str,
    earlier: Sequence[results.FittedField],
    camera: RgbCamera,
    real: Sequence[recordings.ImageLabels],
    scenes: int,
) -> results.Part:
    """Fit one quantity, after others. Raises NoParameter."""
    config = with_fields(source, earlier)
    classes = {box[0].lower() for image in real for box in image.boxes}
    intrinsics = camera.nominal_intrinsics()
    slope = quantity.slope(intrinsics.fy_px / intrinsics.height_px)
    simulated: list[Array] = []

    def simulate(coordinates: Array, count: int) -> Array:
        change = quantity.change(config, camera.name, float(coordinates[0]))
        found = simulation.label_scenes(
            with_fields(source, [*earlier, results.FittedField(change, ())]),
            camera.name,
            min(scenes, count),
        )
        values = [[quantity.measure(_of_classes(image, classes))] for image in found]
        simulated.append(np.array(values))
        return simulated[-1]

    values = np.array([[quantity.measure(image)] for image in real])
    solution = indirect_inference.solve(
        values, simulate, [quantity.axis], np.zeros(1), slopes=np.array([[slope]])
    )
    (found,) = indirect_inference.estimate(values, solution, [quantity.axis])
    change = quantity.change(config, camera.name, found.mean)
    row = results.fitted_quantity(quantity, found, 0.0, change.value, change.field)
    statistic = results.ComparedStatistic(
        quantity.statistic, values[:, 0], simulated[0][:, 0], solution.simulated[:, 0]
    )
    fields = (results.FittedField(change, (row,)),) if row.is_fitted else ()
    return results.Part((row,), (statistic,), fields)


def _of_common_classes(
    config: Config, labels: Sequence[recordings.ImageLabels]
) -> tuple[list[recordings.ImageLabels], tuple[str, ...]]:
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


def _of_classes(image: recordings.ImageLabels, classes: set[str]) -> recordings.ImageLabels:
    return replace(image, boxes=tuple(box for box in image.boxes if box[0].lower() in classes))
