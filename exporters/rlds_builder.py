"""Files from which TensorFlow Datasets reads RLDS episodes: ``tfds.builder_from_directory``.

``features.json`` is the JSON form of ``tensorflow_datasets/core/proto/feature.proto``, as
``FeaturesDict.save_config`` writes it; ``dataset_info.json`` is the form of ``dataset_info.proto``.

Reference: Ramos et al., RLDS: an ecosystem to generate, share and use datasets in reinforcement
learning, 2021: an episode is a ``FeaturesDict`` with a ``Dataset`` of steps.
"""

import re
from collections.abc import Mapping, Sequence
from typing import Any

_FEATURES = "tensorflow_datasets.core.features."
FLAGS = ("is_first", "is_last", "is_terminal", "succeeded")
"""Integers that TensorFlow Datasets reads as truth values."""


def features(facts: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Features of an episode by the facts of its keys.

    Args:
        facts: By key with slashes: ``dtype`` (``bytes`` of texts and images) and ``shape`` in one
            step or in the episode; without a shape, a number or a text.
    """
    tree: dict[str, Any] = {}
    for key, fact in facts.items():
        *folders, name = key.split("/")
        place = tree
        for folder in folders:
            place = place.setdefault(folder, {})
        place[name] = _leaf(name, fact)
    steps = {"feature": _dictionary(tree.pop("steps")), "length": "-1"}
    whole = _dictionary(tree)
    whole["featuresDict"]["features"]["steps"] = _named("dataset_feature.Dataset", sequence=steps)
    return whole


def dataset_info(
    data_set: tuple[str, str], episodes: Sequence[int], size_bytes: int
) -> dict[str, Any]:
    """Description of a folder, which has one split.

    Args:
        data_set: Split and robot; in a name, other characters than letters and digits become ``_``.
        episodes: Number of episodes in each file, ``episodes-00000-of-00002.tfrecord`` first.
        size_bytes: Size of all files together.
    """
    split, robot = data_set
    return {
        "name": re.sub(r"\W", "_", robot),
        "version": "1.0.0",
        "fileFormat": "tfrecord",
        "splits": [
            {
                "name": split,
                "filepathTemplate": "episodes-{SHARD_X_OF_Y}.{FILEFORMAT}",
                "shardLengths": [str(count) for count in episodes],
                "numBytes": str(size_bytes),
            }
        ],
    }


def _named(kind: str, **content: Any) -> dict[str, Any]:
    return {"pythonClassName": f"{_FEATURES}{kind}", **content}


def _dictionary(tree: Mapping[str, Any]) -> dict[str, Any]:
    parts = {
        name: part if "pythonClassName" in part else _dictionary(part)
        for name, part in tree.items()
    }
    return _named("features_dict.FeaturesDict", featuresDict={"features": parts})


def _leaf(name: str, fact: Mapping[str, Any]) -> dict[str, Any]:
    shape = fact.get("shape", [])
    if fact["dtype"] != "bytes":
        dtype = "bool" if name in FLAGS else fact["dtype"]
        tensor = {"shape": _dimensions(shape), "dtype": dtype, "encoding": "none"}
        return _named("tensor_feature.Tensor", tensor=tensor)
    if not shape:
        return _named("text_feature.Text", text={})
    dtype = "uint8" if len(shape) == 3 else "uint16"
    image = {"shape": _dimensions([*shape, 1][:3]), "dtype": dtype}
    return _named("image_feature.Image", image=image)


def _dimensions(shape: Sequence[int]) -> dict[str, list[str]]:
    return {"dimensions": [str(size) for size in shape]}
