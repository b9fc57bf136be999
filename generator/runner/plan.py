"""Plans: everything that the bytes of a data set depend on."""

import json
import shlex
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gen_data.core.errors import StorageError, no_folder
from gen_data.core.serialization import canonical_json, from_plain, to_plain
from gen_data.runner.durable_files import write_durably
from gen_data.runner.layout import PLAN_NAME

FORMAT_VERSION = 2
"""Version of the folder layout, the shard records and the manifest.

Since version 2, records have checksums, and records and manifest list empty folders.
"""
READABLE_VERSIONS = (1, FORMAT_VERSION)

DAMAGE = (OSError, ValueError, TypeError, LookupError, AttributeError, RecursionError)
"""Exceptions that reading a damaged JSON file into typed values may raise."""


@dataclass(frozen=True)
class Plan:
    """The identity of a data set: equal plans give equal bytes.

    Attributes:
        config: The resolved configuration as plain JSON values.
        n: Number of samples, >= 1.
        shard_size: Samples per shard, >= 1; the last shard may hold fewer.
        versions: ``{package: release}`` of everything that can change a byte.
        assets: ``{asset id: sha256}``.
        scenes_of: Id of the finished data set whose scenes were rendered again; empty for
            scenes that were generated.
    """

    config: Any
    name: str
    seed: int
    n: int
    shard_size: int
    versions: Mapping[str, str]
    assets: Mapping[str, str]
    format_version: int = FORMAT_VERSION
    scenes_of: str = ""

    def __post_init__(self) -> None:
        """Check the sizes."""
        if self.n < 1 or self.shard_size < 1:
            raise ValueError(f"n and shard_size must be >= 1, got {self.n} and {self.shard_size}")

    @property
    def shard_count(self) -> int:
        """Number of shards."""
        return -(-self.n // self.shard_size)

    def samples_of(self, shard: int) -> range:
        """Indices of the samples of a shard: ``[k * S, min(n, (k + 1) * S))``."""
        first = shard * self.shard_size
        return range(first, min(self.n, first + self.shard_size))


def plan_bytes(plan: Plan) -> bytes:
    """Contents of ``plan.json``: one line of canonical JSON."""
    return (canonical_json(plan) + "\n").encode()


def write_plan(plan: Plan, folder: Path, scratch: Path) -> None:
    """Write ``plan.json`` into the folder of a data set, atomically.

    ``scratch`` is a folder for the unfinished file, on the same file system.
    """
    write_durably(folder / PLAN_NAME, plan_bytes(plan), scratch)


def load_plan(folder: Path) -> Plan:
    """Read the plan of a data set. Raises StorageError if it is missing or damaged."""
    path = folder / PLAN_NAME
    try:
        data = path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        if not folder.exists():
            raise StorageError(no_folder(folder)) from None
        raise StorageError(f"{path}: missing; {folder} is not a gen-data data set") from None
    except OSError as error:
        raise StorageError(f"{path}: cannot be read ({error.strerror})") from None
    return parse_plan(data, folder)


def parse_plan(data: bytes, folder: Path) -> Plan:
    """Parse the contents of ``plan.json`` of the data set in ``folder``.

    Raises:
        StorageError: they are damaged.
    """
    try:
        plan = from_plain(Plan, json.loads(data))
        if plan.format_version not in READABLE_VERSIONS:
            raise ValueError(f"format version {plan.format_version}; expected {FORMAT_VERSION}")
        return plan
    except DAMAGE as error:
        raise StorageError(
            f"{folder / PLAN_NAME}: damaged, or written by another version of gen-data ({error}); "
            "nothing was changed.\n  This command restores it:\n"
            f"    gen-data repair {shlex.quote(str(folder))}"
        ) from None


def compare_plans(old: Plan, new: Plan) -> list[str]:
    """Differences, one line per field: ``camera.fov_deg: was 50, now 60``; empty if equal.

    Fields of the configuration are named as in YAML, all others as in Plan.
    """
    was, now = to_plain(old), to_plain(new)
    configs = differences("", was.pop("config"), now.pop("config"))
    # The seed is part of both, under the same name.
    return list(dict.fromkeys((*configs, *differences("", was, now))))


def differences(place: str, was: Any, now: Any) -> Iterator[str]:
    """Differences of two plain JSON values at ``place``, one line per field."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in sorted({*was, *now}):
            inner = f"{place}.{key}" if place else str(key)
            yield from differences(inner, was.get(key, _ABSENT), now.get(key, _ABSENT))
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        for i, (left, right) in enumerate(zip(was, now, strict=True)):
            yield from differences(f"{place}[{i}]", left, right)
    elif canonical_json(was) != canonical_json(now):
        yield f"{place}: was {_format(was)}, now {_format(now)}"


_ABSENT = "(absent)"


def _format(value: Any, most: int = 120) -> str:
    text = value if value is _ABSENT else canonical_json(value)
    return text if len(text) <= most else text[: most - 3] + "..."
