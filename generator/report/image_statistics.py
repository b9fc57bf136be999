"""Brightness and near-duplicates of the images of a data set.

Near-duplicates are found by perceptual hashes: the signs of the lowest frequencies of the discrete
cosine transform of a small grey image (C. Zauner, "Implementation and benchmarking of perceptual
image hash functions", 2010).
"""

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from gen_data.core.errors import StorageError

SIDE_PX = 32
"""Side of the grey image that is hashed."""
FREQUENCIES = 8
"""Frequencies along each axis that make the 64 bits of a hash."""
DISTANCE_MAX = 4
"""Largest number of different bits of near-duplicates."""
BANDS = 8
"""Parts of a hash; hashes with at most 7 different bits have an equal part."""
BATCH = 64
BLOCK = 4000
"""Number of hashes that are compared at once with all that have an equal part."""


@dataclass(frozen=True, slots=True)
class ImageFile:
    """An image of a data set, with the number of its scene."""

    index: int
    camera: str
    scene: int
    split: str
    path: Path


@dataclass(frozen=True, slots=True)
class Look:
    """Mean and standard deviation of an image's grey values in [0, 1], and its hash."""

    brightness: float
    contrast: float
    hash: int


@dataclass(frozen=True, slots=True)
class DuplicateGroup:
    """Images that look alike: each is a near-duplicate of another one of the group.

    Attributes:
        members: Positions of the images, ascending.
        scenes: Number of different scenes.
        splits: Names of the splits, sorted.
    """

    members: tuple[int, ...]
    scenes: int
    splits: tuple[str, ...]


def measure_images(files: Iterable[ImageFile], workers: int) -> Iterator[tuple[ImageFile, Look]]:
    """Measure images in threads, and yield them in their order; a few are in memory at a time.

    Raises:
        StorageError: an image cannot be read.
    """
    remaining = iter(files)
    with ThreadPoolExecutor(max(1, workers)) as pool:
        while batch := list(islice(remaining, BATCH)):
            yield from zip(batch, pool.map(_measure, batch), strict=True)


def _measure(file: ImageFile) -> Look:
    grey = cv2.imread(str(file.path), cv2.IMREAD_GRAYSCALE)
    if grey is None:
        raise StorageError(f"{file.path}: cannot be read as an image")
    return measure_look(np.asarray(grey, np.uint8))


def measure_look(grey: NDArray[np.uint8]) -> Look:
    """Brightness, contrast and hash of a grey image, uint8 [h, w]."""
    small = cv2.resize(grey, (SIDE_PX, SIDE_PX), interpolation=cv2.INTER_AREA)
    low = cv2.dct(small.astype(np.float32))[:FREQUENCIES, :FREQUENCIES].ravel()
    # The first coefficient is the brightness, which must not matter.
    bits = low > np.median(low[1:])
    value = int.from_bytes(np.packbits(bits).tobytes(), "big")
    return Look(float(grey.mean()) / 255.0, float(grey.std()) / 255.0, value)


def group_duplicates(files: Sequence[ImageFile], hashes: Sequence[int]) -> list[DuplicateGroup]:
    """Groups of near-duplicates from at least two scenes, largest first.

    Views and instants of one scene look alike by design and make no group by themselves.
    """
    unique, inverse = np.unique(np.asarray(hashes, np.uint64), return_inverse=True)
    parent = np.arange(len(unique))
    for a, b in _near_pairs(unique):
        _join(parent, a, b)
    roots = np.array([_root(parent, k) for k in range(len(unique))], np.intp)[inverse]
    order = np.argsort(roots, kind="stable")
    starts = np.flatnonzero(np.diff(roots[order], prepend=-1))
    groups = []
    for members in np.split(order, starts[1:]):
        shown = tuple(int(k) for k in members)
        scenes = {files[k].scene for k in shown}
        if len(scenes) > 1:
            splits = tuple(sorted({files[k].split for k in shown}))
            groups.append(DuplicateGroup(shown, len(scenes), splits))
    return sorted(groups, key=lambda group: (-len(group.members), group.members))


def _near_pairs(unique: NDArray[np.uint64]) -> Iterator[tuple[int, int]]:
    """Pairs of hashes at most ``DISTANCE_MAX`` bits apart, some of them repeatedly.

    Such hashes agree in at least one of the bands: only hashes with an equal band are compared.
    """
    width = 64 // BANDS
    for band in range(BANDS):
        part = (unique >> np.uint64(band * width)) & np.uint64((1 << width) - 1)
        order = np.argsort(part, kind="stable")
        starts = np.flatnonzero(np.diff(part[order].astype(np.int64), prepend=-1))
        for bucket in np.split(order, starts[1:]):
            yield from _pairs_in(unique, bucket)


def _pairs_in(unique: NDArray[np.uint64], bucket: NDArray[np.intp]) -> Iterator[tuple[int, int]]:
    for start in range(0, len(bucket), BLOCK):
        block = bucket[start : start + BLOCK]
        apart = np.bitwise_count(unique[block][:, None] ^ unique[bucket][None, :])
        for i, j in np.argwhere(apart <= DISTANCE_MAX).tolist():
            if block[i] < bucket[j]:
                yield int(block[i]), int(bucket[j])


def _root(parent: NDArray[np.intp], k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = int(parent[k])
    return k


def _join(parent: NDArray[np.intp], a: int, b: int) -> None:
    parent[_root(parent, a)] = _root(parent, b)
