"""``scenes.jsonl``: one line per sample of a shard, with its complete final scene.

Further views of a scene have only those fields of the Scene that differ from the first line of the
scene in the shard, whose sample index is ``base``: views share most of their scene.
"""

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from gen_data.core import bounded_cache, path_names, serialization
from gen_data.core.sample import Sample
from gen_data.core.scene import Scene

SCENES_NAME = "scenes.jsonl"


@dataclass(frozen=True, slots=True)
class KeptScene:
    """Indices of a sample and its final scene, which renders to its images."""

    index: int
    scene_index: int
    view_index: int
    step_index: int
    split: str
    attempts: int
    view_attempts: int
    scene: Scene


def scene_line(sample: Sample, base: Sample | None) -> str:
    """Format the line of a sample, without line break.

    Args:
        sample: Described by the line.
        base: The first sample of its scene in the shard; None if that is the sample itself.
    """
    fields = {f.name: getattr(sample.scene, f.name) for f in dataclasses.fields(Scene)}
    if base is not None:
        fields = {k: v for k, v in fields.items() if not _same(v, getattr(base.scene, k))}
    texts = {
        name: _list_text(value) if name in _RECURRING else serialization.canonical_json(value)
        for name, value in fields.items()
    }
    facts = {
        "index": sample.index,
        "scene_index": sample.scene_index,
        "view_index": sample.view_index,
        "step_index": sample.step_index,
        "split": sample.split,
        "attempts": sample.attempts,
        "view_attempts": sample.view_attempts,
        "base": None if base is None else base.index,
    }
    plain = {name: serialization.canonical_json(value) for name, value in facts.items()}
    return _object_text({**plain, "scene": _object_text(texts)})


_RECURRING = ("bodies", "instances")
"""Fields most of whose items are the same objects at all steps of a sequence."""
_texts: bounded_cache.ObjectCache[str] = bounded_cache.ObjectCache(2048)
"""Canonical JSON of the latest of these items, half a kilobyte each."""


def _list_text(items: Sequence[object]) -> str:
    texts = (_texts.get(item, partial(serialization.canonical_json, item)) for item in items)
    return f"[{','.join(texts)}]"


def _object_text(texts: Mapping[str, str]) -> str:
    """Canonical JSON of an object, from the canonical JSON of its values."""
    return "{" + ",".join(f'"{name}":{texts[name]}' for name in sorted(texts)) + "}"


def parse_scene(line: bytes | str, scene_of: Callable[[int], Scene]) -> KeptScene:
    """The inverse of ``scene_line``.

    Args:
        line: Line of the sample.
        scene_of: Returns the scene of another sample of the shard, by its index.

    Raises:
        ValueError, KeyError, TypeError: a line is damaged.
    """
    row = json.loads(line)
    base, own = row.pop("base"), row.pop("scene")
    path_names.check_name(row["split"])
    if base is None:
        return KeptScene(**row, scene=serialization.from_plain(Scene, own))
    scene = dataclasses.replace(scene_of(base), **serialization.fields_from_plain(Scene, own))
    return KeptScene(**row, scene=scene)


def _same(one: object, other: object) -> bool:
    return one is other or one == other
