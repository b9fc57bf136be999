"""Free space on the disk: whether a data set fits, before its first shard and after each one."""

import errno
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

from gen_data.core.errors import StorageError
from gen_data.runner.durable_files import format_bytes

if TYPE_CHECKING:
    from gen_data.runner.store import LocalStore

MARGIN = 1.05
DOCUMENTS_BYTES = 192 << 10
"""Card, metadata, licences, sums, manifest and one record, of a data set of few samples."""
RESERVE_BYTES = 64 << 10
"""Space that stays free, for the log of the run and the message about its end."""


@dataclass(frozen=True)
class SpaceCheck:
    """Compares the need of the missing samples with the free space.

    Attributes:
        estimate_bytes: Size of a sample, estimated from the configuration; 0 = unknown.
        is_forced: Whether only a full disk stops the run.
        fixed_bytes: Size of the files whose number does not depend on the number of samples.
        linked_bytes: Size of a sample's files that are hard links and take no space.
    """

    store: "LocalStore"
    estimate_bytes: float = 0.0
    is_forced: bool = False
    linked_bytes: float = 0.0
    fixed_bytes: float = 0.0

    def before_start(self, samples: int) -> None:
        """Refuse a data set of this many samples that will not fit.

        Raises:
            StorageError: with the need, and all remedies.
        """
        need = self.estimate_bytes * samples + self.fixed_bytes
        if self.is_forced or self.estimate_bytes == 0.0 or samples == 0:
            return
        free = self._free_bytes()
        if free < MARGIN * need + RESERVE_BYTES:
            raise StorageError(
                f"{self.store.root}: {samples} samples need about {format_bytes(need)} and "
                f"{format_bytes(free)} are free; expected {format_bytes(MARGIN * need)} or more.\n"
                "  Make room, choose a folder on another disk with --out, reduce --n, or generate "
                "until the disk is full with --force."
            ) from full_disk()

    def after_shard(self, sample_bytes: float, samples: int) -> StorageError | None:
        """Error if the other samples will not fit, with the measured size of a sample."""
        new_bytes = max(0.0, sample_bytes - self.linked_bytes) * samples
        need = 0.0 if self.is_forced else MARGIN * new_bytes
        free = self._free_bytes()
        if free >= need + RESERVE_BYTES or samples == 0:
            return None
        command = self.store.resume_command
        advice = f"\n  After making room, resume with:\n    {command}" if command else ""
        error = StorageError(
            f"{self.store.root}: the other {samples} samples need about "
            f"{format_bytes(new_bytes)} and {format_bytes(free)} are free; stopped "
            f"before the disk is full.{advice}"
        )
        error.__cause__ = full_disk()
        return error

    def _free_bytes(self) -> int:
        with self.store.errors():
            return self.store.free_bytes()


def full_disk() -> OSError:
    """The error that the disk would have given."""
    return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
