#!/usr/bin/env bash
# Common guess: a COCO or YOLO polygon along the edges of pixels becomes the same mask in every reader.
# What happens: supervision rounds vertices to whole pixels and draws with OpenCV's fillPoly, which
#   includes the last pixel of an edge. A square of 10 x 10 pixels becomes 11 x 11 = 121; moved 0.02 px
#   inwards, 100 in pycocotools and in fillPoly after truncation, it still is 121 here, because 9.98
#   is rounded up. The same mask as run lengths is read exactly.
# Why it matters: masks of small objects grow by a fifth, and IoU with the truth falls to 0.83. Data
#   for supervision should be run lengths, and polygons cannot serve it and pycocotools at once: a right
#   edge would have to lie more than half a pixel inwards for the one, and at most half for the other.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q supervision==0.31.2 pycocotools==2.0.11 opencv-python-headless==4.14.0.94 numpy
cd "$work"
"$work/venv/bin/python" - <<'PY'
import json
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
import supervision as sv
from pycocotools import mask as coco_mask

print(f"supervision {version('supervision')}, pycocotools {version('pycocotools')}, "
      f"opencv {cv2.__version__}")
Path("images").mkdir()
cv2.imwrite("images/a.png", np.zeros((20, 20, 3), np.uint8))
edge, inset = [0, 0, 10, 0, 10, 10, 0, 10], [0.02, 0.02, 9.98, 0.02, 9.98, 9.98, 0.02, 9.98]
square = np.zeros((20, 20), np.uint8, order="F")
square[:10, :10] = 1
flat = square.flatten(order="F")
bounds = np.flatnonzero(np.diff(np.concatenate([[0], flat, [0]])))
runs = np.diff(np.concatenate([[0], bounds, [400]])).tolist()
shapes = {"edges": [edge], "inset": [inset], "runs": {"size": [20, 20], "counts": runs}}
areas = {}
for name, shape in shapes.items():
    data = {
        "images": [{"id": 1, "file_name": "a.png", "width": 20, "height": 20}],
        "annotations": [{"id": 1, "image_id": 1, "category_id": 1, "bbox": [0, 0, 10, 10],
                         "area": 100, "iscrowd": int(name == "runs"), "segmentation": shape}],
        "categories": [{"id": 1, "name": "square"}],
    }
    Path(f"{name}.json").write_text(json.dumps(data))
    loaded = sv.DetectionDataset.from_coco("images", f"{name}.json", force_masks=True)
    (_, _, found), = list(loaded)
    own = 100 if name == "runs" else int(
        coco_mask.area(coco_mask.frPyObjects(shape, 20, 20))[0])
    areas[name] = int(found.mask.sum()), own
    print(f"{name}: supervision {areas[name][0]} px, pycocotools {own} px")
corners = np.array(inset).reshape(-1, 2).astype(np.int32)
drawn = cv2.fillPoly(np.zeros((20, 20), np.uint8), [corners], 1).sum()
print(f"inset, truncated, by fillPoly: {drawn} px")
expected = {"edges": (121, 100), "inset": (121, 100), "runs": (100, 100)}
assert areas == expected, f"behaviour changed: expected {expected}, found {areas}"
assert drawn == 100
PY
echo "as described"
