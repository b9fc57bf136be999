"""Small folders of labelled pictures."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from gen_data.lab.matching.label_files import RealObject
from gen_data.lab.study.real_pictures import RealPicture, RealSet


def write_picture(path: Path, size_px: tuple[int, int] = (64, 48), value: int = 128) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), np.full((size_px[1], size_px[0], 3), value, np.uint8))


def write_coco(folder: Path, objects: list[list[dict[str, Any]]], **changes: Any) -> Path:
    """Write a folder with an annotation file of ``cup`` (7) and ``plate`` (3); one row per object.

    Pictures have the ids 10, 11, ... in the order of the lists.
    """
    for number in range(len(objects)):
        write_picture(folder / f"images/{number}.png", value=60 * number % 256)
    rows = [
        {"id": 100 * number + k, "image_id": 10 + number, "iscrowd": 0, "category_id": 7, **row}
        for number, listed in enumerate(objects)
        for k, row in enumerate(listed)
    ]
    content = {
        "images": [
            {"id": 10 + k, "file_name": f"{k}.png", "width": 64, "height": 48}
            for k in range(len(objects))
        ],
        "categories": [{"id": 7, "name": "cup"}, {"id": 3, "name": "plate"}],
        "annotations": rows,
        **changes,
    }
    path = folder / "annotations/instances_val.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content))
    return path


@pytest.fixture
def drawn_set() -> RealSet:
    """Thirty pictures with up to five boxes of two classes each."""
    rng = np.random.default_rng(5)
    pictures = []
    for number in range(30):
        things = []
        for _ in range(int(rng.integers(0, 6))):
            x, y = rng.uniform(0.0, 400.0, 2)
            w, h = rng.uniform(8.0, 160.0, 2)
            name = str(rng.choice(["cup", "plate"]))
            things.append(RealObject(name, (x, y, x + w, y + h), bool(rng.uniform() < 0.1)))
        pictures.append(RealPicture(number + 1, Path(f"{number}.png"), (640, 480), tuple(things)))
    return RealSet(Path("drawn"), tuple(pictures), {"cup": 1, "plate": 2}, {})


def draw_results(real: RealSet, seed: int) -> list[dict[str, Any]]:
    """Detections near most objects, and false alarms."""
    rng = np.random.default_rng(seed)
    rows = []
    for picture in real.pictures:
        for thing in picture.objects:
            if rng.uniform() < 0.8:
                x0, y0, x1, y1 = np.array(thing.box) + rng.normal(0.0, 5.0, 4)
                box = [x0, y0, max(x1 - x0, 1.0), max(y1 - y0, 1.0)]
                rows.append((picture.image_id, real.category_ids[thing.name], box))
        for _ in range(int(rng.integers(0, 3))):
            box = [*rng.uniform(0.0, 300.0, 2), *rng.uniform(10.0, 90.0, 2)]
            rows.append((picture.image_id, int(rng.integers(1, 3)), box))
    return [
        {
            "image_id": image_id,
            "category_id": category_id,
            "bbox": [float(v) for v in box],
            "score": float(rng.uniform()),
        }
        for image_id, category_id, box in rows
    ]
