#!/usr/bin/env bash
# Common guess: SanitizeBoundingBoxes of torchvision's transforms v2, which removes objects whose box a
#   crop made too small, removes their keypoints too.
# Behaviour: it removes rows of boxes, labels and masks. KeyPoints [objects, points, 2] keep all rows, so
#   row k of the keypoints no longer belongs to row k of the boxes; so do areas and crowd flags, which
#   are plain tensors. No transform raises an error. Tensors that labels_getter returns are filtered as
#   well, keypoints among them, which become plain tensors then.
# Why it matters: torchvision's KeypointRCNN takes the keypoints of the row of a box. After RandomIoUCrop
#   and SanitizeBoundingBoxes, in the order of its documentation, it learns keypoints of other objects.
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
from torchvision.transforms import v2

print(f"torch {torch.__version__}, torchvision {torchvision.__version__}")
size = (40, 40)
image = tv_tensors.Image(torch.zeros(3, *size))
# Two objects; each keypoint is the middle of its box.
target = {
    "boxes": tv_tensors.BoundingBoxes(
        [[1.0, 1.0, 7.0, 7.0], [20.0, 20.0, 36.0, 36.0]], format="XYXY", canvas_size=size
    ),
    "labels": torch.tensor([1, 2]),
    "area": torch.tensor([36.0, 256.0]),
    "masks": tv_tensors.Mask(torch.zeros(2, *size, dtype=torch.uint8)),
    "keypoints": tv_tensors.KeyPoints([[[4.0, 4.0]], [[28.0, 28.0]]], canvas_size=size),
}
rows = ("labels", "area", "keypoints")
crop = torchvision.transforms.v2.functional.crop


def crop_all(found: dict) -> dict:
    """The lower right quarter, in which the first object is not."""
    parts = ("boxes", "masks", "keypoints")
    return {k: crop(v, 20, 20, 20, 20) if k in parts else v for k, v in found.items()}


found = {}
for name, getter in (("default", "default"), ("all rows", lambda pair: tuple(pair[1][k] for k in rows))):
    sanitize = v2.SanitizeBoundingBoxes(labels_getter=getter)
    _, kept = sanitize(image, crop_all(target))
    found[name] = {k: len(v) for k, v in kept.items()}
    print(f"{name}: rows {found[name]}; box {kept['boxes'].tolist()[0]}, keypoint of its row", end=" ")
    print(kept["keypoints"][0].tolist()[0])
few = {"boxes": 1, "labels": 1, "area": 1, "masks": 1, "keypoints": 1}
assert found["default"] == few | {"area": 2, "keypoints": 2}, f"behaviour changed: {found}"
assert found["all rows"] == few, f"behaviour changed: {found}"
PY
echo "as described"
