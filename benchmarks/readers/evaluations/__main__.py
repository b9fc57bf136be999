"""Clone the evaluations, make data sets, and print the scores."""

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

from benchmarks.readers.evaluations import __doc__ as about
from benchmarks.readers.evaluations import lanes, points, text, voxels

Evaluation = Callable[[Path, Path, Path, float], float]
"""Score of the truth, moved or not, by code: data sets, folder for files, 0 or 1."""
GITHUB = "https://github.com"
SOURCES = {
    "OpenLane": ("OpenDriveLab/OpenLane", "8a0ce6b0057278729f4753a57be38c12929d7ad9",
                 "eval/LANE_evaluation"),
    "MapTR": ("hustvl/MapTR", "a6872d8d9670bde17b4b01560f1221f88b443d55",
              "projects/mmdet3d_plugin/datasets/map_utils"),
    "semantic-kitti-api": ("PRBonn/semantic-kitti-api", "a9c749e8124b2243b6eef1b8bcf971a9f1173a2d",
                           "."),
    "OccNet": ("CVPR2023-3D-Occupancy-Prediction/CVPR2023-3D-Occupancy-Prediction",
               "4781df91900246029ec34d1b0ed0831ef069c7d9", "projects/mmdet3d_plugin/datasets"),
    "SurroundOcc": ("weiyithu/SurroundOcc", "419bf5b47ee07ef0610950cce5ba99168c506753",
                    "projects/mmdet3d_plugin/datasets"),
    "OpenOccupancy": ("JeffWang987/OpenOccupancy", "eafd14f54b3044f7fe2734c660caab9e4b06b340",
                      "projects/occ_plugin"),
    "tapnet": ("google-deepmind/tapnet", "c2cbab81cc06092b5f05bfe2da7bfec54e2079c9", "tapnet"),
    "flownet3d": ("xingyul/flownet3d", "b15bcb04af61dfa60256e123892f63ba80e777eb", "."),
    "DB": ("MhLiao/DB", "65ca77a0bcfbd7114b916cf8a1e9ca85114286ce",
           "concern/icdar2015_eval/detection"),
    "coco-text": ("andreasveit/coco-text", "38f8490fa7281872f588ae693f551cedbe2c0129", "."),
}  # fmt: skip
"""Repository, commit, and the folder of its evaluation."""
EVALUATIONS: dict[str, tuple[Evaluation, str]] = {
    "OpenLane, space": (lanes.by_openlane_3d, "OpenLane"),
    "MapTR": (lanes.by_maptr, "MapTR"),
    "SemanticKITTI, voxels": (voxels.by_semantic_kitti_api, "semantic-kitti-api"),
    "Occ3D-nuScenes": (voxels.by_occ3d, "OccNet"),
    "SurroundOcc": (voxels.by_surroundocc, "SurroundOcc"),
    "OpenOccupancy": (voxels.by_openoccupancy, "OpenOccupancy"),
    "TAP-Vid": (points.by_tapvid, "tapnet"),
    "TAPVid-3D": (points.by_tapvid3d, "tapnet"),
    "Argoverse 2, flow": (points.by_argoverse_flow, ""),
    "FlowNet3D, flow": (points.by_flownet3d, "flownet3d"),
    "ICDAR 2015": (text.by_icdar, "DB"),
    "COCO-Text": (text.by_coco_text, "coco-text"),
}
"""Function, and the repository of its code; ``""``: a package."""
PROGRAMS: dict[str, Evaluation] = {"CULane": lanes.by_culane, "OpenLane": lanes.by_openlane_2d}
"""Functions that run a C++ program built by the user, as its repository describes."""
LANES = 6
"""Frames of ``lanes.yaml``."""
BOXES = {
    "occ3d": "",
    "semantickitti": "frame: velodyne, size_m: [51.2, 51.2, 6.4], voxel_m: 0.2"
                     ", from_m: [0, -25.6, -2]",
    "surroundocc": "frame: velodyne, size_m: [100, 100, 8], voxel_m: 0.5, from_m: [-50, -50, -5]",
    "openoccupancy": "frame: velodyne, size_m: [102.4, 102.4, 8], voxel_m: 0.2"
                     ", from_m: [-51.2, -51.2, -5]",
}  # fmt: skip
"""Box of each layout of voxels."""
NUSCENES = "{type: nuscenes, key_frame_s: 0.1, boxes_at: step, box_margin_m: 0}"


def main() -> int:
    """Make data sets, run all evaluations and print their scores; 1 if one is not as expected."""
    parser = argparse.ArgumentParser(description=about.splitlines()[0])
    parser.add_argument("--repositories", type=Path, required=True, help="clones; made if absent")
    for name in PROGRAMS:
        parser.add_argument(f"--{name.lower()}", type=Path, help="its program for lines in images")
    asked = parser.parse_args()
    folder = asked.repositories.resolve()
    for name, (repository, commit, part) in SOURCES.items():
        clone(folder / name, f"{GITHUB}/{repository}", commit, part)
    ready = {
        name: (evaluate, folder / source / SOURCES[source][2] if source else folder)
        for name, (evaluate, source) in EVALUATIONS.items()
    }
    for name, evaluate in PROGRAMS.items():
        if program := getattr(asked, name.lower()):
            ready[f"{name}, images"] = evaluate, program.resolve()
        else:
            print(f"{name}, images: not judged without --{name.lower()} PROGRAM")
    wrong = False
    with tempfile.TemporaryDirectory(prefix="evaluations-") as scratch:
        data = Path(scratch) / "data"
        make_data(data)
        for name, (evaluate, code) in ready.items():
            with redirect_stdout(StringIO()):
                scores = [evaluate(code, data, Path(scratch) / name / str(k), k) for k in (0, 1)]
            print(f"{name:22} truth {scores[0]:.4f}, moved truth {scores[1]:.4f}", flush=True)
            wrong |= scores[0] != 1.0 or not scores[1] <= 0.5
    return int(wrong)


def clone(folder: Path, url: str, commit: str, part: str) -> None:
    """The folder ``part`` of a repository at a commit."""
    if not folder.exists():
        subprocess.run(["git", "clone", "-q", "--no-checkout", url, str(folder)], check=True)
    subprocess.run(["git", "-C", str(folder), "checkout", "-q", commit, "--", part], check=True)


def make_data(data: Path) -> None:
    """Lanes, tracks, flow, voxels and text, each in a separate folder, in the split ``train``."""
    import gen_data

    one_split = "splits={train: 1}"
    lane_frames = [one_split, f"steps_per_scene={LANES}"]
    gen_data.generate("lanes.yaml", LANES, out=data / "lanes", workers=0, overrides=lane_frames)
    gen_data.generate("tracks.yaml", 20, out=data / "tracks", workers=0, overrides=[one_split])
    gen_data.generate("written_text.yaml", 5, out=data / "text", workers=0)
    rig = Path(__file__).parents[1] / "rig.yaml"
    flow = ["exporters=[{type: lidar_flow}]", "annotations=[boxes3d]"]
    gen_data.generate(rig, 3, out=data / "rig", workers=0, overrides=flow)
    for layout, box in BOXES.items():
        grids = [f"exporters=[{{type: occupancy, layouts: [occ3d, {layout}]}}, {NUSCENES}]",
                 f"annotations=[boxes3d, visibility, {{type: occupancy, {box}}}]"]  # fmt: skip
        gen_data.generate(rig, 3, out=data / layout, workers=0, overrides=grids)


if __name__ == "__main__":
    sys.exit(main())
