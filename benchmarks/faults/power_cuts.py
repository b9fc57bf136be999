"""Power cuts of real file systems: a loop device is shut down without writing its log."""

import fcntl
import os
import random
import shutil
import signal
import struct
import subprocess
import time
from pathlib import Path

from benchmarks.faults import children, recorded_run, results

GOINGDOWN = 0x8004587D
"""``FS_IOC_GOINGDOWN`` of Linux's ``include/uapi/linux/fs.h`` (``XFS_IOC_GOINGDOWN`` before)."""
NO_LOG_FLUSH = 2
SIZES_MB = {"ext4": 64, "xfs": 320}
"""``mkfs.xfs`` refuses less than 300 MB."""
RUN_S = 0.2
"""Cuts are drawn from this duration; a run takes about as long."""


def power_cuts(scale: results.Scale, folder: Path) -> results.Result:
    """Cut the power of ext4 and xfs at random instants of a run, mount again, and resume."""
    result = results.Result()
    rng = random.Random(scale.seed)
    digest = recorded_run.reference_digest(folder)
    for kind, size_mb in SIZES_MB.items():
        reason = _find_obstacle(kind, folder)
        if reason:
            result.skip(kind, reason)
            continue
        disk = _Disk(kind, size_mb, folder)
        cuts, finished = scale.pick(100, 2), 0
        for number in result.until_end(scale, range(cuts)):
            problem, was_finished = disk.survive(rng.uniform(0.0, RUN_S), digest)
            finished += was_finished
            result.add(not problem, f"{kind}, cut {number}: {problem}")
        result.notes.append(f"{kind}: {finished} cuts after the seal")
    return result


def _find_obstacle(kind: str, folder: Path) -> str:
    """Why a file system cannot be mounted here; empty if it can."""
    if os.geteuid() != 0:
        return "mounting needs root"
    if shutil.which(f"mkfs.{kind}") is None:
        return f"mkfs.{kind} is not installed"
    try:
        disk = _Disk(kind, SIZES_MB[kind], folder)
        disk.format()
        disk.mount()
        disk.unmount()
    except subprocess.CalledProcessError as error:
        return f"{error.cmd[0]}: {error.stderr.strip()[:80]}"
    return ""


class _Disk:
    """A file system in a file, mounted below a folder."""

    def __init__(self, kind: str, size_mb: int, folder: Path) -> None:
        self._kind = kind
        self._image = folder / f"{kind}.img"
        self._size_bytes = size_mb << 20
        self._root = folder / kind
        self._root.mkdir(exist_ok=True)

    def format(self) -> None:
        self._image.unlink(missing_ok=True)
        with self._image.open("wb") as file:
            file.truncate(self._size_bytes)
        _call(f"mkfs.{self._kind}", "-q", str(self._image))

    def mount(self) -> None:
        _call("mount", "-t", self._kind, "-o", "loop", str(self._image), str(self._root))

    def unmount(self) -> None:
        _call("umount", str(self._root))

    def survive(self, instant_s: float, digest: str) -> tuple[str, bool]:
        """The fault after a cut at an instant if any, and whether the data set was finished."""
        self.format()
        self.mount()
        out, message = self._root / "out", self._image.with_suffix(".message")
        try:
            pid = children.fork_run(out, message)
            time.sleep(instant_s)
            self._cut_power()
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            message.unlink(missing_ok=True)
            self.unmount()
            self.mount()
            finished = (out / "manifest.json").exists()
            if finished:
                equal = recorded_run.tree_digest(out) == digest
                return ("" if equal else "a finished data set has other bytes"), True
            return recorded_run.resumes_to(out, digest), False
        finally:
            self.unmount()

    def _cut_power(self) -> None:
        descriptor = os.open(self._root, os.O_RDONLY)
        try:
            fcntl.ioctl(descriptor, GOINGDOWN, struct.pack("I", NO_LOG_FLUSH))
        finally:
            os.close(descriptor)


def _call(*arguments: str) -> None:
    subprocess.run(arguments, check=True, capture_output=True, text=True)
