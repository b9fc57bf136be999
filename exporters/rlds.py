"""RLDS-style episodes of a robot arm: one ``tf.train.Example`` per episode in TFRecord files.

::

    <split>/<robot>/
        episodes-00000-of-00002.tfrecord    one record per episode
        features.json                       type and shape of every key

Steps are lists of equal length under ``steps/``: ``observation/image/<camera>`` (PNG or JPEG),
``observation/state`` and ``action`` (all movable joints [rad or m], now and one step later),
``is_first``, ``is_last``, ``is_terminal``, ``reward`` (1 at the last step of a success),
``discount``, ``language_instruction``. Demonstrations of tasks also have ``observation/ee_pose``
(x, y, z, qw, qx, qy, qz of the grasp frame in the frame of the arm's base),
``observation/gripper``, ``action_gripper``, ``phase``, ``held``, ``contacts`` (separated by
commas, as ``contact_forces_n`` and ``contact_points_m``, which are ``x y z``), and of the whole
episode ``episode_metadata/{succeeded,failure,sequence}``. Vectors of all
steps follow one another.

Reference: Ramos et al., RLDS: an ecosystem to generate, share and use datasets in reinforcement
learning, 2021 (names and meaning of the keys of a step). Reading takes ``tf.io.parse_example``; the
files of TensorFlow Datasets that describe a builder are not written.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import Field

from gen_data.core.capture import Channel
from gen_data.core.interfaces import DatasetInfo
from gen_data.core.serialization import canonical_json
from gen_data.exporters import base, fragments, lerobot
from gen_data.exporters.conventions import ANY_LENS, Conventions
from gen_data.exporters.sequences import FRAMES, Frame, unbroken_episodes, write_text
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
        totals = Counter(_data_set(episode) for episode in self._episodes(shard_dirs))
        written: Counter[tuple[str, str]] = Counter()
        for episode in self._episodes(shard_dirs):
            key = _data_set(episode)
            folder = dataset_dir / key[0] / key[1].replace("/", "_")
            folder.mkdir(parents=True, exist_ok=True)
            features = _features(info, episode)
            if key not in written:
                facts = _describe(features, len(episode))
                write_text(folder / "features.json", canonical_json(facts) + "\n")
            number = (written[key], totals[key], self.episodes_per_file)
            stem = fragments.numbered_stem("episodes", *number)
            floats = {*FLOATS, *_REWARDS}
            record = frame_record(encode_example(encode_features(features, floats, _INTEGERS)))
            with (folder / f"{stem}.tfrecord").open("ab") as file:
                file.write(record)
            written[key] += 1

    def _episodes(self, shard_dirs: Sequence[Path]) -> Iterator[list[Frame]]:
        rows = fragments.fragment_rows(shard_dirs, self.type, FRAMES)
        return unbroken_episodes(Frame(shard_dir, row) for shard_dir, row in rows)


def _data_set(episode: Sequence[Frame]) -> tuple[str, str]:
    row = episode[0].row
    return row["split"], row["robot"]


def _features(info: DatasetInfo, frames: Sequence[Frame]) -> dict[str, Feature]:
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
    return features


def _describe(features: Mapping[str, Feature], steps: int) -> dict[str, Any]:
    """Type of every key, and length of its value in a step or in the episode."""
    kinds = dict.fromkeys((*FLOATS, *_REWARDS), "float32") | dict.fromkeys(_INTEGERS, "int64")
    return {
        key: {
            "dtype": kinds.get(key, "bytes"),
            "length": len(values) // (steps if key.startswith("steps/") else 1),
        }
        for key, values in features.items()
    }


def _as_list(value: float | Sequence[float]) -> Sequence[float]:
    return value if isinstance(value, (list, tuple)) else [value]  # type: ignore[list-item]
