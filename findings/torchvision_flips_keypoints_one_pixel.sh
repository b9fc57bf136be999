#!/usr/bin/env bash
# Common guess: torchvision's transforms v2 move images, boxes and keypoints together: a keypoint in the
#   middle of a box of one pixel is there after any transform.
# Behaviour: flips take coordinates of keypoints for numbers of pixels (x becomes width - 1 - x), while
#   coordinates of boxes are places along edges (width - x). Resizing, rotating, padding and cropping treat both
#   as places. A flipped keypoint is one pixel to the left of, or above, its place in image and box.
#   With numbers of pixels, flips are right, but turns by 180 degrees and scales are wrong.
# Why it matters: with RandomHorizontalFlip, half of the examples have keypoints that are a pixel off, at
#   the size of the image at that step.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q torch==2.13.0 torchvision==0.28.0 numpy pillow
cd "$work"
"$work/venv/bin/python" - <<'PY'
import torch

try:
    import torchvision
except RuntimeError:  # a build of torch without CUDA lacks operators, which are not used here
    library = torch.library.Library("torchvision", "DEF")
    library.define("nms(Tensor dets, Tensor scores, float threshold) -> Tensor")
    library.define("qnms(Tensor dets, Tensor scores, float threshold) -> Tensor")
    library.define("roi_align(Tensor a, Tensor b, float c, SymInt d, SymInt e, int f, bool g) -> Tensor")
    import torchvision
from torchvision import tv_tensors
from torchvision.transforms import InterpolationMode
from torchvision.transforms.v2 import functional

print(f"torch {torch.__version__}, torchvision {torchvision.__version__}")

# One white pixel in column 3, row 2 of an image of 10 x 8: the box around it, and its middle.
size = (8, 10)
image = torch.zeros(1, *size)
image[0, 2, 3] = 1.0
parts = {
    "image": tv_tensors.Image(image),
    "box": tv_tensors.BoundingBoxes([[3.0, 2.0, 4.0, 3.0]], format="XYXY", canvas_size=size),
    "keypoint": tv_tensors.KeyPoints([[3.5, 2.5]], canvas_size=size),
}
nearest = InterpolationMode.NEAREST
transforms = {
    "horizontal_flip": functional.horizontal_flip,
    "vertical_flip": functional.vertical_flip,
    "rotate by 180": lambda part: functional.rotate(part, 180),
    "resize to twice": lambda part: functional.resize(part, [16, 20], interpolation=nearest),
    "pad by 2, 1": lambda part: functional.pad(part, [2, 1]),
    "crop from 1, 1": lambda part: functional.crop(part, 1, 1, 6, 8),
}
errors = {}
for name, transform in transforms.items():
    moved = {kind: transform(part) for kind, part in parts.items()}
    rows, columns = moved["image"][0].nonzero(as_tuple=True)
    white = [int(v) for v in (columns.min(), rows.min(), columns.max() + 1, rows.max() + 1)]
    box, (point,) = moved["box"].tolist()[0], moved["keypoint"].tolist()
    middle = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2]
    errors[name] = [round(a - b, 3) for a, b in zip(point, middle, strict=True)]
    print(f"{name}: white pixels {white}, box {box}, keypoint {point}")
    assert white == [round(v) for v in box], f"behaviour changed: box of {name}"
right = [0.0, 0.0]
expected = dict.fromkeys(transforms, right)
expected |= {"horizontal_flip": [-1.0, 0.0], "vertical_flip": [0.0, -1.0]}
assert errors == expected, f"behaviour changed: {errors}"
PY
echo "as described"
