"""Comparison of two stored samples, stage by stage: which one was the first to differ.

=========  ======================================================================================
stage      content
=========  ======================================================================================
scene      the final scene, drawn by randomizers and settled by physics
geometry   decoded label images: depth, ids, normals, flow
render     decoded photographs, laser points, rows of devices
labels     annotations
encode     bytes of these files, which may differ although their contents are equal
=========  ======================================================================================

A stage uses the results of the stages before: the first one that differs has the cause.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gen_data.core import capture, errors, serialization
from gen_data.runner import durable_files, plan, provenance
from gen_data.runner.labels import LABELS_NAME

STAGES = ("scene", "geometry", "render", "labels", "encode")
SENSED = frozenset(
    {
        capture.Channel.RGB.value,
        capture.Channel.RADIANCE.value,
        capture.Channel.MEASURED_DEPTH.value,
        capture.Channel.INFRARED.value,
    }
)
"""Images that are rendered or measured; all other images are labels of geometry."""

SHOWN_MAX = 3
"""Number of differing fields that a message lists."""


@dataclass(frozen=True)
class Difference:
    """The first difference of two samples.

    Attributes:
        index: Index of the sample.
        stage: One of ``STAGES``.
        text: The difference, in words.
    """

    index: int
    stage: str
    text: str

    def __str__(self) -> str:
        """One line for a user."""
        return f"sample {self.index}: first difference in stage {self.stage}: {self.text}"


@dataclass(frozen=True)
class SampleFiles:
    """The files of one sample in the folder of a shard.

    Attributes:
        folder: Folder of the shard.
        index: Index of the sample.
    """

    folder: Path
    index: int

    @cached_property
    def scene(self) -> dict[str, Any]:
        """Its line of ``scenes.jsonl``, complete."""
        plain = self._parse(provenance.SCENES_NAME, self.index)
        base = plain.pop("base")
        if base is not None:
            shared = self._parse(provenance.SCENES_NAME, base)["scene"]
            plain["scene"] = {**shared, **plain["scene"]}
        return plain

    @cached_property
    def labels(self) -> dict[str, Any]:
        """Its line of ``labels.jsonl``."""
        return self._parse(LABELS_NAME, self.index)

    @cached_property
    def media(self) -> dict[str, Path]:
        """Files of its sensors by path in the shard, sorted; named by the sensors in its labels."""
        sensors = {*self.labels["images"], *self.labels["scans"], *self.labels["tables"]}
        found = {
            path.relative_to(self.folder).as_posix(): path
            for sensor in sensors
            for path in (self.folder / sensor).glob(f"*/{self.index:09d}.*")
        }
        return dict(sorted(found.items()))

    def images(self, sensed: bool) -> dict[str, NDArray[Any]]:
        """Decoded files of its sensors: rendered or measured ones, or the label images."""
        return {
            name: read_array(path)
            for name, path in self.media.items()
            if (path.suffix == ".npy" or path.parent.name in SENSED) == sensed
        }

    def digests(self) -> dict[str, str]:
        """SHA-256 of the content of every stage."""
        return {
            "scene": _digest_json(self.scene),
            "geometry": _digest_arrays(self.images(sensed=False)),
            "render": _digest_arrays(self.images(sensed=True)),
            "labels": _digest_json(self.labels),
            "encode": _digest_json({n: durable_files.hash_file(p) for n, p in self.media.items()}),
        }

    def _parse(self, name: str, index: int) -> dict[str, Any]:
        path = self.folder / name
        try:
            lines = path.read_bytes().splitlines()
            number = min(index - int(json.loads(lines[0])["index"]), len(lines) - 1)
            plain: dict[str, Any] = json.loads(lines[number])
            while number > 0 and plain["index"] > index:
                # Samples that failed have no line.
                number -= 1
                plain = json.loads(lines[number])
            if plain["index"] != index:
                raise ValueError(f"line {number + 1} is of sample {plain['index']}")
        except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
            raise errors.StorageError(f"{path}: sample {index} cannot be read ({error})") from None
        return plain


def read_array(path: Path) -> NDArray[Any]:
    """Decode an image or a table, without interpreting its values.

    Raises:
        StorageError: it is damaged.
    """
    import cv2

    try:
        if path.suffix == ".npy":
            array: NDArray[Any] = np.load(path, allow_pickle=False)
            return array
        decoded = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    except (OSError, ValueError) as error:
        raise errors.StorageError(f"{path}: cannot be decoded ({error})") from None
    if decoded is None:
        raise errors.StorageError(f"{path}: cannot be decoded")
    return np.asarray(decoded)


def compare_samples(
    one: SampleFiles, other: SampleFiles, semantic: bool = False
) -> Difference | None:
    """The first difference of two samples; None if they are equal.

    Args:
        one: Called "was" in messages.
        other: Called "now".
        semantic: Compare contents only, not the bytes of encoded files.

    Raises:
        StorageError: a file is missing or damaged.
    """
    comparisons: Mapping[str, Callable[[], Iterator[str]]] = {
        "scene": lambda: plan.differences("", one.scene, other.scene),
        "geometry": lambda: _differing_arrays(one.images(sensed=False), other.images(sensed=False)),
        "render": lambda: _differing_arrays(one.images(sensed=True), other.images(sensed=True)),
        "labels": lambda: plan.differences("", one.labels, other.labels),
        "encode": lambda: _differing_bytes(one.media, other.media),
    }
    for stage in STAGES:
        if semantic and stage == "encode":
            continue
        found = list(comparisons[stage]())
        if found:
            more = f"; {len(found) - SHOWN_MAX} more" if len(found) > SHOWN_MAX else ""
            return Difference(one.index, stage, "; ".join(found[:SHOWN_MAX]) + more)
    return None


def _differing_arrays(
    one: Mapping[str, NDArray[Any]], other: Mapping[str, NDArray[Any]]
) -> Iterator[str]:
    for name in sorted({*one, *other}):
        if name not in one or name not in other:
            yield f"{name} is missing in one of the two"
        elif one[name].shape != other[name].shape or one[name].dtype != other[name].dtype:
            was, now = (f"{a.dtype} {list(a.shape)}" for a in (one[name], other[name]))
            yield f"{name}: was {was}, now {now}"
        elif one[name].tobytes() != other[name].tobytes():
            yield f"{name}: {_describe_change(one[name], other[name])}"


def _describe_change(one: NDArray[Any], other: NDArray[Any]) -> str:
    if one.dtype.names:
        rows = sum(a.tobytes() != b.tobytes() for a, b in zip(one, other, strict=True))
        return f"{rows} of {len(one)} rows differ"
    change = np.abs(one.astype(np.float64) - other.astype(np.float64))
    pixels = change.reshape(*one.shape[:2], -1).max(axis=-1)
    return f"{np.count_nonzero(pixels)} of {pixels.size} pixels differ, by {pixels.max():g} at most"


def _differing_bytes(one: Mapping[str, Path], other: Mapping[str, Path]) -> Iterator[str]:
    for name, path in one.items():
        if path.read_bytes() != other[name].read_bytes():
            yield f"{name}: other bytes for the same content"


def _digest_json(plain: Any) -> str:
    return hashlib.sha256(serialization.canonical_json(plain).encode()).hexdigest()


def _digest_arrays(arrays: Mapping[str, NDArray[Any]]) -> str:
    digest = hashlib.sha256()
    for name, array in arrays.items():
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
