"""Train the small detector on two CPU cores; evaluate it on any COCO- or KITTI-style folder.

    python examples/train_detector.py out/train --eval out/test/coco --save detector.pt
    python examples/train_detector.py tabletop.yaml --minutes 15 --eval photographs
    python examples/train_detector.py recipe.yaml --eval photographs --pretrained
    python examples/train_detector.py --load detector.pt --eval photographs

The source is a finished data set, or a recipe or configuration, which is rendered while training;
only images of the split ``train`` are trained on. ``--eval`` is a folder with annotations in COCO's
format (``annotations/*.json`` or ``*.json``, of which ``--split`` names one) and their images
anywhere below it. Classes are matched by name. The result is COCO's AP with a 95 % confidence
interval from bootstrapping over images. ``--load`` with a source trains that detector further, also
at another ``--size``.
"""

import argparse
import json
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import gen_data
from gen_data.lab.study.detector import Detector
from gen_data.lab.study.evaluation import evaluate
from gen_data.lab.study.real_pictures import read_real
from gen_data.lab.study.training import detect_all, fit
from gen_data.runner.recipe import is_recipe
from gen_data.targets import detection_target

KEPT_BYTES = 6e9
"""Largest images of a data set, together, that are kept in memory."""


def open_source(args: argparse.Namespace) -> gen_data.SampleSequence:
    """The samples of the split train, with the classes of their label map if they have one."""
    source = Path(args.source)
    if (source / "manifest.json").is_file() or is_recipe(source):
        samples: gen_data.SampleSequence = gen_data.open(source)
    else:
        samples = gen_data.Dataset(args.source, seed=args.seed)
    samples = samples.split("train")
    has_map = bool((samples.config.get("labels") or {}).get("map"))
    return samples.relabelled() if has_map else samples


Target = tuple[NDArray[np.uint8], dict[str, Any]]
"""Image [3, h, w] with boxes and labels, as of ``detection_target``."""


def targets_of_cameras(sample: gen_data.Sample) -> list[Target]:
    """The photographs of all cameras of a sample."""
    cameras = (name for name, camera in sample.cameras.items() if "rgb" in camera.channels)
    return [detection_target(sample, camera, ignored=True) for camera in cameras]


def read_targets(samples: gen_data.SampleSequence, args: argparse.Namespace) -> Iterator[Target]:
    """Pictures of training samples, epoch after epoch without end.

    Small data sets are kept in memory after the first epoch: reading a sample takes longer than
    a training step on it.
    """
    epoch = {} if samples.is_bounded else {"epoch_size": args.epoch_size}
    loader = gen_data.Loader(
        samples, targets_of_cameras, batch_size=args.batch, shuffle=True, seed=args.seed,
        workers=args.workers, **epoch,
    )  # fmt: skip
    rng = np.random.default_rng(args.seed)
    left_bytes = KEPT_BYTES if samples.is_bounded else -1.0
    seen: list[Target] = []
    while left_bytes < 0.0 or not seen:
        for batch in loader:
            pictures = [picture for sample in batch for picture in sample]
            left_bytes -= sum(image.nbytes for image, _ in pictures)
            seen = seen + pictures if left_bytes >= 0.0 else []
            yield from pictures
    while True:
        yield from (seen[number] for number in rng.permutation(len(seen)))


def batches_of_one_shape(pictures: Iterable[Target], size: int) -> Iterator[list[Target]]:
    """Batches of pictures in order of completion: cameras may differ in the shape of images."""
    waiting: dict[tuple[int, ...], list[Target]] = {}
    for picture in pictures:
        shape = picture[0].shape
        batch = waiting.setdefault(shape, [])
        batch.append(picture)
        if len(batch) == size:
            yield waiting.pop(shape)


def train(samples: gen_data.SampleSequence, args: argparse.Namespace) -> Detector:
    """Train for ``--minutes`` or ``--steps``, whichever ends first."""
    torch.manual_seed(args.seed)
    if args.load is None:
        size_px, width = args.size or 256, args.width or 16
        model = Detector(samples.categories, size_px, width, pretrained=args.pretrained)
    else:
        model = Detector.load(args.load)
        if model.classes != tuple(samples.categories):
            raise SystemExit(f"{args.load} has the classes {', '.join(model.classes)}; the source "
                             f"has {', '.join(samples.categories)}")  # fmt: skip
        model.size_px = args.size or model.size_px
    started_s = time.monotonic()

    def used(step: int) -> float:
        return max((time.monotonic() - started_s) / (60.0 * args.minutes), step / args.steps)

    def report(step: int, loss: float) -> None:
        minutes = (time.monotonic() - started_s) / 60.0
        print(f"{minutes:5.1f} min, step {step}: loss {loss:.3f}", flush=True)

    batches = batches_of_one_shape(read_targets(samples, args), args.batch)
    return fit(model, batches, used, seed=args.seed, report=report)


def evaluate_on(model: Detector, args: argparse.Namespace) -> dict[str, Any]:
    """Print AP and AP50 with confidence intervals, and AP50 per class; return them."""
    real = read_real(args.eval, args.split).restrict(model.classes)
    judged = evaluate(real, detect_all(model, real, real.pictures))
    count = len(real.pictures)
    rng = np.random.default_rng(0)
    drawn = [judged.summary(rng.integers(0, count, count)) for _ in range(args.bootstrap)]
    summary: dict[str, Any] = {"images": count}
    low, high = np.nanpercentile(drawn, [2.5, 97.5], axis=0)
    for name, row in (("AP", 0), ("AP50", 1)):
        mean = float(judged.summary()[row])
        print(f"{name:<5} {mean:.3f}  (95 %: {low[row]:.3f} to {high[row]:.3f}; {count} images)")
        summary[name.lower()] = mean
    classes = sorted(real.category_ids, key=real.category_ids.__getitem__)
    by_class = zip(classes, judged.average_precisions()[1].tolist(), strict=True)
    summary["ap50_by_class"] = {name: ap for name, ap in by_class if not np.isnan(ap)}
    parts = [f"{name} {ap:.2f}" for name, ap in summary["ap50_by_class"].items()]
    print(f"AP50 by class: {', '.join(parts)}")
    return summary


def parse_arguments() -> argparse.Namespace:
    """Arguments of the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", nargs="?", help="configuration, recipe, or folder of a data set")
    parser.add_argument("--load", type=Path, help="evaluate this detector, or train it further")
    parser.add_argument(
        "--pretrained", action="store_true", help="begin with features trained on photographs"
    )
    parser.add_argument("--eval", type=Path, required=True, help="COCO-style folder")
    parser.add_argument("--split", default="", help="part of the name of the annotation file")
    parser.add_argument("--minutes", type=float, default=15.0, help="longest time of training")
    parser.add_argument("--steps", type=float, default=float("inf"), help="most training steps")
    parser.add_argument(
        "--size", type=int, help="longest side of its images [px]; default 256, or as of --load"
    )
    parser.add_argument("--width", type=int, help="channels of its finest features; default 16")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--epoch-size", type=int, default=2000, help="samples, for configurations")
    parser.add_argument("--workers", type=int, default=1, help="processes that read or render")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bootstrap", type=int, default=200)
    parser.add_argument("--save", type=Path, help="write the detector here")
    parser.add_argument("--out", type=Path, help="also write the results as JSON here")
    args = parser.parse_args()
    if args.source is None and args.load is None:
        parser.error("give a source to train on, or --load")
    if args.load is not None and (args.pretrained or args.width):
        parser.error(
            "the detector of --load has its features already: leave out --pretrained and --width"
        )
    if args.source is None and args.size:
        parser.error("--size is of training: give a source to train on")
    return args


def main() -> None:
    """Train or load, evaluate, print."""
    args = parse_arguments()
    read_real(args.eval, args.split)  # a wrong folder fails before training
    model = train(open_source(args), args) if args.source else Detector.load(args.load)
    if args.save is not None:
        model.save(args.save)
    summary = evaluate_on(model, args)
    if args.out is not None:
        args.out.write_text(json.dumps(summary) + "\n")


if __name__ == "__main__":
    main()
