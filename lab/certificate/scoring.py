"""Average precision of the labels of a data set as predictions for an export, by pycocotools."""

import contextlib
import io
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from gen_data.lab.certificate.labelled_images import LabelledImage, LabelledObject

Kind = Literal["bbox", "segm"]
"""COCO's names: boxes, or masks."""


def average_precision(
    truth: Sequence[LabelledImage], predictions: Sequence[LabelledImage], kind: Kind
) -> float:
    """AP at IoU 0.50:0.95 over all sizes and any number of objects per image; 1 without objects.

    COCO's definition (Lin et al., "Microsoft COCO", ECCV 2014), computed by its reference
    implementation. Images that only one side has are left out.

    Args:
        truth: Taken for the ground truth.
        predictions: Taken for the output of a detector.
        kind: Compared shapes; objects without a mask have none.
    """
    from pycocotools.coco import COCO
    from pycocotools.cocoeval import COCOeval

    numbers = {str(image): number for number, image in enumerate(truth, 1)}
    names = sorted({o.category for image in (*truth, *predictions) for o in image.objects})
    rows = [
        _row(kind, numbers[str(image)], names.index(o.category) + 1, o)
        for image in predictions
        if str(image) in numbers
        for o in image.objects
    ]
    if not rows:
        return 1.0
    with contextlib.redirect_stdout(io.StringIO()):
        coco = COCO()
        coco.dataset = {
            "info": {},
            "images": [
                {"id": numbers[str(i)], "width": i.size_px[0], "height": i.size_px[1]}
                for i in truth
            ],
            "categories": [{"id": k, "name": name} for k, name in enumerate(names, 1)],
            "annotations": [
                {**row, "id": number, "iscrowd": 0}
                for number, row in enumerate(
                    (
                        _row(kind, numbers[str(image)], names.index(o.category) + 1, o)
                        for image in truth
                        for o in image.objects
                    ),
                    1,
                )
            ],
        }
        coco.createIndex()
        # Scores fall slightly: equal ones have no defined order.
        scored = [{**row, "score": 1.0 - 1e-9 * k} for k, row in enumerate(rows)]
        judged = COCOeval(coco, coco.loadRes(scored), kind)
        judged.params.maxDets = [1, 10, max(100, *(len(i.objects) for i in predictions))]
        judged.evaluate()
        judged.accumulate()
    precision = judged.eval["precision"][:, :, :, 0, -1]
    known = precision[precision > -1]
    return float(known.mean()) if known.size else 0.0


def _row(kind: Kind, image: int, category: int, thing: LabelledObject) -> Mapping[str, Any]:
    x_min, y_min, x_max, y_max = thing.box
    box = [x_min, y_min, x_max - x_min, y_max - y_min]
    row = {"image_id": image, "category_id": category, "bbox": box, "area": box[2] * box[3]}
    return row if kind == "bbox" else {**row, "segmentation": thing.mask}
