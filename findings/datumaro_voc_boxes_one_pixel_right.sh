#!/usr/bin/env bash
# Common guess: datumaro's boxes are left, top, width and height in one convention, whatever they were
#   read from, so that Pascal VOC converted to COCO has the boxes of its objects.
# What happens: VOC states the first and last pixel, counted from 1. datumaro takes both as they are: an
#   object of 10 x 10 pixels in the corner (1 1 10 10) becomes [1, 1, 9, 9], while its mask in the
#   same data set has [0, 0, 10, 10], and supervision reads 0 0 10 10. Written as COCO, the shift stays.
# Why it matters: IoU of box and object is 0.81: a detector that finds the object exactly is wrong at
#   COCO's thresholds 0.85 to 0.95. Subtract 1 from left and top, and add 1 to the sizes.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q datumaro==1.13.12 supervision==0.31.2
cd "$work"
"$work/venv/bin/python" - <<'PY'
import json
from importlib.metadata import version
from pathlib import Path

import datumaro
import numpy as np
import supervision as sv
from PIL import Image

print(", ".join(f"{name} {version(name)}" for name in ("datumaro", "supervision", "numpy")))
voc = Path("VOC2012")
for name in ("JPEGImages", "Annotations", "ImageSets/Main", "ImageSets/Segmentation",
             "SegmentationClass", "SegmentationObject"):
    (voc / name).mkdir(parents=True)
Image.new("RGB", (20, 20)).save(voc / "JPEGImages/a.jpg")
ids = np.zeros((20, 20), np.uint8)
ids[:10, :10] = 1
for folder, number in (("SegmentationClass", 15), ("SegmentationObject", 1)):  # 15: person
    image = Image.fromarray(ids * number)
    image.putpalette(np.array([[(k & 1) * 128, (k >> 1 & 1) * 128, (k >> 2 & 1) * 128]
                               for k in range(256)], np.uint8).tobytes())
    image.save(voc / folder / "a.png")
for name in ("Main", "Segmentation"):
    (voc / f"ImageSets/{name}/train.txt").write_text("a\n")
(voc / "Annotations/a.xml").write_text(
    "<annotation><folder>VOC2012</folder><filename>a.jpg</filename>"
    "<size><width>20</width><height>20</height><depth>3</depth></size><segmented>1</segmented>"
    "<object><name>person</name><pose>Unspecified</pose><truncated>0</truncated>"
    "<difficult>0</difficult><bndbox><xmin>1</xmin><ymin>1</ymin><xmax>10</xmax><ymax>10</ymax>"
    "</bndbox></object></annotation>")


def boxes(kind: str) -> list[list[float]]:
    (item,) = datumaro.Dataset.import_from(str(voc), kind)
    return [[float(v) for v in one.get_bbox()] for one in item.annotations]


found = {"box": boxes("voc_detection"), "mask": boxes("voc_segmentation")}
datumaro.Dataset.import_from(str(voc), "voc_detection").export("coco", "coco_instances")
(row,) = json.loads(Path("coco/annotations/instances_train.json").read_text())["annotations"]
found["as COCO"] = [row["bbox"]]
data = sv.DetectionDataset.from_pascal_voc(str(voc / "JPEGImages"), str(voc / "Annotations"))
(_, _, seen), = list(data)
found["supervision, corners"] = seen.xyxy.tolist()
for name, value in found.items():
    print(f"{name}: {value}")
expected = {"box": [[1.0, 1.0, 9.0, 9.0]], "mask": [[0.0, 0.0, 10.0, 10.0]],
            "as COCO": [[1.0, 1.0, 9.0, 9.0]], "supervision, corners": [[0.0, 0.0, 10.0, 10.0]]}
assert found == expected, f"behaviour changed: expected {expected}, found {found}"
PY
echo "as described"
