"""Train the detector of ``detector.py`` on two CPU cores; evaluate it on any COCO-style folder.

    python examples/train_detector.py out/train --eval out/test/coco --save detector.pt
    python examples/train_detector.py tabletop.yaml --minutes 15 --eval photographs
    python examples/train_detector.py --load detector.pt --eval photographs

The source is a finished data set, or a configuration, which is rendered while training; only
images of the split ``train`` are trained on. ``--eval`` is a folder with annotations in COCO's
format (``annotations/*.json`` or ``*.json``, of which ``--split`` names one) and their images
anywhere below it. Classes are matched by name. The result is COCO's AP with a 95 % confidence
interval from bootstrapping over images.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from detector import STRIDE, Detector, Truth, augment, compute_loss, detect, encode
from numpy.typing import NDArray
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

import gen_data
from gen_data.targets import detection_target

PEAK_RATE = 2e-3
"""Largest learning rate of AdamW."""

KEPT_MAX = 4000
"""Most samples of a data set that are kept in memory."""


def open_source(args: argparse.Namespace) -> gen_data.SampleSequence:
    """The samples to train on, with the classes of their label map if they have one."""
    source = Path(args.source)
    if (source / "manifest.json").is_file():
        samples: gen_data.SampleSequence = gen_data.open(source)
    else:
        samples = gen_data.Dataset(args.source, seed=args.seed)
    has_map = bool((samples.config.get("labels") or {}).get("map"))
    return samples.relabelled() if has_map else samples


def training_target(sample: gen_data.Sample) -> tuple[NDArray[np.uint8], dict[str, Any]] | None:
    """Image and boxes of a training sample; None for the other splits."""
    return detection_target(sample) if sample.split == "train" else None


def read_batches(
    samples: gen_data.SampleSequence, args: argparse.Namespace
) -> Iterator[list[tuple[NDArray[np.uint8], dict[str, Any]]]]:
    """Batches of training samples, epoch after epoch without end.

    Small data sets are kept in memory after the first epoch: reading a sample takes longer than
    a training step on it.
    """
    epoch = {} if samples.is_bounded else {"epoch_size": args.epoch_size}
    loader = gen_data.Loader(
        samples, training_target, batch_size=args.batch, shuffle=True, seed=args.seed,
        workers=args.workers, **epoch,
    )  # fmt: skip
    is_small = samples.is_bounded and len(samples) <= KEPT_MAX
    rng, seen = np.random.default_rng(args.seed), []
    while not (is_small and seen):
        for batch in loader:
            chosen = [pair for pair in batch if pair is not None]
            seen += chosen if is_small else chosen[:1]
            if chosen:
                yield chosen
        if not seen:
            raise SystemExit(f"{args.source}: has no sample in the split 'train'")
    while True:
        order = rng.permutation(len(seen))
        for numbers in np.split(order, range(args.batch, len(seen), args.batch)):
            yield [seen[number] for number in numbers]


def train(samples: gen_data.SampleSequence, args: argparse.Namespace) -> Detector:
    """Train for ``--minutes`` or ``--steps``, whichever ends first."""
    torch.manual_seed(args.seed)
    rng = np.random.default_rng(args.seed)
    model = Detector(samples.categories, args.size, args.width).to(
        memory_format=torch.channels_last
    )
    optimizer = torch.optim.AdamW(model.parameters(), lr=PEAK_RATE, weight_decay=0.01)
    started_s = time.monotonic()
    for step, batch in enumerate(read_batches(samples, args)):
        minutes = (time.monotonic() - started_s) / 60.0
        used = max(minutes / args.minutes, step / args.steps)
        if used >= 1.0:
            break
        # One cycle: a short warm-up, then a cosine down to zero.
        rate = min(1.0, (step + 1) / 50) * 0.5 * (1.0 + np.cos(np.pi * used))
        optimizer.param_groups[0]["lr"] = PEAK_RATE * rate
        images, truths = zip(*(prepare(model, *pair, rng) for pair in batch), strict=True)
        loss = compute_loss(*model(torch.stack(images)), truths)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(model.parameters(), 10.0)
        optimizer.step()
        if step % 20 == 0:
            print(f"{minutes:5.1f} min, step {step}: loss {loss.item():.3f}", flush=True)
    return model.eval()


def prepare(
    model: Detector, image: NDArray[np.uint8], target: dict[str, Any], rng: np.random.Generator
) -> tuple[torch.Tensor, Truth]:
    """An augmented image [3, h, w] in [0, 1] and its truth."""
    moved, boxes = augment(image.transpose(1, 2, 0), target["boxes"], model.size_px, rng)
    shape = len(model.classes), moved.shape[0] // STRIDE, moved.shape[1] // STRIDE
    truth = encode(boxes, target["labels"], target["iscrowd"] == 1, shape)
    return torch.from_numpy(moved).permute(2, 0, 1).float() / 255.0, truth


def find_annotations(folder: Path, split: str) -> Path:
    """The annotation file of a COCO-style folder: the only one, or the one of the split."""
    files = sorted(folder.glob("annotations/*.json")) or sorted(folder.glob("*.json"))
    files = [path for path in files if "keypoints" not in path.stem]
    chosen = [path for path in files if split in path.stem]
    if split == "" and len(files) > 1:
        chosen = [path for path in files if "val" in path.stem]
    if len(chosen) != 1:
        names = ", ".join(path.name for path in files) or "none"
        raise SystemExit(f"{folder}: expected one annotation file *{split}*.json; found {names}")
    return chosen[0]


def find_images(folder: Path, annotations: Path, names: list[str]) -> list[Path]:
    """Images by their names in an annotation file.

    Of several with one name, those in ``<split>/`` win, then those in the fewest folders: an export
    holds depth and label images of the same names in folders of their own.
    """
    known: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*.*")):
        known.setdefault(path.name, []).append(path)
    images = []
    for name in map(Path, names):
        found = [p for p in known.get(name.name, []) if p.parts[-len(name.parts) :] == name.parts]
        if not found:
            raise SystemExit(f"{annotations}: there is no image {name} in {folder}")
        images.append(max(found, key=lambda p: (p.parent.name in annotations.stem, -len(p.parts))))
    return images


def detect_all(
    model: Detector, truth: COCO, files: list[Path], ids: dict[str, int]
) -> list[dict[str, Any]]:
    """Detections in all images in COCO's format of results; ``ids`` are its categories by name."""
    results = []
    for entry, file in zip(truth.dataset["images"], files, strict=True):
        image = cv2.imread(str(file))
        if image is None:
            raise SystemExit(f"{file}: cannot be read as an image")
        for (x0, y0, x1, y1), score, label in zip(*detect(model, image[..., ::-1]), strict=True):
            name = model.classes[label - 1]
            if name in ids:
                box = [float(v) for v in (x0, y0, x1 - x0, y1 - y0)]
                result = {"image_id": entry["id"], "category_id": ids[name], "bbox": box}
                results.append(result | {"score": float(score)})
    return results


def evaluate(model: Detector, args: argparse.Namespace) -> dict[str, Any]:
    """Print AP and AP50 with confidence intervals, and AP50 per class; return them."""
    path = find_annotations(args.eval, args.split)
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO(str(path))
    ids = {c["name"]: c["id"] for c in truth.dataset["categories"] if c["name"] in model.classes}
    if not ids:
        raise SystemExit(f"{path}: has none of the classes {', '.join(model.classes)}")
    names = [image["file_name"] for image in truth.dataset["images"]]
    results = detect_all(model, truth, find_images(args.eval, path, names), ids)
    if not results:
        raise SystemExit(f"{path}: none of its classes was detected in the images")
    with contextlib.redirect_stdout(io.StringIO()):
        judged = COCOeval(truth, truth.loadRes(results), "bbox")
        judged.params.catIds = sorted(ids.values())
        judged.evaluate()
    count = len(judged.params.imgIds)
    measured = average_precisions(judged, np.arange(count))
    rng = np.random.default_rng(0)
    drawn = [
        np.nanmean(average_precisions(judged, rng.integers(0, count, count)), axis=1)
        for _ in range(args.bootstrap)
    ]
    summary: dict[str, Any] = {"images": count}
    low, high = np.nanpercentile(drawn, [2.5, 97.5], axis=0)
    for name, row in (("AP", 0), ("AP50", 1)):
        mean = float(np.nanmean(measured[row]))
        print(f"{name:<5} {mean:.3f}  (95 %: {low[row]:.3f} to {high[row]:.3f}; {count} images)")
        summary[name.lower()] = mean
    classes = sorted(ids, key=ids.__getitem__)
    by_class = zip(classes, measured[1].tolist(), strict=True)
    summary["ap50_by_class"] = {name: ap for name, ap in by_class if not np.isnan(ap)}
    parts = [f"{name} {ap:.2f}" for name, ap in summary["ap50_by_class"].items()]
    print(f"AP50 by class: {', '.join(parts)}")
    return summary


def average_precisions(judged: COCOeval, chosen: NDArray[np.int64]) -> NDArray[np.float64]:
    """AP and AP50 [2, classes] over the images with these numbers; NaN = class without objects."""
    evaluated, params = judged.evalImgs, judged.params
    table = np.empty(len(evaluated), object)
    table[:] = evaluated
    table = table.reshape(len(params.catIds), len(params.areaRng), len(params.imgIds))
    judged.evalImgs = table[..., chosen].ravel().tolist()
    with contextlib.redirect_stdout(io.StringIO()):
        judged.accumulate()
    judged.evalImgs = evaluated
    precision = judged.eval["precision"][:, :, :, 0, -1]  # IoU, recall, class; all areas
    precision = np.where(precision > -1, precision, np.nan)
    return np.stack([precision.mean(axis=(0, 1)), precision[0].mean(axis=0)])


def parse_arguments() -> argparse.Namespace:
    """Arguments of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", nargs="?", help="configuration, or folder of a finished data set")
    parser.add_argument("--load", type=Path, help="evaluate this detector instead of training one")
    parser.add_argument("--eval", type=Path, required=True, help="COCO-style folder")
    parser.add_argument("--split", default="", help="part of the name of the annotation file")
    parser.add_argument("--minutes", type=float, default=15.0, help="longest time of training")
    parser.add_argument("--steps", type=float, default=float("inf"), help="most training steps")
    parser.add_argument("--size", type=int, default=256, help="longest side of its images [px]")
    parser.add_argument("--width", type=int, default=16, help="channels of its finest features")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--epoch-size", type=int, default=2000, help="samples, for configurations")
    parser.add_argument("--workers", type=int, default=1, help="processes that read or render")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bootstrap", type=int, default=200)
    parser.add_argument("--save", type=Path, help="write the detector here")
    parser.add_argument("--out", type=Path, help="also write the results as JSON here")
    args = parser.parse_args()
    if (args.source is None) == (args.load is None):
        parser.error("give either a source to train on, or --load")
    return args


def main() -> None:
    """Train or load, evaluate, print."""
    args = parse_arguments()
    find_annotations(args.eval, args.split)  # a wrong folder fails before training
    model = Detector.load(args.load) if args.load else train(open_source(args), args)
    if args.save is not None:
        model.save(args.save)
    summary = evaluate(model, args)
    if args.out is not None:
        args.out.write_text(json.dumps(summary) + "\n")


if __name__ == "__main__":
    main()
