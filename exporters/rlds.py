"""RLDS-style episodes of a robot arm: one ``tf.train.Example`` per episode in TFRecord files.

::

    <split>/<robot>/
        episodes-00000-of-00002.tfrecord    one record per episode
        features.json, dataset_info.json    description for TensorFlow Datasets
        metadata.json                       type, shape and unit of every key

Steps are lists of equal length under ``steps/``: ``observation/image/<camera>`` (PNG or JPEG),
``observation/state`` and ``action`` (all movable joints [rad or m], now and one step later),
``is_first``, ``is_last``, ``is_terminal``, ``reward`` (1 at the last step of a success),
``discount``, ``language_instruction``. Demonstrations of tasks also have ``observation/ee_pose``
(x, y, z, qw, qx, qy, qz of the grasp frame in the frame of the arm's base),
``observation/gripper``, ``action_gripper``, ``phase``, ``held``, ``contacts`` (separated by
commas, as ``contact_forces_n`` and ``contact_points_m``, which are ``x y z``), and of the whole
episode ``episode_metadata/{succeeded,failure,sequence}``, of twins ``recovered`` too. Vectors of
all steps follow one another.

``geometry`` adds PNG files of 16 bits, ``observation/{depth,instance}/<camera>``, and the arrays of
``lerobot`` by the same names without ``annotation.``, slashes for dots; ``metadata.json`` has the
shape of an array and the names of its columns, the unit of depths and the names of numbered
predicates.

Reference: Ramos et al., RLDS: an ecosystem to generate, share and use datasets in reinforcement
learning, 2021 (names and meaning of the keys of a step). ``tfds.builder_from_directory`` reads a
folder.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.exporters import base, fragments, lerobot, rlds_builder
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.sequences import Frame, write_json
from gen_data.exporters.step_geometry import OBJECTS, PREDICATES, Array, image_path, step_array
from gen_data.exporters.tfrecord import Feature, encode_example, encode_features, frame_record

FLOATS = {
    "steps/observation/state": "state",
    "steps/action": "action",
    "steps/observation/ee_pose": "observation.ee_pose",
    "steps/observation/gripper": "observation.gripper",
    "steps/action_gripper": "action.gripper",
}
TEXTS = {
    "steps/phase": "annotation.phase",
    "steps/held": "annotation.held",
    "steps/contacts": "annotation.contacts",
    "steps/contact_forces_n": "annotation.contact_forces_n",
    "steps/contact_points_m": "annotation.contact_points_m",
}
"""Keys of the record, and of the frame's line or its labels."""
_REWARDS = ("steps/reward", "steps/discount")
_INTEGERS = (
    "steps/is_first",
    "steps/is_last",
    "steps/is_terminal",
    "episode_metadata/succeeded",
    "episode_metadata/sequence",
)


class Rlds(lerobot.LeRobot):
    """RLDS-style TFRecord files of the episodes of one arm.

    Attributes:
        episodes_per_file: Episodes in each file except the last one of a split.
    """

    type: Literal["rlds"] = "rlds"  # type: ignore[assignment]
    conventions: ClassVar[Conventions] = Conventions(lens=ANY_LENS)
    episodes_per_file: int = Field(100, ge=1)

    def check(self, info: DatasetInfo) -> None:
        """Reject a data set that this format cannot represent; see ``LeRobot``.

        Raises:
            ConfigError: as there, or the CRC library is missing.
        """
        base.check_installed(self.type, "google_crc32c")
        super().check(info)

    def finalize(self, info: DatasetInfo, shard_dirs: Sequence[Path], dataset_dir: Path) -> None:
        """Write the episodes of all shards, and their keys."""
        totals = Counter(lerobot.data_set(episode[0].row) for episode in self._episodes(shard_dirs))
        written: Counter[tuple[str, str]] = Counter()
        sizes: Counter[tuple[str, str]] = Counter()
        arrays = self._arrays(shard_dirs)
        for episode in self._episodes(shard_dirs):
            key = lerobot.data_set(episode[0].row)
            folder = _folder(dataset_dir, key)
            folder.mkdir(parents=True, exist_ok=True)
            known = arrays.get(key, {})
            features = _features(info, episode, known)
            kinds = {_key(name): array for name, array in known.items()}
            if key not in written:
                facts = _describe(info, episode, features, kinds)
                write_json(folder / "metadata.json", facts)
                write_json(folder / "features.json", rlds_builder.features(facts))
            number = (written[key], totals[key], self.episodes_per_file)
            stem = fragments.numbered_stem("episodes", *number)
            floats = {*FLOATS, *_REWARDS, *(k for k, a in kinds.items() if a.dtype == "float32")}
            integers = (*_INTEGERS, *(k for k, a in kinds.items() if a.dtype == "int64"))
            record = frame_record(encode_example(encode_features(features, floats, integers)))
            with (folder / f"{stem}.tfrecord").open("ab") as file:
                file.write(record)
            written[key] += 1
            sizes[key] += len(record)
        for key, total in totals.items():
            counts = [
                min(self.episodes_per_file, total - k)
                for k in range(0, total, self.episodes_per_file)
            ]
            described = rlds_builder.dataset_info(key, counts, sizes[key])
            write_json(_folder(dataset_dir, key) / "dataset_info.json", described)


def _folder(dataset_dir: Path, key: tuple[str, str]) -> Path:
    return dataset_dir / key[0] / key[1].replace("/", "_")


def _key(name: str) -> str:
    """Key of the record for an array of geometry."""
    kind, _, camera = name.removeprefix("annotation.").partition(".")
    is_image = camera and kind in ("depth", "instance")
    return f"steps/{'observation/' if is_image else ''}{kind}{'/' if camera else ''}{camera}"


def _features(
    info: DatasetInfo, frames: Sequence[Frame], arrays: Mapping[str, Array]
) -> dict[str, Feature]:
    rows = [{**frame.row, **frame.row["labels"]} for frame in frames]
    first, last = rows[0], len(rows) - 1
    succeeded = bool(first.get("annotation.succeeded"))
    # An episode that a missing sample ends has not come to its success.
    rewarded = succeeded and rows[last]["step"] == info.steps_per_scene - 1
    features: dict[str, Feature] = {
        "steps/is_first": [int(k == 0) for k in range(len(rows))],
        "steps/is_last": [int(k == last) for k in range(len(rows))],
        "steps/is_terminal": [int(k == last and rewarded) for k in range(len(rows))],
        "steps/reward": [float(k == last and rewarded) for k in range(len(rows))],
        "steps/discount": [1.0] * len(rows),
        "steps/language_instruction": [row["task"].encode() for row in rows],
        "episode_metadata/sequence": [first["sequence"]],
        "episode_metadata/succeeded": [int(succeeded)],
        "episode_metadata/failure": [first.get("annotation.failure", "").encode()],
    }
    if "annotation.recovered" in first:
        features["episode_metadata/recovered"] = [first["annotation.recovered"].encode()]
    for key, name in FLOATS.items():
        if name in first:
            features[key] = [value for row in rows for value in _as_list(row[name])]
    for key, name in TEXTS.items():
        if name in first:
            features[key] = [row[name].encode() for row in rows]
    for camera in first["images"]:
        features[f"steps/observation/image/{camera}"] = [
            info.media_path(f.shard_dir, camera, Channel.RGB, f.index).read_bytes() for f in frames
        ]
    for name, array in arrays.items():
        if array.dtype == "uint16":
            paths = [image_path(info, name, frame) for frame in frames]
            features[_key(name)] = [path.read_bytes() for path in paths]
        else:
            steps = [step_array(info, name, array, frame).ravel() for frame in frames]
            features[_key(name)] = np.concatenate(steps).tolist()
    if OBJECTS in first.get("geometry", {}):
        features["steps/objects"] = [row["geometry"][OBJECTS].encode() for row in rows]
    return features


def _describe(
    info: DatasetInfo,
    episode: Sequence[Frame],
    features: Mapping[str, Feature],
    arrays: Mapping[str, Array],
) -> dict[str, Any]:
    """Type of every key, and length of its value in a step or in the episode.

    Images and arrays have a shape; numbers and texts have none.
    """
    first = episode[0].row
    lengths = {
        key: len(values) // (len(episode) if key.startswith("steps/") else 1)
        for key, values in features.items()
    }
    more: dict[str, dict[str, Any]] = {key: {"shape": [*a.shape]} for key, a in arrays.items()}
    for key, array in arrays.items():
        if array.names:
            more[key]["names"] = [*array.names]
    more |= {key: {"shape": [lengths[key]]} for key in FLOATS if key in lengths}
    for camera, sums in first["images"].items():
        more[f"steps/observation/image/{camera}"] = {"shape": [*reversed(sums["size_px"]), 3]}
    for key, facts in more.items():
        if key.startswith("steps/observation/depth/"):
            facts["unit_m"] = info.depth_scale_m
    if "steps/relation" in more:
        more["steps/relation"]["predicates"] = [*PREDICATES]
    kinds = dict.fromkeys((*FLOATS, *_REWARDS), "float32") | dict.fromkeys(_INTEGERS, "int64")
    kinds |= {key: a.dtype for key, a in arrays.items() if a.dtype != "uint16"}
    return {
        key: {"dtype": kinds.get(key, "bytes"), "length": length, **more.get(key, {})}
        for key, length in lengths.items()
    }


def _as_list(value: float | Sequence[float]) -> Sequence[float]:
    return value if isinstance(value, (list, tuple)) else [value]  # type: ignore[list-item]
