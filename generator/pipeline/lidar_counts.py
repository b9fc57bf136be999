"""Numbers of laser points on the objects of images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gen_data.generator.core.capture import PointCloud
from gen_data.generator.core.sample import ImageTruth


def count_lidar_points(
    truth: Mapping[str, ImageTruth], clouds: Mapping[str, PointCloud]
) -> Mapping[str, ImageTruth]:
    """Add to each object its number of points in every scan."""
    if not clouds:
        return truth
    counts = {name: np.bincount(c.points["instance_id"]) for name, c in sorted(clouds.items())}

    def add_counts(image: ImageTruth) -> ImageTruth:
        objects = []
        for item in image.objects:
            k = item.instance.instance_id
            points = {name: int(n[k]) if k < len(n) else 0 for name, n in counts.items()}
            objects.append(replace(item, lidar_points=points))
        return replace(image, objects=tuple(objects))

    return {name: add_counts(image) for name, image in truth.items()}
