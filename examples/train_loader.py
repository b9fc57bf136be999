"""Feed a training loop from several processes: ``python examples/train_loader.py``.

The data set is written once and read back by worker processes, in a new order every epoch. With
PyTorch installed, its ``DataLoader`` does the same with the same class.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

import gen_data

SAMPLES, BATCH, WORKERS, EPOCHS = 8, 4, 2, 2
SMALL = ["sensors.color.size_px=[160,120]"]

Item = tuple[NDArray[np.uint8], NDArray[np.int64]]


class Detection:
    """Images [height, width, 3] with boxes and category ids [n, 5], by index; picklable."""

    def __init__(self, folder: str | PathLike[str]) -> None:
        self.data = gen_data.open(folder)

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.data)

    def __getitem__(self, index: int) -> Item:
        """Read one sample."""
        camera = self.data[index].cameras["color"]
        rows = [(*box.xyxy, box.category_id) for box in camera.boxes2d]
        return camera.rgb, np.array(rows, np.int64).reshape(-1, 5)


def collate(items: Sequence[Item]) -> tuple[NDArray[np.uint8], list[NDArray[np.int64]]]:
    """Stack the images of a batch; numbers of boxes differ."""
    return np.stack([image for image, _ in items]), [boxes for _, boxes in items]


def batches(data: Detection, pool: ProcessPoolExecutor, epoch: int) -> Iterator[Any]:
    """Yield the batches of one epoch, shuffled."""
    order = random.Random(epoch).sample(range(len(data)), len(data))
    items = pool.map(data.__getitem__, order, chunksize=BATCH)
    for _ in range(len(order) // BATCH):
        yield collate([next(items) for _ in range(BATCH)])


def main() -> None:
    """Write a small data set and iterate over it."""
    with tempfile.TemporaryDirectory() as folder:
        gen_data.generate("tabletop.yaml", SAMPLES, out=folder, overrides=SMALL)
        data = Detection(folder)
        with ProcessPoolExecutor(WORKERS) as pool:
            for epoch in range(EPOCHS):
                for images, boxes in batches(data, pool, epoch):
                    print(f"epoch {epoch}: {images.shape}, {sum(map(len, boxes))} boxes")
        if find_spec("torch"):
            from torch.utils.data import DataLoader

            loader = DataLoader(data, BATCH, shuffle=True, num_workers=WORKERS, collate_fn=collate)
            for images, boxes in loader:
                print(f"PyTorch: {images.shape}, {sum(map(len, boxes))} boxes")


if __name__ == "__main__":
    main()
