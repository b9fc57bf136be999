"""Types of quantities: the statistic that each measures, and the parameter that it fits."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from gen_data.assemble.config import Config
from gen_data.core.streams import Streams
from gen_data.lab.matching import indirect_inference, picture, recordings
from gen_data.sensors.camera.image_pipeline import ImagePipeline
from gen_data.sensors.lidar.lidar_sensor import LidarSensor

Coordinate = Callable[[float], float]


def identity(value: float) -> float:
    """A parameter that is its own coordinate."""
    return value


def power_of_two(coordinate: float) -> float:
    """A parameter whose coordinate is its logarithm, base 2."""
    return float(2.0**coordinate)


@dataclass(frozen=True)
class CameraQuantity:
    """A parameter of a camera's image pipeline.

    Attributes:
        name: In tables.
        unit: Unit of the parameter.
        statistic: Statistic of each picture, in words.
        path: Path of the field in a sensor.
        measure: The statistic of a picture; NaN = not measurable.
        start: Coordinate at which the search begins, a pipeline's own, typical one.
        apply: The pipeline with one value of the parameter, given by its coordinate.
        to_value: Value in the unit, from the coordinate.
        fields: Values in YAML by dotted path in ``image_pipeline``, for a number or a distribution.
        axis: Range of the coordinate.
        own: A pipeline's own, typical value in the unit where ``start`` may be another one; None =
            the pipeline has none.
    """

    name: str
    unit: str
    statistic: str
    path: str
    measure: Callable[[picture.Picture], float]
    start: Callable[[ImagePipeline], float]
    apply: Callable[[ImagePipeline, float], ImagePipeline]
    fields: Callable[[Any], Mapping[str, Any]]
    axis: indirect_inference.Axis
    to_value: Coordinate = identity
    own: Callable[[ImagePipeline], float | None] | None = None


@dataclass(frozen=True)
class LidarQuantity:
    """A parameter of a laser scanner, one value for all scans; see ``CameraQuantity``."""

    name: str
    unit: str
    statistic: str
    path: str
    measure: Callable[[recordings.Scan], float]
    start: Callable[[LidarSensor], float]
    apply: Callable[[LidarSensor, float], LidarSensor]
    axis: indirect_inference.Axis
    to_value: Coordinate = identity

    @property
    def key(self) -> str:
        """Field of the sensor that the parameter is in."""
        return self.path.partition(".")[0]


@dataclass(frozen=True)
class LabelQuantity:
    """A change of where cameras are, fitted to boxes; attributes as in ``CameraQuantity``.

    Attributes:
        slope: Derivative of the statistic with the coordinate, which is 0 for no change, for a
            camera whose focal length is so many heights of its image.
        change: The field that a configuration gets for a camera by name and a coordinate. Raises
            ``NoParameter`` if it has none.
    """

    name: str
    unit: str
    statistic: str
    measure: Callable[[recordings.ImageLabels], float]
    slope: Callable[[float], float]
    change: "Callable[[Config, str, float], FieldChange]"
    axis: indirect_inference.Axis
    to_value: Coordinate = identity


@dataclass(frozen=True, slots=True)
class FieldChange:
    """A new value of one field of a plug-in.

    Attributes:
        section: List of the configuration, such as ``randomizers``.
        number: Position in it.
        field: Dotted path in the plug-in.
        value: In YAML.
    """

    section: str
    number: int
    field: str
    value: Any


class NoParameter(Exception):
    """A configuration has no parameter that a quantity could fit; the text explains why."""


def with_model(sensor: LidarSensor, **changes: Any) -> LidarSensor:
    """The scanner with another data sheet."""
    model = sensor.device
    name = model.name or (sensor.model if isinstance(sensor.model, str) else "")
    return sensor.model_copy(update={"model": model.model_copy(update={"name": name, **changes})})


def typical(distribution: Any) -> float:
    """Median of 65 draws of a distribution of numbers."""
    rng = Streams(seed=0, scene=0).rng("match")
    return sorted(float(distribution.draw(rng)) for _ in range(65))[32]


def map_numbers(value: Any, place: Coordinate, size: Coordinate) -> Any:
    """A distribution in YAML whose values are mapped by a linear function.

    Args:
        value: A number, or a ``uniform``, ``log_uniform`` or ``normal`` distribution.
        place: The function.
        size: The same function of differences.

    Raises:
        NoParameter: it is another distribution.
    """
    if isinstance(value, int | float):
        return round_digits(place(value))
    if isinstance(value, Mapping) and len(value) == 1:
        ((kind, argument),) = value.items()
        if kind in ("uniform", "log_uniform"):
            return {kind: [round_digits(place(v)) for v in argument]}
        if kind == "normal":
            kept: dict[str, Any] = {"mean": round_digits(place(argument["mean"]))}
            kept["stddev"] = round_digits(size(argument["stddev"]))
            clip = argument.get("clip")
            if clip is not None:
                kept["clip"] = [round_digits(place(v)) for v in clip]
            return {kind: kept}
    raise NoParameter(f"{value} can be neither scaled nor shifted")


def round_digits(value: float) -> float:
    """A number to four significant digits."""
    return float(f"{value:.4g}")
