"""Evaluations of lanes and maps: CULane, OpenLane and MapTR."""

import json
import re
import subprocess
import sys
import types
import unittest.mock
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

SIZE_PX = (800, 450)
MOVED_M, MOVED_PX = 2.0, 60.0
"""Above all thresholds: 1.5 m, and half the overlap of lines 30 px wide."""


def by_culane(program: Path, data: Path, out: Path, moved: float) -> float:
    """F-measure of CULane's program: lines 30 px wide with half their area in common."""
    folder, listed = data / "lanes/culane", out / "list.txt"
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


def by_openlane_2d(program: Path, data: Path, out: Path, moved: float) -> float:
    """F-measure of OpenLane's program, CULane's measure on lines of this layout."""
    images = data / "lanes/openlane/images"
    aside = np.array([[moved * MOVED_PX], [0.0]])
    listed = write_openlane(data, out, lambda line: {"uv": (line["uv"] + aside).tolist()})
    return run_program(program, data / "lanes/openlane/lane3d_1000", out, images, listed)


def by_openlane_3d(code: Path, data: Path, out: Path, moved: float) -> float:
    """F-score of OpenLane's lines in space: three quarters of the visible points within 1.5 m.

    It judges 3 to 103 m in front of the vehicle. Its script requires a version of OR-Tools that
    spells names otherwise and a removed name of NumPy, and reads an attribute that it never sets.
    """

    def seen_from_above(line: dict[str, Any]) -> dict[str, Any]:
        x, y, z = np.array(line["ground"])[:, np.array(line["visibility"]) > 0]
        return {"xyz": np.stack([-y, x, z + moved * MOVED_M], -1).tolist()}

    listed = write_openlane(data, out, seen_from_above)
    sys.path.insert(0, str(code / "lane3d"))
    np.int = int  # type: ignore[attr-defined]  # noqa: NPY001
    sys.modules["ortools.graph.pywrapgraph"] = old_names_of_ortools()
    from eval_3D_lane import LaneEval

    truth = str(data / "lanes/openlane/lane3d_1000") + "/"
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


def by_maptr(code: Path, data: Path, out: Path, moved: float) -> float:
    """Mean AP of MapTR's evaluation at a Chamfer distance of 0.5 m, over its three classes.

    Packages of OpenMMLab, which it imports for files and messages, are left out; trees of Shapely
    answer as before version 2.
    """
    truth = json.loads((data / "lanes/map_vectors/train_map_anns.json").read_text())["GTs"]
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


class TreeOfGeometries:
    """Shapely's tree of boxes that answers with geometries instead of their numbers."""

    def __init__(self, geometries: Sequence[Any]) -> None:
        from shapely import STRtree

        self.geometries, self.tree = geometries, STRtree(geometries)

    def query(self, geometry: Any) -> list[Any]:
        """Geometries whose boxes intersect the box of ``geometry``."""
        return [self.geometries[k] for k in self.tree.query(geometry)]


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
    data: Path, out: Path, predicted: Callable[[dict[str, Any]], dict[str, Any]]
) -> Path:
    """Predictions for the front camera, and their list; ``ground`` has points below the camera.

    Lines with fewer than two visible points are not part of OpenLane's ground truth.
    """
    labels, names = data / "lanes/openlane/lane3d_1000", []
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
