"""Evaluations of lanes, maps, voxels, scene flow and text, most of them in no registry.

::

    python -m benchmarks.readers.evaluations --repositories FOLDER

Each judges the truth as a prediction, which must score perfectly, and the truth moved away, which
must not. Their code is cloned at fixed commits into ``--repositories``. Needed besides: git, g++,
the headers of OpenCV (``apt-get install libopencv-dev``), and ``pip install ortools scipy av2``.
"""

import argparse
import json
import re
import runpy
import subprocess
import sys
import tempfile
import types
import unittest.mock
from collections.abc import Callable, Sequence
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml

SOURCES = {
    "SCNN": ("https://github.com/XingangPan/SCNN", "428d5e007d5b53e3acfa40dc19fdfa5141d079a3"),
    "OpenLane": ("https://github.com/OpenDriveLab/OpenLane",
                 "8a0ce6b0057278729f4753a57be38c12929d7ad9"),
    "MapTR": ("https://github.com/hustvl/MapTR", "a6872d8d9670bde17b4b01560f1221f88b443d55"),
    "coco-text": ("https://github.com/andreasveit/coco-text",
                  "38f8490fa7281872f588ae693f551cedbe2c0129"),
    "semantic-kitti-api": ("https://github.com/PRBonn/semantic-kitti-api",
                           "a9c749e8124b2243b6eef1b8bcf971a9f1173a2d"),
    "DB": ("https://github.com/MhLiao/DB", "65ca77a0bcfbd7114b916cf8a1e9ca85114286ce"),
}  # fmt: skip
PARTS = {
    "SCNN": "tools/lane_evaluation",
    "OpenLane": "eval/LANE_evaluation",
    "MapTR": "projects/mmdet3d_plugin/datasets/map_utils",
    "coco-text": ".",
    "semantic-kitti-api": ".",
    "DB": "concern/icdar2015_eval/detection",
}
"""Folder of the evaluation in each repository."""
LIBRARIES = ("core", "imgproc", "imgcodecs", "highgui")
SAMPLES, SIZE_PX = 6, (800, 450)
MOVED_M, MOVED_PX = 2.0, 60.0
"""Above all thresholds: 1.5 m, and half the overlap of lines 30 px wide."""


def main() -> int:
    """Make a data set, run all evaluations and print their scores; 1 if one is not as expected."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repositories", type=Path, required=True, help="clones; made if absent")
    given = parser.parse_args()
    for name, (url, commit) in SOURCES.items():
        clone(given.repositories / name, url, commit, PARTS[name])
    wrong = False
    with tempfile.TemporaryDirectory(prefix="evaluations-") as scratch:
        root = make_data(Path(scratch))
        for name, (evaluate, source) in EVALUATIONS.items():
            code = (given.repositories / source / PARTS.get(source, "")).resolve()
            with redirect_stdout(StringIO()):
                scores = [evaluate(code, root, Path(scratch) / name / str(k), k) for k in (0, 1)]
            print(f"{name:22} truth {scores[0]:.4f}, moved truth {scores[1]:.4f}", flush=True)
            wrong |= scores[0] != 1.0 or scores[1] > 0.5
    return int(wrong)


def clone(folder: Path, url: str, commit: str, part: str) -> None:
    """The folder ``part`` of a repository at a commit."""
    if not folder.exists():
        subprocess.run(["git", "clone", "-q", "--no-checkout", url, str(folder)], check=True)
    subprocess.run(["git", "-C", str(folder), "checkout", "-q", commit, "--", part], check=True)


def make_data(scratch: Path) -> Path:
    """A data set of lanes.yaml, all in the split ``train``; next to it flow, voxels and text."""
    import gen_data

    rig = Path(__file__).parent / "rig.yaml"
    flow = ["exporters=[{type: lidar_flow, layouts: [av2]}]", "annotations=[boxes3d]"]
    gen_data.generate(rig, 3, out=scratch / "rig", workers=0, overrides=flow)
    box = "frame: velodyne, size_m: [51.2, 51.2, 6.4], voxel_m: 0.2, from_m: [0, -25.6, -2]"
    completion = ["exporters=[{type: occupancy, layouts: [semantickitti]}]",
                  f"annotations=[{{type: occupancy, {box}}}]"]  # fmt: skip
    gen_data.generate(rig, 3, out=scratch / "voxels", workers=0, overrides=completion)
    gen_data.generate("written_text.yaml", 5, out=scratch / "text", workers=0)
    gen_data.generate(
        "lanes.yaml", SAMPLES, out=scratch / "data", workers=0,
        overrides=["splits={train: 1}", f"steps_per_scene={SAMPLES}"],
    )  # fmt: skip
    return scratch / "data"


def by_culane(code: Path, root: Path, out: Path, moved: float) -> float:
    """F-measure of CULane's program: lines 30 px wide with half their area in common."""
    program = build(code, ("src/*.cpp",))
    folder, listed = root / "culane", out / "list.txt"
    aside = np.array([moved * MOVED_PX, 0.0])
    names = (folder / "list/train.txt").read_text().splitlines()
    for name in names:
        path = Path(name.lstrip("/")).with_suffix(".lines.txt")
        target = out / path
        target.parent.mkdir(parents=True, exist_ok=True)
        rows = (map(float, row.split()) for row in (folder / path).read_text().splitlines())
        lines = (np.reshape(list(row), (-1, 2)) + aside for row in rows)
        target.write_text("".join(" ".join(f"{v:.3f}" for v in p.ravel()) + "\n" for p in lines))
    listed.write_text("".join(f"{name}\n" for name in names))
    width, height = map(str, SIZE_PX)
    size = ("-c", width, "-r", height, "-f", "1")
    return run_program(program, folder, out, folder, listed, size)


def by_openlane_2d(code: Path, root: Path, out: Path, moved: float) -> float:
    """F-measure of OpenLane's program, CULane's measure on lines of this layout."""
    program = build(code / "lane2d", ("src/*.cpp", "src/*.c"))
    images = root / "openlane/images"
    aside = np.array([[moved * MOVED_PX], [0.0]])
    listed = write_openlane(root, out, lambda line: {"uv": (line["uv"] + aside).tolist()})
    return run_program(program, root / "openlane/lane3d_1000", out, images, listed)


def by_openlane_3d(code: Path, root: Path, out: Path, moved: float) -> float:
    """F-score of OpenLane's lines in space: three quarters of the visible points within 1.5 m.

    It judges 3 to 103 m in front of the vehicle. Its script asks for a version of OR-Tools that
    spells names otherwise, for a removed name of NumPy, and reads an attribute that it never sets.
    """

    def seen_from_above(line: dict[str, Any]) -> dict[str, Any]:
        x, y, z = np.array(line["ground"])[:, np.array(line["visibility"]) > 0]
        return {"xyz": np.stack([-y, x, z + moved * MOVED_M], -1).tolist()}

    listed = write_openlane(root, out, seen_from_above)
    sys.path.insert(0, str(code / "lane3d"))
    np.int = int  # type: ignore[attr-defined]  # noqa: NPY001
    sys.modules["ortools.graph.pywrapgraph"] = old_names_of_ortools()
    from eval_3D_lane import LaneEval

    truth = str(root / "openlane/lane3d_1000") + "/"
    options = {"dataset_dir": truth, "pred_dir": f"{out}/", "test_list": str(listed)}
    judge = LaneEval(types.SimpleNamespace(**options))
    judge.dataset_name = "openlane"
    return float(judge.bench_one_submit(f"{out}/", truth, str(listed))[0])


def old_names_of_ortools() -> types.ModuleType:
    """The solver of flows under the names that it had before version 9.4."""
    from ortools import graph
    from ortools.graph.python.min_cost_flow import SimpleMinCostFlow

    class Renamed:
        OPTIMAL = SimpleMinCostFlow.OPTIMAL

        def __init__(self) -> None:
            self.solver = SimpleMinCostFlow()

        def __getattr__(self, name: str) -> Callable[..., int]:
            method = getattr(self.solver, re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower())
            return lambda *numbers: int(method(*map(int, numbers)) or 0)

    module = types.ModuleType("ortools.graph.pywrapgraph")
    module.SimpleMinCostFlow = Renamed  # type: ignore[attr-defined]
    graph.pywrapgraph = module
    return module


def by_maptr(code: Path, root: Path, out: Path, moved: float) -> float:
    """Mean AP of MapTR's evaluation at a Chamfer distance of 0.5 m, over its three classes.

    Packages of OpenMMLab, which it imports for files and messages, are left out; trees of Shapely
    answer as before version 2.
    """
    truth = json.loads((root / "map_vectors/train_map_anns.json").read_text())["GTs"]
    found = [{"vectors": [
        {**line, "confidence_level": 1.0, "pts": (np.array(line["pts"]) + moved * MOVED_M).tolist()}
        for line in frame["vectors"]
    ]} for frame in truth]  # fmt: skip
    names = ("mmcv", "mmcv.utils", "mmdet", "mmdet.core", "mmdet.core.evaluation",
             "mmdet.core.evaluation.bbox_overlaps", "terminaltables")  # fmt: skip
    for name in names:
        sys.modules[name] = unittest.mock.MagicMock()
    import shapely.strtree

    shapely.strtree.STRtree = TreeOfGeometries
    sys.path.insert(0, str(code.parent))
    from map_utils.mean_ap import eval_map, format_res_gt_by_classes

    classes = ("divider", "ped_crossing", "boundary")
    lines = format_res_gt_by_classes(
        str(out / "results.json"), found, truth, cls_names=classes,
        eval_use_same_gt_sample_num_flag=True, nproc=1,
    )  # fmt: skip
    mean, _ = eval_map(
        found, truth, *lines, threshold=0.5, cls_names=classes, metric="chamfer", nproc=1
    )
    return float(mean)


def by_icdar(code: Path, root: Path, out: Path, moved: float) -> float:
    """Harmonic mean of ICDAR 2015's evaluation, in the version for Shapely of the detector DB."""
    del out
    sys.path.insert(0, str(code))
    from iou import DetectionIoUEvaluator

    judge, results = DetectionIoUEvaluator(), []
    for path in (root.parent / "text/scene_text/icdar2015").glob("*/gt/*.txt"):
        rows = [row.split(",", 8) for row in path.read_text("utf-8-sig").splitlines()]
        corners = [np.array(row[:8], float).reshape(4, 2) for row in rows]
        words = [
            {"points": points, "text": row[8], "ignore": row[8] == "###"}
            for row, points in zip(rows, corners, strict=True)
        ]
        found = [{**word, "points": word["points"] + moved * MOVED_PX} for word in words]
        results.append(judge.evaluate_image(words, found))
    return float(judge.combine_results(results)["hmean"])


def by_coco_text(code: Path, root: Path, out: Path, moved: float) -> float:
    """F-score of COCO-Text's evaluation: boxes with half their area in common."""
    sys.modules["editdistance"] = unittest.mock.MagicMock()  # of transcriptions, which it compares
    sys.path.insert(0, str(code))
    from coco_evaluation import getDetections
    from coco_text import COCO_Text

    truth = root.parent / "text/scene_text/coco_text/cocotext.v2.json"
    content = json.loads(truth.read_text())
    for word in content["anns"].values():
        word["bbox"] = [v + moved * MOVED_PX * (k < 2) for k, v in enumerate(word["bbox"])]
    out.mkdir(parents=True)
    (out / "found.json").write_text(json.dumps(content))
    given, found = COCO_Text(str(truth)), COCO_Text(str(out / "found.json"))
    counts = {k: len(v) for k, v in getDetections(given, found, imgIds=[]).items()}
    wrong = counts["false_positives"] + counts["false_negatives"]
    return 2 * counts["true_positives"] / (2 * counts["true_positives"] + wrong)


def by_semantic_kitti_api(code: Path, root: Path, out: Path, moved: float) -> float:
    """Mean IoU of SemanticKITTI's scene completion, over the classes that are there."""
    truth = root.parent / "voxels/occupancy/semantickitti"
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


class TreeOfGeometries:
    """Shapely's tree of boxes that answers with geometries instead of their numbers."""

    def __init__(self, geometries: Sequence[Any]) -> None:
        from shapely import STRtree

        self.geometries, self.tree = geometries, STRtree(geometries)

    def query(self, geometry: Any) -> list[Any]:
        """Geometries whose boxes meet that of ``geometry``."""
        return [self.geometries[k] for k in self.tree.query(geometry)]


def by_argoverse_flow(code: Path, root: Path, out: Path, moved: float) -> float:
    """Share of points within 5 cm, by the evaluation of scene flow of the package av2."""
    del code
    from av2.evaluation.scene_flow.eval import evaluate_directories
    from pyarrow import feather

    truth = root.parent / "rig/lidar_flow/av2"
    for path in truth.rglob("*.feather"):
        rows = feather.read_feather(path)
        target = out / path.relative_to(truth)
        target.parent.mkdir(parents=True, exist_ok=True)
        feather.write_feather(rows.assign(flow_tx_m=rows.flow_tx_m + moved * MOVED_M), target)
    scores = evaluate_directories(truth, out)
    scores = scores[scores.Count > 0]
    return float(np.average(scores["ACCURACY_STRICT"], weights=scores.Count))


def build(code: Path, sources: tuple[str, ...]) -> Path:
    """Compile a program that links OpenCV."""
    program = code / "evaluate"
    if not program.exists():
        files = [str(path) for pattern in sources for path in sorted(code.glob(pattern))]
        flags = ["-std=c++11", "-fopenmp", "-I", str(code / "include"), "-I/usr/include/opencv4"]
        linked = [f"-lopencv_{name}" for name in LIBRARIES]
        subprocess.run(["g++", *flags, "-o", str(program), *files, *linked], check=True)
    return program


def run_program(
    program: Path, truth: Path, found: Path, images: Path, listed: Path, size: tuple[str, ...] = ()
) -> float:
    """F-measure that CULane's program, or OpenLane's, prints."""
    options = ("-a", f"{truth}/", "-d", f"{found}/", "-i", f"{images}/", "-l", str(listed))
    measure = ("-w", "30", "-t", "0.5", *size, "-o", str(found / "scores"))
    done = subprocess.run(
        [str(program), *options, *measure], check=True, capture_output=True, text=True
    )
    score = float(done.stdout.split("Fmeasure:")[1].split()[0])
    return 0.0 if np.isnan(score) else score  # without a match it divides 0 by 0


def write_openlane(
    root: Path, out: Path, predicted: Callable[[dict[str, Any]], dict[str, Any]]
) -> Path:
    """Predictions for the front camera, and their list; ``ground`` has points below the camera.

    Lines of which less than two points are visible are no truth of OpenLane's evaluation.
    """
    labels, names = root / "openlane/lane3d_1000", []
    for path in sorted(labels.glob("*/*_CAM_FRONT/*.json")):
        frame, kept = json.loads(path.read_text()), []
        T_ego_camera = np.array(frame["extrinsic"])
        for line in frame["lane_lines"]:
            height_m = np.array([[0.0], [0.0], [T_ego_camera[2, 3]]])
            ground = T_ego_camera[:3, :3] @ np.array(line["xyz"]) + height_m
            kept.append({"category": line["category"], **predicted({**line, "ground": ground})})
        target = out / path.relative_to(labels)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(json.dumps({"file_path": frame["file_path"], "lane_lines": kept}))
        names.append(f"{path.relative_to(labels).with_suffix('.jpg')}\n")
    (out / "list.txt").write_text("".join(names))
    return out / "list.txt"


EVALUATIONS = {
    "CULane": (by_culane, "SCNN"),
    "OpenLane, images": (by_openlane_2d, "OpenLane"),
    "OpenLane, space": (by_openlane_3d, "OpenLane"),
    "MapTR": (by_maptr, "MapTR"),
    "Argoverse 2, flow": (by_argoverse_flow, ""),
    "SemanticKITTI, voxels": (by_semantic_kitti_api, "semantic-kitti-api"),
    "ICDAR 2015": (by_icdar, "DB"),
    "COCO-Text": (by_coco_text, "coco-text"),
}

if __name__ == "__main__":
    sys.exit(main())
