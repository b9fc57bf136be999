#!/usr/bin/env bash
# Common guess: torchvision's Kitti2015Stereo gives each left image its right image and its disparity.
# What happens: the benchmark's folders image_2 and image_3 also have the next frame of each scene,
#   NNNNNN_11.png, which has no disparity. torchvision lists all files, sorts them and pairs images with
#   disparities by position: image 000000_11 gets the disparity of 000001_10, and image 000001_10 that of
#   000002_10. The data set is twice as long as its disparities; indices beyond them raise IndexError.
# Why it matters: with the official archive, all pairs but the first have the disparity of another
#   scene, and training or evaluation goes on without an error. A folder with _10 files only is
#   paired rightly; the class KittiFlow of the same package asks for _10 and _11 by name.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q torch==2.13.0 torchvision==0.28.0 numpy pillow
cd "$work"
"$work/venv/bin/python" - <<'PY'
from pathlib import Path

import numpy as np
import torch
from PIL import Image

try:
    import torchvision
except RuntimeError:  # a build of torch without CUDA lacks operators, which are not used here
    library = torch.library.Library("torchvision", "DEF")
    library.define("nms(Tensor dets, Tensor scores, float threshold) -> Tensor")
    library.define("qnms(Tensor dets, Tensor scores, float threshold) -> Tensor")
    library.define("roi_align(Tensor a, Tensor b, float c, SymInt d, SymInt e, int f, bool g) -> Tensor")
    import torchvision
from torchvision.datasets import Kitti2015Stereo

print(f"torch {torch.__version__}, torchvision {torchvision.__version__}")


def pairs(root: Path, frames: tuple[int, ...]) -> list[tuple[int, int]]:
    """Scenes of the images and of the disparities that belong together, of three scenes."""
    folder = root / "Kitti2015/training"
    for name in ("image_2", "image_3", "disp_occ_0", "disp_occ_1"):
        (folder / name).mkdir(parents=True)
    for scene in range(3):
        for frame in frames:
            for name in ("image_2", "image_3"):
                grey = np.full((4, 4, 3), 10 * scene + frame - 10, np.uint8)
                Image.fromarray(grey).save(folder / name / f"{scene:06}_{frame}.png")
        # 16 bits, in units of 1/256 px: the disparity is 1 + the scene's number.
        for name in ("disp_occ_0", "disp_occ_1"):
            raw = np.full((4, 4), 256 * (1 + scene), np.uint16)
            Image.fromarray(raw).save(folder / name / f"{scene:06}_10.png")
    data = Kitti2015Stereo(root, split="train")
    found = []
    for k in range(3):
        left, _, disparity, *_ = data[k]
        shown = int(np.asarray(left)[0, 0, 0]) // 10
        found.append((shown, int(np.asarray(disparity).flat[0]) - 1))
    print(f"frames {frames}: {len(data)} items; (scene of image, scene of disparity):", found)
    if len(data) > 3:
        try:
            data[3]
        except IndexError:
            print("item 3: IndexError")
    return found


both = pairs(Path("both"), (10, 11))
first = pairs(Path("first"), (10,))
assert both == [(0, 0), (0, 1), (1, 2)], f"behaviour changed: {both}"
assert first == [(0, 0), (1, 1), (2, 2)], f"behaviour changed: {first}"
PY
echo "as described"
