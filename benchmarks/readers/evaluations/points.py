"""Evaluations of point tracks and scene flow: TAP-Vid, TAPVid-3D, Argoverse 2 and FlowNet3D."""

import glob
import io
import logging
import os
import pickle
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from PIL import Image

from benchmarks.readers.evaluations.definitions import definitions

MOVED_M, MOVED_PX = 2.0, 60.0
"""Above all thresholds: 10 cm, or 5 % of the way, and 16 px."""
SCORES = ("average_jaccard", "average_pts_within_thresh", "occlusion_accuracy")


def by_tapvid(code: Path, data: Path, out: Path, moved: float) -> float:
    """The least of Jaccard, share of near points and accuracy of occlusions, mean over videos.

    Its reader of the DAVIS files gives the queries, of both kinds, and the tracks in images of
    256 x 256 px; pictures, which no score uses, stay black.
    """
    del out
    names = (
        "create_davis_dataset compute_tapvid_metrics sample_queries_first sample_queries_strided"
    )
    create, judge, *_ = definitions(
        code / "tapvid/evaluation_datasets.py", names, np=np, pickle=pickle,
        tf=SimpleNamespace(io=SimpleNamespace(gfile=SimpleNamespace(GFile=open))),
        resize_video=lambda video, size: np.zeros((len(video), *size, 3), np.uint8),
    )  # fmt: skip
    scores = []
    for path in sorted((data / "tracks/tapvid/tapvid").rglob("*.pkl")):
        for mode in ("first", "strided"):
            (video,) = create(str(path), query_mode=mode)
            truth = video["davis"]
            tracks, hidden = truth["target_points"], truth["occluded"]
            found = tracks + np.array([moved * MOVED_PX, 0.0])
            score = judge(truth["query_points"], hidden, tracks, hidden, found, query_mode=mode)
            scores.append([float(score[name][0]) for name in SCORES])
    return float(np.mean(scores, axis=0).min())


def by_tapvid3d(code: Path, data: Path, out: Path, moved: float) -> float:
    """The least of the same three scores in space, with three of its ways to find the scale."""
    metrics = SimpleNamespace(**runpy.run_path(str(code / "tapvid3d/evaluation/metrics.py")))
    names = (
        "evaluate_data_source get_new_hw_with_given_smallest_side_length get_jpeg_byte_hw"
        " get_average_over_metrics"
    )
    evaluate, *_ = definitions(
        code / "tapvid3d/evaluation/evaluate_model.py", names, np=np, io=io, os=os, logging=logging,
        tqdm=SimpleNamespace(tqdm=lambda names, **_: names),
        Image=Image, metrics=metrics, _DEBUG=SimpleNamespace(value=False),
        ZERO_METRICS_DICT={},
    )  # fmt: skip
    truth = data / "tracks/tapvid/tapvid3d/train"
    names_of_files = sorted(path.name for path in truth.glob("*.npz"))
    out.mkdir(parents=True)
    for name in names_of_files:
        clip = np.load(truth / name)
        found_m = clip["tracks_XYZ"] + np.array([moved * MOVED_M, 0.0, 0.0])
        np.savez(out / name, tracks_XYZ=found_m, visibility=clip["visibility"])
    scores = evaluate(names_of_files, str(truth), str(out), ["median", "mean", "none"])
    return float(np.min([[score[name] for name in SCORES] for score in scores.values()]))


def by_argoverse_flow(code: Path, data: Path, out: Path, moved: float) -> float:
    """Share of points within 5 cm, by the evaluation of scene flow of the package av2."""
    del code
    from av2.evaluation.scene_flow.eval import evaluate_directories
    from pyarrow import feather

    truth = data / "rig/lidar_flow/av2"
    for path in truth.rglob("*.feather"):
        rows = feather.read_feather(path)
        target = out / path.relative_to(truth)
        target.parent.mkdir(parents=True, exist_ok=True)
        feather.write_feather(rows.assign(flow_tx_m=rows.flow_tx_m + moved * MOVED_M), target)
    scores = evaluate_directories(truth, out)
    scores = scores[scores.Count > 0]
    return float(np.average(scores["ACCURACY_STRICT"], weights=scores.Count))


def by_flownet3d(code: Path, data: Path, out: Path, moved: float) -> float:
    """Share of points within 5 cm or 5 % of their way; its reader of KITTI draws 16,384 of them."""
    del out
    (reader,) = definitions(code / "kitti_dataset.py", "SceneflowDataset", np=np, glob=glob, os=os)
    (judge,) = definitions(code / "evaluate.py", "scene_flow_EPE_np", np=np)
    pairs = reader(str(data / "rig/lidar_flow/kitti/train"))
    drawn = [pairs[k] for k in range(len(pairs))]
    flow, mask = (np.stack([pair[k] for pair in drawn]) for k in (4, 5))
    _, near, _ = judge(flow + np.array([moved * MOVED_M, 0.0, 0.0]), flow, mask)
    return float(near)
