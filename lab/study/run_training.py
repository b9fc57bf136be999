"""A process that trains the small detector by a task file, and writes its detections."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch

from gen_data.api.open_dataset import open_dataset
from gen_data.lab.study.detector import Detector
from gen_data.lab.study.experiment import RESULTS
from gen_data.lab.study.real_pictures import read_real
from gen_data.lab.study.training import Target, detect_all, fit, mix, real_target, shrink, shuffle
from gen_data.runner.durable_files import write_durably
from gen_data.targets import detection_target

KEPT_SCALE = 1.25
"""Size of pictures in memory, in sizes of the detector's input: augmentation enlarges by 1.22."""


def perform_task(path: Path) -> None:
    """Train, save the detector next to the task, and write the detections last."""
    task: dict[str, Any] = json.loads(path.read_text("utf-8"))
    torch.set_num_threads(1)
    torch.manual_seed(task["seed"])
    classes, longest_px = task["classes"], KEPT_SCALE * task["size_px"]
    real = read_real(Path(task["folder"]), task["split"]).restrict(classes)
    by_id = {picture.image_id: picture for picture in real.pictures}
    batches = shuffle(
        _generated(Path(task["data"]), classes, longest_px), task["batch"], task["seed"]
    )
    if task["training"]:
        added = [shrink(real_target(by_id[k], classes), longest_px) for k in task["training"]]
        batches = mix(batches, shuffle(added, task["batch"], task["seed"]))
    model = fit(
        Detector(classes, task["size_px"]),
        batches,
        lambda step: step / task["steps"],
        seed=task["seed"],
        report=_log,
    )
    model.save(path.with_name("detector.pt"))
    results = detect_all(model, real, [by_id[k] for k in task["judged"]])
    write_durably(path.with_name(RESULTS), (json.dumps(results) + "\n").encode(), path.parent)


def _log(step: int, loss: float) -> None:
    sys.stdout.write(f"step {step}: loss {loss:.3f}\n")
    sys.stdout.flush()


def _generated(folder: Path, classes: list[str], longest_px: float) -> list[Target]:
    """Targets of a finished data set, with the labels of these classes."""
    with open_dataset(folder) as stored:
        has_map = bool((stored.config.get("labels") or {}).get("map"))
        samples = stored.relabelled() if has_map else stored
        label = {k: classes.index(name) + 1 for k, name in enumerate(samples.categories, 1)}
        label[0] = 0  # ignored objects without a class
        targets: list[Target] = []
        for sample in samples:
            image, arrays = shrink(detection_target(sample, ignored=True), longest_px)
            labels = [label[int(k)] for k in arrays["labels"]]
            targets.append((image, {**arrays, "labels": np.array(labels, np.int64)}))
    return targets


if __name__ == "__main__":
    perform_task(Path(sys.argv[1]))
