"""Reference samples of the shipped configurations, made on a CPU and compared on a device.

A reference has the scene of a sample, and the readings of its sensors: randomizers and physics take
no part in the comparison. Visibility is found by rays, as on a GPU; the rasteriser of the CPU snaps
edges to a grid and differs from rays in single pixels.
"""

import lzma
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data import configs
from gen_data.assemble import config, pipeline_factory
from gen_data.core import capture, scene, scene_time
from gen_data.core.sample import Sample
from gen_data.core.streams import Streams
from gen_data.pipeline import Pipeline
from gen_data.pipeline.pipeline import DrawnView
from gen_data.runner.labels import labels_line
from gen_data.runner.provenance import parse_scene, scene_line

SAMPLES = 2
"""References of each configuration."""
POINTS_MAX = 1024
"""Points of a scan that a reference keeps."""
SIDE_MAX_PX = 192
"""Longest side of an image in a reference, of a camera with more than four times as many."""
LEVELS_MAX, PIXELS_MIN, RANGE_M_MAX = 1, 0.999, 1e-4
"""Images differ by at most one level in 99.9 % of their pixels, positions by 0.1 mm."""
Arrays = dict[str, NDArray[Any]]


def config_names() -> tuple[str, ...]:
    """The shipped configurations."""
    return tuple(sorted(path.stem for path in Path(configs.__path__[0]).glob("*.yaml")))


def reduced_config(name: str, device: str) -> config.Config:
    """A shipped configuration with at most a sixteenth of the pixels, and few paths.

    Scanners are ideal: a point that is missing would change the noise of all points after it.
    """
    spec = config.load_config(f"{name}.yaml", seed=1)
    texts = ["render.visibility=rays", f"render.device={device}", "exporters=[]"]
    if "tier" in spec.resolved["render"]:
        texts.append("render.samples=4")
    for number, sensor in enumerate(spec.sensors):
        if hasattr(sensor, "ideal"):
            texts.append(f"sensors[{number}].ideal=true")
        size_px = getattr(sensor, "size_px", None)
        if size_px is not None:
            factor = max(4.0, max(size_px) / SIDE_MAX_PX)
            width_px, height_px = (max(64, 4 * round(side / factor / 4)) for side in size_px)
            texts.append(f"sensors[{number}].size_px=[{width_px}, {height_px}]")
    return config.load_config(f"{name}.yaml", seed=1, overrides=texts)


def make_references(name: str) -> Arrays:
    """References of a configuration, from the CPU; keys begin with its name."""
    arrays: Arrays = {}
    with pipeline_factory.open_pipeline(reduced_config(name, "cpu")) as pipeline:
        for index in range(SAMPLES):
            sample = pipeline.sample(index)
            view = pipeline.sample(index - index % pipeline.info.steps_per_scene)
            place = f"{name}/{index}"
            arrays[f"{place}/scene"] = _packed(scene_line(view, None).encode())
            for key, values in observed(sample):
                arrays[f"{place}/{key}"] = values
    return arrays


def observed(sample: Sample) -> Iterator[tuple[str, NDArray[Any]]]:
    """Readings and labels of a sample, reduced to the compared data.

    Photographs are PNG files; label images their digest and, for diagnosis, whole ids or every
    31st number; points every n-th, with the digest of all ids; annotations a digest.
    """
    for name, reading in sorted(sample.capture.readings.items()):
        for channel, image in sorted(reading.channels.items()):
            place = f"{name}/{channel}"
            if channel is capture.Channel.RGB:
                yield f"image/{place}", cv2.imencode(".png", image)[1].reshape(-1)
            elif channel not in (capture.Channel.MEASURED_DEPTH, capture.Channel.INFRARED):
                yield f"digest/{place}", _digest(image)
                whole = image.dtype.kind == "u"
                yield f"values/{place}", image if whole else image.reshape(-1)[::31]
    for name, cloud in sorted(sample.capture.clouds.items()):
        points = cloud.points
        ids = np.stack([points["instance_id"], points["category_id"], points["ring"]])
        yield f"digest/{name}/ids", _digest(ids)
        step = max(1, -(-len(points) // POINTS_MAX))
        yield f"points/{name}", np.array(points["position_m"][::step])
        yield f"count/{name}", np.array([len(points)])
    yield "digest/annotations", _digest(np.frombuffer(labels_line(sample).encode(), np.uint8))


@dataclass(frozen=True)
class Finding:
    """One difference between a sample and its reference; ``what`` names sensor and channel."""

    what: str
    fact: str


def compare(name: str, references: Path, device: str) -> dict[str, Any]:
    """Draw the references of a configuration on a device and compare.

    Returns:
        ``compared``: number of images, scans and annotations; ``findings``: differences that
        exceed the bounds; ``repeats``: whether the device draws the same bytes twice.
    """
    findings: list[Finding] = []
    compared, repeats = 0, True
    with np.load(references) as stored:
        known = [key for key in stored.files if key.startswith(f"{name}/")]
        pipeline = pipeline_factory.open_pipeline(reduced_config(name, device))
        for index in sorted({int(key.split("/")[1]) for key in known}):
            place = f"{name}/{index}/"
            reference = {
                key.removeprefix(place): stored[key] for key in known if key.startswith(place)
            }
            line = lzma.decompress(reference.pop("scene").tobytes())
            again = dict(observed(draw_again(pipeline, line, index)))
            findings += list(differences(f"sample {index}", reference, again))
            compared += len(reference)
            twice = dict(observed(draw_again(pipeline, line, index)))
            repeats &= have_same_bytes(again, twice)
    return {"compared": compared, "findings": [vars(f) for f in findings], "repeats": repeats}


def have_same_bytes(one: Arrays, other: Arrays) -> bool:
    """Whether arrays of the same names have the same bytes: NaN, for nothing, equals itself."""
    return one.keys() == other.keys() and all(
        values.dtype == other[key].dtype
        and values.shape == other[key].shape
        and values.tobytes() == other[key].tobytes()
        for key, values in one.items()
    )


def draw_again(pipeline: Pipeline, line: bytes, index: int) -> Sample:
    """Read the sensors in a stored scene, without randomizers and physics."""
    kept = parse_scene(line, _no_other_scene)
    info = pipeline.info
    streams = Streams(
        info.seed, kept.scene_index, attempt=kept.attempts - 1, index=kept.scene_index
    )
    _, _, sensors = pipeline.config.open_scene(streams)
    number = kept.scene_index * info.views_per_scene + kept.view_index
    streams = Streams(
        info.seed, kept.scene_index, view=kept.view_index, attempt=kept.view_attempts - 1,
        index=number,
    )  # fmt: skip
    view = DrawnView(number, scene_time.place_sensors(kept.scene), streams)
    return pipeline.read_sensors(view, sensors, index % info.steps_per_scene)


def _no_other_scene(index: int) -> scene.Scene:
    raise LookupError(f"a reference refers to sample {index}")


def differences(
    place: str, reference: Mapping[str, Any], found: Mapping[str, Any]
) -> Iterator[Finding]:
    """Differences beyond the bounds, in the order of the keys."""
    for key in sorted(reference.keys() | found.keys()):
        kind, _, what = key.partition("/")
        if key not in reference or key not in found:
            yield Finding(f"{place}, {key}", "only in one of the two")
            continue
        fact = _JUDGES[kind](reference[key], found[key], _beside(reference, found, what))
        if fact:
            yield Finding(f"{place}, {what}", fact)


def _beside(reference: Mapping[str, Any], found: Mapping[str, Any], what: str) -> str:
    """How label values differ, for the finding about their digest."""
    one, other = reference.get(f"values/{what}"), found.get(f"values/{what}")
    if one is None or other is None or one.shape != other.shape:
        return ""
    differ = ~(
        (one == other) | (np.isnan(one) & np.isnan(other))
        if one.dtype.kind == "f"
        else one == other
    )
    text = f"{np.count_nonzero(differ)} of {differ.size} values kept differ"
    if one.dtype.kind == "f" and differ.any():
        gaps = np.abs(one[differ].astype(np.float64) - other[differ])
        text += f", by up to {np.nanmax(gaps):.3g}"
    return text


def _judge_digest(one: Any, other: Any, beside: str) -> str:
    return (
        "" if np.array_equal(one, other) else f"other bytes ({beside})" if beside else "other bytes"
    )


def _judge_image(one: Any, other: Any, beside: str) -> str:
    del beside
    a, b = (_levels(values) for values in (one, other))
    if a.shape != b.shape:
        return f"size {b.shape[:2]}, expected {a.shape[:2]}"
    gaps = np.abs(a - b).max(axis=2)
    close = float((gaps <= LEVELS_MAX).mean())
    if close >= PIXELS_MIN:
        return ""
    return (
        f"{100 * close:.2f} % of pixels within {LEVELS_MAX} level, up to {int(gaps.max())} levels"
    )


def _levels(png: NDArray[np.uint8]) -> NDArray[np.int16]:
    image: Any = cv2.imdecode(png, cv2.IMREAD_COLOR)
    return np.asarray(image, np.int16)


def _judge_points(one: Any, other: Any, beside: str) -> str:
    del beside
    if one.shape != other.shape:
        return "another number of points"
    gaps = np.linalg.norm(one.astype(np.float64) - other, axis=1)
    far = int(np.count_nonzero(gaps > RANGE_M_MAX))
    return f"{far} of {len(gaps)} points differ, by up to {gaps.max():.3g} m" if far else ""


def _judge_count(one: Any, other: Any, beside: str) -> str:
    del beside
    return "" if np.array_equal(one, other) else f"{int(other[0])} points, expected {int(one[0])}"


def _judge_nothing(one: Any, other: Any, beside: str) -> str:
    del one, other, beside
    return ""


_JUDGES = {
    "digest": _judge_digest, "image": _judge_image, "points": _judge_points, "count": _judge_count,
    "values": _judge_nothing,
}  # fmt: skip


def store_references(name: str, folder: str) -> str:
    """Write the references of a configuration to a file of a folder; returns its path."""
    path = Path(folder) / f"{name}.npz"
    _write(path, make_references(name))
    return str(path)


def write_references(path: Path, parts: Iterable[Path]) -> int:
    """Merge the references of several configurations into one file; returns its size [bytes]."""
    merged: Arrays = {}
    for part in parts:
        with np.load(part) as stored:
            merged |= {key: stored[key] for key in stored.files}
    _write(path, merged)
    return path.stat().st_size


def _write(path: Path, arrays: Arrays) -> None:
    named: Any = arrays
    np.savez_compressed(path, **named)


def _packed(data: bytes) -> NDArray[np.uint8]:
    return np.frombuffer(lzma.compress(data), np.uint8)


def _digest(values: NDArray[Any]) -> NDArray[np.uint8]:
    data = np.ascontiguousarray(values).tobytes()
    return np.frombuffer(sha256(data).digest()[:16], np.uint8)
