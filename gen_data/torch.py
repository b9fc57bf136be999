"""PyTorch: data sets, loaders and tensors of samples; the only module that imports torch.

>>> import gen_data, gen_data.torch
>>> data = gen_data.Dataset("tabletop.yaml", split="train", n=10_000)  # or gen_data.open(folder)
>>> for images, targets in gen_data.torch.loader(data, batch_size=8, shuffle=True, workers=2):
...     losses = model(images, targets)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import torch
from torch.utils.data import Dataset, IterableDataset, get_worker_info

from gen_data.api.dataset import SampleSequence
from gen_data.api.loader import Loader
from gen_data.api.sample import Sample
from gen_data.core.errors import ConfigError
from gen_data.targets import detection_target

__all__ = [
    "SampleDataset",
    "SampleStream",
    "collate",
    "loader",
    "object_rows",
    "to_tensors",
    "to_tv_tensors",
]

Target = Callable[[Sample], Any]


class SampleDataset(Dataset[Any]):
    """Map-style data set of targets, for ``torch.utils.data.DataLoader``.

    Args:
        samples: A ``Dataset`` with ``n``, or a finished one.
        target: Function from a Sample to arrays, such as one of ``gen_data.targets``.
        transform: Called with the tensors.

    Warns:
        ConfigWarning: samples of several splits are mixed; ``data.split("train")`` selects one.
    """

    def __init__(
        self,
        samples: SampleSequence,
        target: Target = detection_target,
        transform: Callable[[Any], Any] | None = None,
    ) -> None:
        samples.warn_of_mixed_splits()
        self.samples, self.target, self.transform = samples, target, transform

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.samples)

    def __getitem__(self, index: int) -> Any:
        """The tensors of one sample."""
        tensors = to_tensors(self.target(self.samples[index]))
        return tensors if self.transform is None else self.transform(tensors)


class SampleStream(IterableDataset[Any]):
    """Iterable data set over a Loader, which has its own workers.

    Give it to a ``DataLoader`` with ``batch_size=None`` and ``num_workers=0``, or iterate over it.
    ``state_dict`` and ``load_state_dict`` resume in the middle of an epoch.
    """

    def __init__(self, source: Loader[Any]) -> None:
        self.source = source

    def __iter__(self) -> Iterator[Any]:
        """Batches of one epoch.

        Raises:
            ConfigError: workers of a ``DataLoader`` iterate: each would yield the whole epoch, the
                same one every time.
        """
        if get_worker_info() is not None:
            raise ConfigError(
                "num_workers: a SampleStream has its own workers; expected 0, and `workers` of the "
                "Loader instead"
            )
        for batch in self.source:
            yield collate([to_tensors(item) for item in batch])

    def __len__(self) -> int:
        """Batches of an epoch."""
        return len(self.source)

    def state_dict(self) -> dict[str, int]:
        """See ``Loader``."""
        return self.source.state_dict()

    def load_state_dict(self, state: dict[str, int]) -> None:
        """See ``Loader``."""
        self.source.load_state_dict(state)


def loader(
    samples: SampleSequence, target: Target = detection_target, **options: Any
) -> SampleStream:
    """Batches of tensors, epoch after epoch; ``options`` as for ``gen_data.Loader``."""
    return SampleStream(Loader(samples, target, **options))


def to_tensors(value: Any) -> Any:
    """Tensors for all arrays in nested tuples, lists and mappings; they share the memory."""
    if isinstance(value, np.ndarray):
        # Tensors need writable memory of the machine's byte order.
        return torch.from_numpy(value if value.flags.writeable else value.copy())
    if isinstance(value, Mapping):
        return {name: to_tensors(item) for name, item in value.items()}
    if isinstance(value, (tuple, list)):
        return type(value)(to_tensors(item) for item in value)
    return value


def collate(batch: list[Any]) -> Any:
    """Collate targets: tuples become tuples of lists, as torchvision's detectors take them.

    Tensors of equal shape are not stacked, because images of a batch may differ in size; use
    ``torch.stack``.
    """
    if batch and isinstance(batch[0], tuple):
        return tuple(list(column) for column in zip(*batch, strict=True))
    return batch


def to_tv_tensors(pair: tuple[torch.Tensor, dict[str, torch.Tensor]]) -> tuple[Any, dict[str, Any]]:
    """Wrap an image and its target for torchvision's transforms v2, which then move them together.

    Args:
        pair: Tensors of ``detection_target``, ``segmentation_target`` or ``keypoint_target``.

    Returns:
        ``Image`` and the target with ``BoundingBoxes``, ``Mask`` and ``KeyPoints`` [n, k, 2]
        (torchvision 0.23); ``keypoint_visibility`` [n, k] has COCO's visibility of keypoints.
        Mirroring keeps the names of left and right points. torchvision's flips (0.28) move
        keypoints one pixel too far to the left, or up, against image and boxes: add 1 after one.
    """
    from torchvision import tv_tensors

    image, target = pair
    height, width = image.shape[-2:]
    canvas_size = int(height), int(width)
    wrapped: dict[str, Any] = dict(target)
    wrapped["boxes"] = tv_tensors.BoundingBoxes(
        target["boxes"], format="XYXY", canvas_size=canvas_size
    )
    if "masks" in target:
        wrapped["masks"] = tv_tensors.Mask(target["masks"])
    if "keypoints" in target:
        points = target["keypoints"]
        wrapped["keypoints"] = tv_tensors.KeyPoints(points[..., :2], canvas_size=canvas_size)
        wrapped["keypoint_visibility"] = points[..., 2]
    return tv_tensors.Image(image), wrapped


def object_rows(pair: tuple[Any, Mapping[str, Any]]) -> tuple[torch.Tensor, ...]:
    """Tensors with a row per object, besides boxes and masks.

    torchvision's ``SanitizeBoundingBoxes(labels_getter=object_rows)`` removes rows of all of them
    with a box. By default it keeps the rows of keypoints (0.28), which then belong to other boxes.

    Args:
        pair: An image and its target, also of ``to_tv_tensors``.
    """
    _, target = pair
    names = ("labels", "area", "iscrowd", "keypoints", "keypoint_visibility")
    return tuple(target[name] for name in names if name in target)
