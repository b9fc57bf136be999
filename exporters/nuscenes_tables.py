"""Tables of nuScenes: files, tokens, and the rows that no sequence has.

Tokens are hashes of the content's identity (data set, sequence, instant, sensor or object):
the same data set has the same tokens, whatever the shards.
"""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from gen_data.core.interfaces import DatasetInfo
from gen_data.core.serialization import canonical_json
from gen_data.exporters import nuscenes_classes, sequences

TABLES = (
    "attribute",
    "calibrated_sensor",
    "category",
    "ego_pose",
    "instance",
    "lidarseg",
    "log",
    "map",
    "panoptic",
    "sample",
    "sample_annotation",
    "sample_data",
    "scene",
    "sensor",
    "visibility",
)
VISIBILITIES = {"1": "v0-40", "2": "v40-60", "3": "v60-80", "4": "v80-100"}
DAY = "2020-01-01"
"""Of all recordings; see ``nuscenes_recording.START_US``."""

Row = dict[str, Any]


class TableFiles(AbstractContextManager["TableFiles"]):
    """JSON files of all tables, written row by row."""

    def __init__(self, folder: Path) -> None:
        """Prepare the files of a folder."""
        self._folder = folder
        self._stack = ExitStack()
        self._files: dict[str, TextIO] = {}
        self._empty = set(TABLES)
        self._calibrations: set[str] = set()

    def __enter__(self) -> "TableFiles":
        """Create the folder and all files."""
        self._folder.mkdir(parents=True, exist_ok=True)
        for name in TABLES:
            path = self._folder / f"{name}.json"
            file = path.open("w", encoding="utf-8", newline="\n")
            self._files[name] = self._stack.enter_context(file)
            file.write("[")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Complete and close all files."""
        for file in self._files.values():
            file.write("\n]\n")
        self._stack.close()

    def add(self, table: str, row: Row) -> None:
        """Write a row; a calibration that already has a row is skipped."""
        if table == "calibrated_sensor":
            if row["token"] in self._calibrations:
                return
            self._calibrations.add(row["token"])
        self._files[table].write(("\n" if table in self._empty else ",\n") + canonical_json(row))
        self._empty.discard(table)


@dataclass(frozen=True)
class Tokens:
    """Tokens of a data set."""

    info: DatasetInfo

    def __call__(self, table: str, *identity: object) -> str:
        """Token of a row, 32 hexadecimal digits."""
        parts = (self.info.name, self.info.seed, table, *identity)
        return hashlib.sha256(canonical_json(parts).encode()).hexdigest()[:32]


def constant_rows(token: Tokens, channels: Mapping[str, str]) -> Iterator[tuple[str, Row]]:
    """Rows of the tables that do not depend on samples.

    Args:
        token: Tokens of the data set.
        channels: Modality by channel.
    """
    for index, (name, description) in enumerate(nuscenes_classes.classes().categories):
        key = token("category", name)
        row = {"token": key, "name": name, "description": description, "index": index}
        yield "category", row
    for name, description in nuscenes_classes.classes().attributes.items():
        yield (
            "attribute",
            {"token": token("attribute", name), "name": name, "description": description},
        )
    for key, level in VISIBILITIES.items():
        low, high = level[1:].split("-")
        text = f"between {low} % and {high} % of the object are visible in all images together"
        yield "visibility", {"token": key, "level": level, "description": text}
    for name, modality in channels.items():
        yield ("sensor", {"token": token("sensor", name), "channel": name, "modality": modality})


def world_rows(token: Tokens, frame: sequences.Frame, map_file: str) -> Iterator[tuple[str, Row]]:
    """Rows of the log and of the map of a world."""
    world = frame.row["scene"]
    log = {
        "token": token("log", world),
        "logfile": f"{token.info.name}-{world:06d}",
        "vehicle": frame.row["vehicle"],
        "date_captured": DAY,
        "location": f"{token.info.name}-{world:06d}",
        "world_origin": frame.row["world_origin"],
    }
    yield "log", log
    yield (
        "map",
        {
            "token": token("map", world),
            "log_tokens": [log["token"]],
            "category": "semantic_prior",
            "filename": map_file,
        },
    )


def write_splits(folder: Path, names: Mapping[str, Sequence[str]]) -> None:
    """Write the scenes of each split, and of ``all``, as the devkit reads custom splits."""
    sequences.write_json(folder / "splits.json", names)
