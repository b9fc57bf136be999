"""``scenes.jsonl``: one line per sample of a shard, with its complete final scene.

A later view of a scene holds only those fields of its Scene that differ from the scene's first
line in the shard, whose sample index it names as ``base``: views share most of their world.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gen_data.generator.core.sample import Sample
from gen_data.generator.core.scene import Scene
from gen_data.generator.core.serialization import canonical_json, from_plain

SCENES_NAME = "scenes.jsonl"


@dataclass(frozen=True, slots=True)
class KeptScene:
    """Where a sample came from, and its final scene: rendering it again gives its images."""

    index: int
    scene_index: int
    view_index: int
    step_index: int
    split: str
    attempts: int
    scene: Scene


def scene_line(sample: Sample, base: Sample | None) -> str:
    """The line of a sample, without its line break.

    Args:
        sample: What the line is about.
        base: The first sample of its scene in the shard; None if that is the sample itself.
    """
    fields = {f.name: getattr(sample.scene, f.name) for f in dataclasses.fields(Scene)}
    if base is not None:
        fields = {k: v for k, v in fields.items() if not _same(v, getattr(base.scene, k))}
    return canonical_json(
        {
            "index": sample.index,
            "scene_index": sample.scene_index,
            "view_index": sample.view_index,
            "step_index": sample.step_index,
            "split": sample.split,
            "attempts": sample.attempts,
            "base": None if base is None else base.index,
            "scene": fields,
        }
    )


def read_scenes(path: Path) -> Iterator[KeptScene]:
    """The scenes of a shard's file, in order.

    Raises:
        ValueError, KeyError, TypeError: the file is damaged.
    """
    complete: dict[int, Mapping[str, Any]] = {}
    with path.open(encoding="utf-8") as lines:
        for line in lines:
            row = json.loads(line)
            base = row.pop("base")
            plain = {**(complete[base] if base is not None else {}), **row.pop("scene")}
            if base is None:
                complete = {row["index"]: plain}
            yield KeptScene(**row, scene=from_plain(Scene, plain))


def _same(one: object, other: object) -> bool:
    return one is other or one == other
