"""Training of the small detector on targets in memory, and its detections in pictures."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import cv2
import numpy as np
import torch
from numpy.typing import NDArray

from gen_data.core.streams import Streams
from gen_data.lab.study import detector
from gen_data.lab.study.real_pictures import RealPicture, RealSet, read_image

PEAK_RATE = 2e-3
"""Largest learning rate of AdamW."""

Arrays = Mapping[str, NDArray[Any]]
Target = tuple[NDArray[np.uint8], Arrays]
"""Image [3, h, w] and ``boxes``, ``labels``, ``iscrowd``, as of ``gen_data.targets``."""


def fit(
    model: detector.Detector,
    batches: Iterable[Sequence[Target]],
    used: Callable[[int], float],
    *,
    seed: int = 0,
    report: Callable[[int, float], None] | None = None,
) -> detector.Detector:
    """Train a detector with AdamW, and make it ready to detect.

    Args:
        model: Changed in place.
        batches: As many as are needed.
        used: Share of the training that is over before a step, by its number; 1 ends it.
        seed: Seed of the augmentation.
        report: Called with number and loss of every twentieth step.
    """
    rng = Streams(seed, 0).rng("study/augmentation")
    model.train()
    model.to(memory_format=torch.channels_last)
    optimizer = torch.optim.AdamW(model.parameter_groups(PEAK_RATE), weight_decay=0.01)
    peaks = [group["lr"] for group in optimizer.param_groups]
    for step, batch in enumerate(batches):
        share = used(step)
        if share >= 1.0:
            break
        # One cycle: a short warm-up, then a cosine down to zero.
        rate = min(1.0, (step + 1) / 50) * 0.5 * (1.0 + np.cos(np.pi * share))
        for group, peak in zip(optimizer.param_groups, peaks, strict=True):
            group["lr"] = peak * rate
        images, truths = zip(*(prepare(model, *pair, rng) for pair in batch), strict=True)
        logits, boxes = model(torch.stack(images))
        loss = detector.compute_loss(logits, boxes, truths)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 10.0)
        optimizer.step()
        if report is not None and step % 20 == 0:
            report(step, loss.item())
    model.eval()
    return model


def prepare(
    model: detector.Detector, image: NDArray[np.uint8], target: Arrays, rng: np.random.Generator
) -> tuple[torch.Tensor, detector.Truth]:
    """An augmented image [3, h, w] in [0, 1] and its truth."""
    moved, boxes = detector.augment(image.transpose(1, 2, 0), target["boxes"], model, rng)
    shape = len(model.classes), moved.shape[0] // detector.STRIDE, moved.shape[1] // detector.STRIDE
    truth = detector.encode(boxes, target["labels"], target["iscrowd"] == 1, shape)
    return torch.from_numpy(moved).permute(2, 0, 1).float() / 255.0, truth


def shuffle(targets: Sequence[Target], batch: int, seed: int) -> Iterator[list[Target]]:
    """Batches in a new order in every epoch, without end."""
    rng = Streams(seed, 0).rng("study/order")
    size = min(batch, len(targets))
    while True:
        order = rng.permutation(len(targets))
        for first in range(0, len(order) - size + 1, size):
            yield [targets[number] for number in order[first : first + size]]


def mix(generated: Iterable[list[Target]], real: Iterable[list[Target]]) -> Iterator[list[Target]]:
    """Batches of both, half of each from either: few real pictures would be drowned."""
    for first, second in zip(generated, real, strict=False):
        half = len(first) // 2
        yield first[half:] + second[: max(half, 1)]


def shrink(target: Target, longest_px: float) -> Target:
    """A target whose longest side has at most this size: it is read and augmented faster."""
    image, arrays = target
    scale = longest_px / max(image.shape[1:])
    if scale >= 1.0:
        return target
    small = cv2.resize(
        image.transpose(1, 2, 0), None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA
    ).transpose(2, 0, 1)
    # Sides are rounded to whole pixels: boxes take the scale of each side.
    along = np.array([small.shape[2] / image.shape[2], small.shape[1] / image.shape[1]] * 2)
    return small, {**arrays, "boxes": (arrays["boxes"] * along).astype(np.float32)}


def real_target(picture: RealPicture, classes: Sequence[str]) -> Target:
    """Target of a real picture, with labels from 1 in the order of classes."""
    objects = [t for t in picture.objects if t.name in classes or not t.name]
    labels = [classes.index(t.name) + 1 if t.name else 1 for t in objects]
    return read_image(picture.path).transpose(2, 0, 1), {
        "boxes": np.array([t.box for t in objects], np.float32).reshape(-1, 4),
        "labels": np.array(labels, np.int64),
        "iscrowd": np.array([t.is_ignored for t in objects], np.int64),
    }


def detect_all(
    model: detector.Detector, real: RealSet, pictures: Sequence[RealPicture]
) -> list[dict[str, Any]]:
    """Detections in pictures, in COCO's format of results, of the classes of a real set."""
    images = ((picture.image_id, read_image(picture.path)) for picture in pictures)
    return detect_in_images(model, images, real.category_ids)


def detect_in_images(
    model: detector.Detector,
    images: Iterable[tuple[int, NDArray[np.uint8]]],
    category_ids: Mapping[str, int],
) -> list[dict[str, Any]]:
    """Detections in RGB images [h, w, 3] with their ids, in COCO's format of results."""
    results = []
    for image_id, image in images:
        found = detector.detect(model, image)
        for (x0, y0, x1, y1), confidence, label in zip(*found, strict=True):
            category_id = category_ids.get(model.classes[label - 1])
            if category_id is not None:
                results.append(
                    {
                        "image_id": image_id,
                        "category_id": category_id,
                        "bbox": [float(v) for v in (x0, y0, x1 - x0, y1 - y0)],
                        "score": float(confidence),
                    }
                )
    return results
