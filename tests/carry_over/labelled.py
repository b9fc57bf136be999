"""Labelled folders that are drawn without a renderer."""

import json
from pathlib import Path

import cv2
import numpy as np

WIDTH_PX, HEIGHT_PX = 128, 96


def write_coco(
    folder: Path,
    seed: int,
    *,
    pictures: int = 20,
    scale: float = 1.0,
    most: int = 4,
    exposure: float = 1.0,
    names: tuple[str, ...] = ("cup", "plate"),
) -> Path:
    """Pictures of grey noise with boxes, at most ``most`` of each class; ``scale`` their sides."""
    rng = np.random.default_rng(seed)
    rows = []
    (folder / "images").mkdir(parents=True, exist_ok=True)
    (folder / "annotations").mkdir(exist_ok=True)
    for number in range(pictures):
        grey = rng.uniform(30, 80) + rng.normal(0, 25, (HEIGHT_PX, WIDTH_PX))
        pixels = np.clip(grey * exposure, 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"images/{number}.png"), cv2.merge([pixels] * 3))
        for category in range(len(names)):
            for _ in range(int(rng.integers(1, most + 1))):
                x, y = rng.uniform(0, 60), rng.uniform(0, 40)
                w, h = scale * rng.uniform(10, 30, 2) * (1 + category)
                rows.append((number, category, [x, y, min(w, WIDTH_PX - x), min(h, HEIGHT_PX - y)]))
    content = {
        "images": [
            {"id": k, "file_name": f"{k}.png", "width": WIDTH_PX, "height": HEIGHT_PX}
            for k in range(pictures)
        ],
        "categories": [{"id": k, "name": name} for k, name in enumerate(names)],
        "annotations": [
            {"id": k, "image_id": i, "category_id": c, "bbox": box, "area": box[2] * box[3]}
            for k, (i, c, box) in enumerate(rows)
        ],
    }
    (folder / "annotations/instances_all.json").write_text(json.dumps(content))
    return folder
