"""Evaluations of voxels: SemanticKITTI, Occ3D-nuScenes, SurroundOcc and OpenOccupancy."""

import copy
import json
import os
import runpy
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from benchmarks.readers.evaluations.definitions import Tensor, definitions

NUMPY = SimpleNamespace(**vars(np), int=int)
"""With a name of before version 1.24."""
CLASSES = 17
"""Of nuScenes' lidarseg challenge, with 0 = others; Occ3D has 17 = free besides."""
NOISE = 255
"""Class of voxels that OpenOccupancy ignores."""


def by_semantic_kitti_api(code: Path, data: Path, out: Path, moved: float) -> float:
    """Mean IoU of SemanticKITTI's scene completion, over the classes that are there."""
    truth = data / "semantickitti/occupancy/semantickitti"
    config = yaml.safe_load((code / "config/semantic-kitti.yaml").read_text())
    config["split"]["valid"] = sorted(int(folder.name) for folder in truth.glob("sequences/*"))
    out.mkdir(parents=True)
    (out / "config.yaml").write_text(yaml.safe_dump(config))
    seen: set[int] = set()
    for path in truth.glob("sequences/*/voxels/*.label"):
        labels = np.fromfile(path, np.uint16)
        judged = ~np.unpackbits(np.fromfile(path.with_suffix(".invalid"), np.uint8)).astype(bool)
        seen |= {config["learning_map"][k] for k in np.unique(labels[judged]).tolist()}
        target = out / path.relative_to(truth).parent.with_name("predictions") / path.name
        target.parent.mkdir(parents=True, exist_ok=True)
        # Classes that it does not judge must not be predicted.
        named = np.isin(labels, [k for k, judged in config["learning_map"].items() if judged])
        found = np.where(named, labels, 0).astype(np.uint16)
        np.roll(found, round(moved * len(found) / 2)).tofile(target)
    folders = ["-d", str(truth), "-p", str(out), "--output", str(out)]
    sys.argv = ["evaluate_completion", *folders, "-dc", str(out / "config.yaml")]
    sys.path.insert(0, str(code))
    runpy.run_path(str(code / "evaluate_completion.py"), run_name="__main__")
    scores = yaml.safe_load((out / "scores.txt").read_text())
    names = (config["labels"][config["learning_map_inv"][k]] for k in sorted(seen - {0}))
    # It adds a small number to each union.
    return round(float(np.mean([scores[f"iou_{name}"] for name in names])), 6)


@np.errstate(invalid="ignore")  # of classes that are nowhere
def by_occ3d(code: Path, data: Path, out: Path, moved: float) -> float:
    """Mean IoU of Occ3D-nuScenes' evaluation, by its three masks: cameras, scanner, none."""
    del out
    (metric,) = definitions(code / "occ_metrics.py", "Metric_mIoU", np=np)
    ways = metric(use_image_mask=True), metric(use_lidar_mask=True), metric()
    for path in (data / "occ3d/occupancy/occ3d/gts").rglob("labels.npz"):
        labels = np.load(path)
        truth, masks = labels["semantics"], (labels[f"mask_{k}"] > 0 for k in ("lidar", "camera"))
        found, sensors = shifted(truth, moved), tuple(masks)
        for way in ways:
            way.add_batch(found, truth, *sensors)
    ious = [way.per_class_iu(way.hist)[:CLASSES] for way in ways]
    return float(np.nanmean(ious, axis=1).mean())


def by_surroundocc(code: Path, data: Path, out: Path, moved: float) -> float:
    """Least of the IoU of occupied voxels and the mean IoU of SurroundOcc's evaluation."""
    del out
    (load,) = definitions(code / "pipelines/loading.py", "LoadOccupancy", np=np)
    evaluate, _ = definitions(
        code / "evaluation_metrics.py", "evaluation_semantic gt_to_voxel", np=NUMPY
    )
    counts = np.zeros((CLASSES, 3))
    for scan in scans(data / "surroundocc"):
        path = data / f"surroundocc/occupancy/surroundocc/{scan.sample_token}.npy"
        truth = load()({"occ_path": str(path)})["gt_occ"]
        found, size = shifted(scan.classes, moved), {"occ_size": scan.classes.shape}
        counts += evaluate(Tensor(found[None]), Tensor(truth[None]), size, CLASSES)[0]
    both, given, predicted = counts.T
    there = given + predicted > 0
    ious = (both / np.maximum(given + predicted - both, 1))[there]
    return float(min(ious[0], ious[1:].mean()))


@np.errstate(invalid="ignore")  # of classes that are nowhere
def by_openoccupancy(code: Path, data: Path, out: Path, moved: float) -> float:
    """Mean IoU of OpenOccupancy's evaluation, read by its loader."""
    del out
    load, _ = definitions(
        code / "datasets/pipelines/loading.py", "LoadOccupancy nb_process_label",
        np=NUMPY, os=os, copy=copy, torch=SimpleNamespace(from_numpy=Tensor),
    )  # fmt: skip
    (count,) = definitions(code / "occupancy/detectors/occnet.py", "fast_hist", np=np, copy=copy)
    (ious_of,) = definitions(code / "utils/formating.py", "cm_to_ious", np=np)
    read = load(occ_path=str(data / "openoccupancy/occupancy/openoccupancy"))
    total = np.zeros((CLASSES, CLASSES))
    for scan in scans(data / "openoccupancy"):
        tokens = {"scene_token": scan.scene_token, "lidar_token": scan.lidar_token}
        truth = read({**tokens, "bda_mat": np.eye(3)})["gt_occ"]
        judged = truth != NOISE
        found = shifted(scan.classes, moved)[judged]
        total += count(found, truth[judged], max_label=CLASSES)
    return float(np.nanmean(ious_of(total)[1:]))


@dataclass(frozen=True, eq=False)
class Scan:
    """Tokens of a scan in the nuScenes export, and its voxels.

    ``classes`` [x, y, z]: of voxels with a surface, 0 = none, also for the class "others".
    """

    scene_token: str
    sample_token: str
    lidar_token: str
    classes: NDArray[np.intp]


def scans(root: Path) -> Iterator[Scan]:
    """Scans of a data set, with voxels from its files ``grids`` and ``occ3d``."""
    tables = root / "nuscenes/v1.0-mini"
    samples = {row["token"]: row for row in json.loads((tables / "sample.json").read_text())}
    for row in json.loads((tables / "sample_data.json").read_text()):
        path = Path(row["filename"])
        if not row["is_key_frame"] or path.parent.name != "LIDAR_TOP":
            continue
        token = row["sample_token"]
        (labels,) = (root / "occupancy/occ3d/gts").glob(f"*/{token}/labels.npz")
        grid = root / f"occupancy/grids/{path.name.split('_')[0]}.npz"
        surface = np.load(grid)["state"] == 1
        classes = np.where(surface, np.load(labels)["semantics"], 0).astype(np.intp)
        yield Scan(samples[token]["scene_token"], token, row["token"], classes)


def shifted(classes: NDArray[Any], moved: float) -> NDArray[Any]:
    """Voxels moved by half of their box along its first axis if ``moved`` is 1."""
    return np.roll(classes, round(moved * len(classes) / 2), axis=0)
