"""Events from workers to the supervisor and actions of the supervisor: plain, picklable data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from gen_data.core.errors import GenDataError
from gen_data.runner.failed_sample import FailedSample


@dataclass(frozen=True, slots=True)
class Queued:
    """A worker waits for a machine, as on a cluster that is full or still growing."""

    worker: int


@dataclass(frozen=True, slots=True)
class Ready:
    """The engines of a worker have started; it waits for a shard.

    Attributes:
        warnings: Texts for the user.
    """

    worker: int
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class SampleDone:
    """A sample was generated and its images written; also the sign of life of a worker."""

    worker: int
    shard: int
    index: int
    timings_s: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SampleSkipped:
    """A sample could not be made, and its shard goes on without it.

    Attributes:
        text: The whole error, for the log.
    """

    worker: int
    shard: int
    failure: FailedSample
    text: str


@dataclass(frozen=True, slots=True)
class ShardDone:
    """A shard is committed.

    Attributes:
        bytes: Size of its files.
        record_sha256: SHA-256 of its record; empty = unknown.
        rss_bytes: Memory of the worker's process, 0 if unknown.
        timings_s: CPU seconds of the shard as a whole, by stage.
        failed: Samples that it does not have.
        labels_sha256: SHA-256 of its labels; empty = unknown.
    """

    worker: int
    shard: int
    samples: int
    bytes: int
    rejections: int
    rss_bytes: int = 0
    timings_s: Mapping[str, float] = field(default_factory=dict)
    record_sha256: str = ""
    failed: tuple[FailedSample, ...] = ()
    labels_sha256: str = ""


@dataclass(frozen=True, slots=True)
class Failed:
    """A worker exits because of an error that would recur."""

    worker: int
    error: GenDataError


@dataclass(frozen=True, slots=True)
class Exited:
    """The process of a worker has ended.

    Attributes:
        exit_code: As of ``subprocess``: negative = killed by that signal.
        out_of_memory: The kernel killed some process for lack of memory at that time.
        cause: Description of its end where there is no exit code, as on another machine.
        machine_lost: Its machine is gone: its shard is not to blame.
    """

    worker: int
    exit_code: int
    out_of_memory: bool = False
    cause: str = ""
    machine_lost: bool = False


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed."""


@dataclass(frozen=True, slots=True)
class Abort:
    """Stop everything at once because of an error."""

    error: GenDataError


Event: TypeAlias = (
    Queued | Ready | SampleDone | SampleSkipped | ShardDone | Failed | Exited | Tick | Abort
)


@dataclass(frozen=True, slots=True)
class Spawn:
    """Start a process with this worker number."""

    worker: int


@dataclass(frozen=True, slots=True)
class Assign:
    """Let an idle worker generate a shard, without the samples that crashed or hung before."""

    worker: int
    shard: int
    failed: tuple[FailedSample, ...] = ()


@dataclass(frozen=True, slots=True)
class Dismiss:
    """Let an idle worker exit."""

    worker: int


@dataclass(frozen=True, slots=True)
class Kill:
    """Kill a process."""

    worker: int


@dataclass(frozen=True, slots=True)
class Note:
    """A line for the log."""

    text: str


Action: TypeAlias = Spawn | Assign | Dismiss | Kill | Note
