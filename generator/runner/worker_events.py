"""Events from workers to the supervisor and actions of the supervisor: plain, picklable data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from gen_data.generator.core.errors import GenDataError


@dataclass(frozen=True, slots=True)
class Ready:
    """A worker's engines are up; it waits for a shard."""

    worker: int


@dataclass(frozen=True, slots=True)
class SampleDone:
    """One sample was made and its images are written. Also the sign of life."""

    worker: int
    shard: int
    index: int
    timings_s: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class ShardDone:
    """A shard is committed.

    Attributes:
        bytes: Size of its files.
        rss_bytes: Memory of the worker's process, 0 if unknown.
        timings_s: CPU seconds of the shard as a whole, by stage.
    """

    worker: int
    shard: int
    samples: int
    bytes: int
    rejections: int
    rss_bytes: int = 0
    timings_s: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Failed:
    """A worker met an error that another attempt would meet again; it ends now."""

    worker: int
    error: GenDataError


@dataclass(frozen=True, slots=True)
class Exited:
    """A worker's process is gone.

    Attributes:
        exit_code: As ``multiprocessing`` has it: negative = killed by that signal.
        out_of_memory: The kernel killed some process for want of memory at that time.
    """

    worker: int
    exit_code: int
    out_of_memory: bool = False


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed."""


@dataclass(frozen=True, slots=True)
class Abort:
    """Stop everything at once, for this reason."""

    error: GenDataError


Event: TypeAlias = Ready | SampleDone | ShardDone | Failed | Exited | Tick | Abort


@dataclass(frozen=True, slots=True)
class Spawn:
    """Start a process under this number."""

    worker: int


@dataclass(frozen=True, slots=True)
class Assign:
    """Let a ready worker make a shard."""

    worker: int
    shard: int


@dataclass(frozen=True, slots=True)
class Dismiss:
    """Let an idle worker end by itself."""

    worker: int


@dataclass(frozen=True, slots=True)
class Kill:
    """End a process now."""

    worker: int


@dataclass(frozen=True, slots=True)
class Note:
    """Something a user may want to know; for the log."""

    text: str


Action: TypeAlias = Spawn | Assign | Dismiss | Kill | Note
