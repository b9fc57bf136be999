"""Every error a user can meet, each with the exit code of the process."""

import difflib
import errno
import math
import re
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any


class GenDataError(Exception):
    """Base of all errors that are shown to a user as one message, without a traceback."""

    exit_code = 1


class ConfigError(GenDataError):
    """The configuration or the command line is wrong."""

    exit_code = 2


class UnknownNameError(ConfigError, KeyError):
    """A sensor, channel or other part of a sample that does not exist, asked for by its name."""

    # KeyError shows the representation of its message, quotes and all.
    __str__ = Exception.__str__


class SampleIndexError(ConfigError, IndexError):
    """The index of a sample that the data set does not have."""


class IndexKindError(ConfigError, TypeError):
    """An index of samples that is not a whole number."""


class ConfigWarning(UserWarning):
    """A configuration is valid, but probably not meant like this."""


class CacheWarning(UserWarning):
    """A cache was damaged and repaired."""


class AssetWarning(UserWarning):
    """A file of the user holds something that is not used, or used otherwise."""


class AssetError(GenDataError):
    """An asset is missing, unreadable or unfit.

    Attributes:
        asset_id: As the user wrote it, if the id is wrong; else empty.
    """

    exit_code = 3

    def __init__(self, message: str, asset_id: str = "") -> None:
        self.asset_id = asset_id
        super().__init__(message)


class UnknownAsset(AssetError):
    """An id names no asset."""


class StorageError(GenDataError):
    """The output folder cannot be written or does not belong to this run."""

    exit_code = 4


class DeterminismError(GenDataError):
    """The same work produced different bytes."""

    exit_code = 5


class NumericsError(DeterminismError):
    """A machine or a worker process computes differently from the one that began the data set."""


class SampleError(GenDataError):
    """A sample cannot be made."""

    exit_code = 6


@contextmanager
def in_stage(stage: str) -> Iterator[None]:
    """Let an error of the block remember its stage; the innermost block counts."""
    try:
        yield
    except BaseException as error:
        if not hasattr(error, "stage"):
            error.stage = stage  # type: ignore[attr-defined]
        raise


def stage_of(error: BaseException) -> str:
    """Stage of an error or of its cause; ``sample`` if there is none."""
    cause: BaseException | None = error
    while cause is not None:
        if stage := getattr(cause, "stage", ""):
            return str(stage)
        cause = cause.__cause__
    return "sample"


class OutOfMemory(SampleError):
    """A process got no more memory from the system, or from a GPU."""


def lack_of_memory(error: BaseException) -> str:
    """Description of a lack of memory and its remedy, if that caused an error; else empty.

    Also where a library could not be loaded.
    """
    cause: BaseException | None = error
    while cause is not None:
        if _NO_MEMORY_ON_GPU.search(str(cause)):
            return (
                "out of memory: the GPU has no more for this process; use fewer --workers, which "
                "share it (about 2.5 GB each), smaller images, or --set render.device=cpu"
            )
        if (
            isinstance(cause, MemoryError)
            or getattr(cause, "errno", None) == errno.ENOMEM
            or any(text in str(cause) for text in _NO_MEMORY)
        ):
            return (
                "out of memory: the system refused more memory to this process; raise its limit "
                "(ulimit -v), or use smaller images and --workers 1"
            )
        cause = cause.__cause__ or cause.__context__
    return ""


_NO_MEMORY = (
    "failed to map segment from shared object",
    "Cannot allocate memory",
    "bytes on device 'cpu'",
)
"""Texts of the dynamic loader, of the C library and of Warp."""
_NO_MEMORY_ON_GPU = re.compile(r"Failed to allocate .* on device 'cuda|CUDA error 2\b")
"""Texts of Warp; 2 is cudaErrorMemoryAllocation."""


def is_refused(error: BaseException) -> bool:
    """Whether the file system, not the data, caused an error: full, read-only, not to be read."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, OSError) and cause.errno in _REFUSALS:
            return True
        cause = cause.__cause__ or cause.__context__
    return False


_REFUSALS = frozenset(
    getattr(errno, name)
    for name in (
        *("ENOSPC", "EDQUOT", "EROFS", "EACCES", "EPERM", "EIO", "ESTALE"),
        *("EMFILE", "ENFILE", "ENOLCK", "ENOTCONN", "ETIMEDOUT"),
    )
    if hasattr(errno, name)
)


class WorkerLost(SampleError):
    """A worker process died repeatedly on the same shard."""


class VerificationError(GenDataError):
    """A data set differs from its manifest."""

    exit_code = 7


class CertificationError(GenDataError):
    """A claim about a data set does not hold."""

    exit_code = 8


class NoLabels(GenDataError):
    """A finished data set was to have labels, and has none.

    Attributes:
        summary: Summary of the run that finished it; see ``generate``.
    """

    exit_code = 9

    def __init__(self, message: str, summary: Any = None) -> None:
        self.summary = summary
        super().__init__(message)


class SamplesSkipped(GenDataError):
    """A data set is finished, without the samples that could not be made."""

    exit_code = 10


class Interrupted(GenDataError):
    """The user interrupted the run; committed samples stay and the run can be resumed."""

    exit_code = 130


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why one attempt at a scene was refused, and how a user can avoid it.

    Attributes:
        reason: A short noun phrase that equal rejections share, such as ``object fell off``.
        remedy: The change to make, naming a field of the configuration.
        detail: The objects concerned and by how much; empty = unknown.
        excess: How far from valid, in the unit of the reason, to compare rejections of one scene.
    """

    reason: str
    remedy: str
    detail: str = ""
    excess: float = math.inf


class LayoutRejected(Exception):
    """A randomizer found no valid draw; the scene is tried again with the next attempt's streams.

    Never reaches a user: the pipeline counts it among the attempts of a scene.
    """

    def __init__(self, rejection: Rejection) -> None:
        self.rejection = rejection
        super().__init__(rejection.reason)


class SceneRejected(SampleError):
    """No valid layout of a scene was found within the bounded number of attempts."""

    stage = "layout"

    def __init__(self, scene_index: int, rejections: tuple[Rejection, ...]) -> None:
        self.scene_index = scene_index
        self.rejections = rejections
        counts: dict[str, int] = {}
        remedies: dict[str, None] = {}
        for rejection in rejections:
            counts[rejection.reason] = counts.get(rejection.reason, 0) + 1
            remedies[rejection.remedy] = None
        tally = ", ".join(f"{count} x {reason}" for reason, count in counts.items())
        detailed = [(r.excess, number) for number, r in enumerate(rejections) if r.detail]
        best = ""
        if detailed:
            _, number = min(detailed)
            best = f"\n  Best: attempt {number + 1}: {rejections[number].detail}."
        tries = " ".join(f"{i}. {remedy}" for i, remedy in enumerate(remedies, 1))
        super().__init__(
            f"scene {scene_index}: no valid layout in {len(rejections)} attempts ({tally}).{best}\n"
            f"  Try: {tries}"
        )

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle by the constructor's arguments, to cross process borders."""
        return (type(self), (self.scene_index, self.rejections))


class Refusals:
    """Errors of several checks, reported together for a user to correct all at once."""

    def __init__(self) -> None:
        self._errors: dict[str, ConfigError] = {}

    def add(self, error: ConfigError) -> None:
        """Add an error, unless there is one with the same text."""
        self._errors.setdefault(str(error), error)

    @contextmanager
    def collected(self) -> Iterator[None]:
        """Add the ConfigError of a block."""
        try:
            yield
        except ConfigError as error:
            self.add(error)

    def raise_if_any(self) -> None:
        """Raise the only error, or a ConfigError with the texts of all."""
        if len(self._errors) > 1:
            raise ConfigError("\n".join(self._errors))
        for error in self._errors.values():
            raise error


def list_names(names: Collection[str], most: int = 12) -> str:
    """Names with commas, and how many there are beyond ``most``."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(list(names)[:most]) + more


def did_you_mean(wrong: str, known: Iterable[str]) -> str:
    """`` (did you mean 'x'?)`` when something known is near, else the empty string.

    Endings of files, such as ``.yaml``, make no names similar. A name in another case is nearest.
    """
    stems = {name.removesuffix(".yaml"): name for name in known}
    same = (name for name in stems.values() if name.casefold() == wrong.casefold())
    for name in same:
        return f" (did you mean '{name}'?)"
    near = difflib.get_close_matches(wrong.removesuffix(".yaml"), stems, n=1, cutoff=0.6)
    return f" (did you mean '{stems[near[0]]}'?)" if near else ""


def one_of(wrong: str, known: Collection[str], most: int = 12) -> str:
    """``expected one of a, b (did you mean 'a'?)``; of more than ``most`` the nearest five."""
    if not known:
        return "there are none"
    if len(known) <= most:
        return f"expected one of {', '.join(known)}{did_you_mean(wrong, known)}"
    near = difflib.get_close_matches(wrong, known, n=5, cutoff=0.0)
    some = f"expected one of {len(known)} names, such as {', '.join(near)}"
    return f"{some}{did_you_mean(wrong, known)}"


def no_folder(folder: Path) -> str:
    """``there is no folder 'x' (did you mean 'y'?)``, from the names in the same folder."""
    try:
        beside = [path.name for path in folder.parent.iterdir() if path.is_dir()]
    except OSError:
        beside = []
    return f"there is no folder '{folder}'{did_you_mean(folder.name, sorted(beside))}"
