"""Claim: no scene is in two splits."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from typing import Any

from gen_data.core.errors import StorageError
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Finding
from gen_data.runner.labels import LABELS_NAME
from gen_data.runner.provenance import SCENES_NAME


def check_splits(examined: Examined) -> Iterator[Finding]:
    """Compare the splits of all samples of each scene, and of scenes with equal contents.

    The number of a scene follows from the sample's number; the splits are read from the labels and
    from the kept scenes. Contents are the bodies and their poses.
    """
    contradictions = Contradictions()
    info = examined.stored.info
    per_scene = info.views_per_scene * info.steps_per_scene
    splits: dict[int, tuple[str, int]] = {}
    contents: dict[str, tuple[str, int]] = {}
    sizes: dict[str, int] = {}
    for kept, labels in _rows(examined):
        index, scene, split = labels["index"], labels["index"] // per_scene, labels["split"]
        sizes[split] = sizes.get(split, 0) + 1
        if (kept["split"], kept["scene_index"]) != (split, scene):
            contradictions.add(
                f"sample {index}: split {split} of scene {scene} in {LABELS_NAME}, split "
                f"{kept['split']} of scene {kept['scene_index']} in {SCENES_NAME}"
            )
        first, before = splits.setdefault(scene, (split, index))
        if first != split:
            contradictions.add(
                f"scene {scene}: sample {before} is in {first}, sample {index} in {split}"
            )
        if (bodies := kept["scene"].get("bodies")) is not None:
            digest = hashlib.sha256(json.dumps(bodies, sort_keys=True).encode()).hexdigest()
            first, other = contents.setdefault(digest, (split, scene))
            if first != split and other != scene:
                contradictions.add(f"scenes {other} ({first}) and {scene} ({split}) are equal")
    figures = {"scenes": len(splits), **{f"samples in {n}": k for n, k in sorted(sizes.items())}}
    yield contradictions.judge("", figures)


def _rows(examined: Examined) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Plain lines of the kept scene and of the labels of every sample."""
    stored = examined.stored
    for shard in range(stored.plan.shard_count):
        folder = stored.shard_dir(shard)
        try:
            with (
                (folder / SCENES_NAME).open(encoding="utf-8") as scenes,
                (folder / LABELS_NAME).open(encoding="utf-8") as labels,
            ):
                for kept, labelled in zip(scenes, labels, strict=True):
                    yield json.loads(kept), json.loads(labelled)
        except (OSError, ValueError) as error:
            raise StorageError(f"{folder}: its scenes and labels cannot be read: {error}") from None
