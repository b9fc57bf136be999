"""Train a small object detector on two CPU cores and evaluate it on any COCO-style folder.

    python examples/train_detector.py tabletop.yaml --minutes 15 --eval out/tabletop/coco
    python examples/train_detector.py out/tabletop --eval photographs

The source is a configuration, which is rendered while training, or a finished data set. ``--eval``
is a folder with one file ``annotations/*.json`` in COCO's format, or several of which ``--split``
names one; its images are looked for below the folder. Classes are matched by name.

The detector follows CenterNet (Zhou et al., "Objects as Points", 2019): a heat map of object
centres per class, and size and offset at each centre. The result is COCO's AP with a 95 %
confidence interval from bootstrapping over images.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import time
from pathlib import Path

import cv2
import numpy as np
import torch
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval
from torch import Tensor, nn
from torch.nn import functional

import gen_data
from gen_data.targets import detection_target

STRIDE = 4
PEAKS = 60


class Detector(nn.Module):
    """Heat map, size and offset at a quarter of the resolution; about 1 million parameters."""

    def __init__(self, classes: int, width: int = 32) -> None:
        super().__init__()
        w = width

        def block(inner: int, outer: int, stride: int = 1) -> nn.Sequential:
            conv = nn.Conv2d(inner, outer, 3, stride, 1, bias=False)
            return nn.Sequential(conv, nn.BatchNorm2d(outer), nn.ReLU(inplace=True))

        self.stem = nn.Sequential(block(3, w, 2), block(w, w, 2), block(w, w))
        self.down1 = nn.Sequential(block(w, 2 * w, 2), block(2 * w, 2 * w))
        self.down2 = nn.Sequential(block(2 * w, 4 * w, 2), block(4 * w, 4 * w), block(4 * w, 4 * w))
        self.up1, self.up2 = block(4 * w, 2 * w), block(2 * w, w)
        self.mix = block(w, 2 * w)
        self.heat = nn.Conv2d(2 * w, classes, 1)
        self.shape = nn.Conv2d(2 * w, 4, 1)
        # The prior of a centre is about 1 %: see Lin et al., "Focal loss", 2017, section 4.1.
        nn.init.constant_(self.heat.bias, -4.6)

    def forward(self, images: Tensor) -> tuple[Tensor, Tensor]:
        """Logits [b, classes, h/4, w/4]; width, height, offset x and y [px] [b, 4, h/4, w/4]."""
        fine = self.stem(images)
        middle = self.down1(fine)
        coarse = self.down2(middle)
        middle = middle + functional.interpolate(self.up1(coarse), size=middle.shape[-2:])
        fine = fine + functional.interpolate(self.up2(middle), size=fine.shape[-2:])
        features = self.mix(fine)
        return self.heat(features), self.shape(features)


def prepare(image: np.ndarray, size: int) -> tuple[np.ndarray, float]:
    """Scale an image [h, w, 3] to fit ``size`` x ``size``, padded; also return the scale."""
    scale = size / max(image.shape[:2])
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    padded = np.zeros((size, size, 3), np.uint8)
    padded[: small.shape[0], : small.shape[1]] = small[:size, :size]
    return padded, scale


def augment(image: np.ndarray, boxes: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Random contrast, brightness and mirroring; ``boxes`` [n, 4] are changed in place."""
    image = image.astype(np.float32) * rng.uniform(0.7, 1.3) + rng.uniform(-20.0, 20.0)
    if rng.uniform() < 0.5:
        image = image[:, ::-1]
        boxes[:, [0, 2]] = image.shape[1] - boxes[:, [2, 0]]
    return np.clip(image, 0.0, 255.0)


def encode(
    boxes: np.ndarray, labels: np.ndarray, classes: int, size: int
) -> tuple[np.ndarray, ...]:
    """Heat map [classes, s, s], shapes [4, s, s] and where they count [s, s]."""
    side = size // STRIDE
    heat = np.zeros((classes, side, side), np.float32)
    shape, known = np.zeros((4, side, side), np.float32), np.zeros((side, side), np.float32)
    rows, columns = np.mgrid[:side, :side]
    for (x0, y0, x1, y1), label in zip(boxes, labels, strict=True):
        x, y = 0.5 * (x0 + x1) / STRIDE, 0.5 * (y0 + y1) / STRIDE
        column, row = min(int(x), side - 1), min(int(y), side - 1)
        sigma = max(0.12 * min(x1 - x0, y1 - y0) / STRIDE, 0.6)
        spot = np.exp(-((columns - column) ** 2 + (rows - row) ** 2) / (2.0 * sigma**2))
        np.maximum(heat[label - 1], spot, out=heat[label - 1])
        shape[:, row, column] = x1 - x0, y1 - y0, x - column, y - row
        known[row, column] = 1.0
    return heat, shape, known


def loss_of(logits: Tensor, shapes: Tensor, truth: tuple[Tensor, ...]) -> Tensor:
    """CenterNet's focal loss of the heat map, and L1 of log sizes and offsets."""
    heat, shape, known = truth
    p = torch.sigmoid(logits).clamp(1e-4, 1.0 - 1e-4)
    is_centre = heat.eq(1.0)
    positive = -((1.0 - p) ** 2) * p.log() * is_centre
    negative = -((1.0 - heat) ** 4) * p**2 * (1.0 - p).log() * ~is_centre
    count = known.sum().clamp(min=1.0)
    sizes = (shapes[:, :2] - shape[:, :2].clamp(min=1.0).log()).abs().sum(1)
    offsets = (shapes[:, 2:] - shape[:, 2:]).abs().sum(1)
    return ((positive + negative).sum() + ((sizes + offsets) * known).sum()) / count


@torch.no_grad()
def detect(model: Detector, image: np.ndarray, size: int) -> list[tuple[list[float], float, int]]:
    """Boxes ``[x, y, w, h]`` [px], score and class index of an RGB image."""
    padded, scale = prepare(image, size)
    logits, shapes = model(torch.from_numpy(padded).permute(2, 0, 1)[None].float() / 255.0)
    heat = torch.sigmoid(logits)
    peaks = heat * (functional.max_pool2d(heat, 3, 1, 1) == heat)
    scores, places = peaks[0].flatten().topk(PEAKS)
    side = heat.shape[-1]
    found = []
    for score, place in zip(scores.tolist(), places.tolist(), strict=True):
        label, row, column = place // side**2, place // side % side, place % side
        log_w, log_h, dx, dy = shapes[0, :, row, column].tolist()
        w, h = float(np.exp(log_w)), float(np.exp(log_h))
        x, y = (column + dx) * STRIDE - 0.5 * w, (row + dy) * STRIDE - 0.5 * h
        found.append(([x / scale, y / scale, w / scale, h / scale], score, label))
    return found


def open_source(args: argparse.Namespace) -> gen_data.SampleSequence:
    """The samples to train on, with the classes of their label map if they have one."""
    source = Path(args.source)
    if (source / "manifest.json").is_file():
        samples: gen_data.SampleSequence = gen_data.open(source)
    else:
        samples = gen_data.Dataset(args.source, seed=args.seed)
    has_map = bool((samples.config.get("labels") or {}).get("map"))
    return samples.relabelled() if has_map else samples


def train(args: argparse.Namespace, samples: gen_data.SampleSequence) -> Detector:
    """Train for the given time."""
    classes = samples.categories
    torch.manual_seed(args.seed)
    rng = np.random.default_rng(args.seed)
    options = {} if samples.is_bounded else {"epoch_size": args.epoch_size}
    loader: gen_data.Loader = gen_data.Loader(
        samples, detection_target, batch_size=args.batch, shuffle=True, seed=args.seed,
        workers=args.workers, **options,
    )  # fmt: skip
    model = Detector(len(classes))
    optimizer = torch.optim.AdamW(model.parameters(), lr=2e-3, weight_decay=1e-4)
    started_s, step = time.monotonic(), 0
    while True:
        for batch in loader:
            used = (time.monotonic() - started_s) / (60.0 * args.minutes)
            if used >= 1.0:
                return model.eval()
            # One cycle: a short warm-up, then a cosine down to zero.
            rate = min(1.0, (step + 1) / 50) * 0.5 * (1.0 + np.cos(np.pi * used))
            optimizer.param_groups[0]["lr"] = 2e-3 * rate
            images, truths = [], []
            for image, target in batch:
                padded, scale = prepare(image.transpose(1, 2, 0), args.size)
                kept = target["iscrowd"] == 0
                boxes = target["boxes"][kept] * scale
                images.append(augment(padded, boxes, rng) / 255.0)
                truths.append(encode(boxes, target["labels"][kept], len(classes), args.size))
            pixels = torch.from_numpy(np.stack(images).astype(np.float32)).permute(0, 3, 1, 2)
            truth = tuple(torch.from_numpy(np.stack(part)) for part in zip(*truths, strict=True))
            loss = loss_of(*model(pixels), truth)
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(model.parameters(), 10.0)
            optimizer.step()
            step += 1
            if step % 20 == 0:
                minutes = (time.monotonic() - started_s) / 60.0
                print(f"{minutes:5.1f} min, step {step}: loss {loss.item():.3f}", flush=True)


def find_annotations(folder: Path, split: str) -> Path:
    """The annotation file of a COCO-style folder."""
    files = sorted(folder.glob("annotations/*.json")) + sorted(folder.glob("*.json"))
    chosen = [p for p in files if split in p.stem and "keypoints" not in p.stem]
    if not chosen:
        raise SystemExit(f"{folder}: no annotations/*{split}*.json; expected COCO's layout")
    return chosen[0]


def evaluate(args: argparse.Namespace, model: Detector, classes: tuple[str, ...]) -> None:
    """Print AP and AP50 with confidence intervals."""
    path = find_annotations(args.eval, args.split)
    images = {
        p.name: p for p in args.eval.rglob("*") if p.suffix.lower() in (".png", ".jpg", ".jpeg")
    }
    with contextlib.redirect_stdout(io.StringIO()):
        truth = COCO(str(path))
    ids = {c["name"]: c["id"] for c in truth.dataset["categories"] if c["name"] in classes}
    if not ids:
        raise SystemExit(f"{path}: shares no class with the training data: {', '.join(classes)}")
    results = []
    for entry in truth.dataset["images"]:
        image = cv2.imread(str(images[Path(entry["file_name"]).name]))
        for box, score, label in detect(model, image[..., ::-1], args.size):
            if classes[label] in ids:
                number = ids[classes[label]]
                results.append(
                    {"image_id": entry["id"], "category_id": number, "bbox": box, "score": score}
                )
    with contextlib.redirect_stdout(io.StringIO()):
        judged = COCOeval(truth, truth.loadRes(results), "bbox")
        judged.params.catIds = sorted(ids.values())
        judged.evaluate()
    scores = [average_precisions(judged, None)]
    rng = np.random.default_rng(0)
    count = len(judged.params.imgIds)
    scores += [
        average_precisions(judged, rng.integers(0, count, count)) for _ in range(args.bootstrap)
    ]
    for name, column in (("AP", 0), ("AP50", 1)):
        drawn = [score[column] for score in scores[1:]]
        low, high = np.nanpercentile(drawn, [2.5, 97.5])
        print(f"{name:<5} {scores[0][column]:.3f}  (95 %: {low:.3f} to {high:.3f}; {count} images)")
    if args.out is not None:
        args.out.write_text(json.dumps({"ap": scores[0][0], "ap50": scores[0][1]}) + "\n")


def average_precisions(judged: COCOeval, chosen: np.ndarray | None) -> tuple[float, float]:
    """AP and AP50 over the images with these numbers, repetitions included; None = all."""
    evaluated, params = judged.evalImgs, judged.params
    shape = (len(params.catIds), len(params.areaRng), len(params.imgIds))
    if chosen is not None:
        table = np.empty(len(evaluated), object)
        table[:] = evaluated
        judged.evalImgs = table.reshape(shape)[..., chosen].ravel().tolist()
    with contextlib.redirect_stdout(io.StringIO()):
        judged.accumulate()
    judged.evalImgs = evaluated
    precision = judged.eval["precision"][:, :, :, 0, -1]
    valid = np.where(precision > -1, precision, np.nan)
    return float(np.nanmean(valid)), float(np.nanmean(valid[0]))


def main() -> None:
    """Train, evaluate, print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", help="configuration, or folder of a finished data set")
    parser.add_argument("--eval", type=Path, required=True, help="COCO-style folder")
    parser.add_argument("--split", default="val", help="part of the annotation file's name")
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--size", type=int, default=256, help="side of the network's input [px]")
    parser.add_argument("--batch", type=int, default=8)
    parser.add_argument("--epoch-size", type=int, default=2000, help="samples, for configurations")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--bootstrap", type=int, default=200)
    parser.add_argument("--out", type=Path, help="also write AP as JSON here")
    args = parser.parse_args()
    samples = open_source(args)
    evaluate(args, train(args, samples), samples.categories)


if __name__ == "__main__":
    main()
