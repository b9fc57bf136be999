"""What laser scans add to the truth about images."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gen_data.generator.core.capture import PointCloud
from gen_data.generator.core.sample import ImageTruth


def count_lidar_points(
    truth: Mapping[str, ImageTruth], clouds: Mapping[str, PointCloud]
) -> Mapping[str, ImageTruth]:
    """The truth with the number of points of every scan on every object."""
    if not clouds:
        return truth
    counts = {name: np.bincount(c.points["instance_id"]) for name, c in sorted(clouds.items())}

    def counted(image: ImageTruth) -> ImageTruth:
        objects = []
        for thing in image.objects:
            k = thing.instance.instance_id
            points = {name: int(n[k]) if k < len(n) else 0 for name, n in counts.items()}
            objects.append(replace(thing, lidar_points=points))
        return replace(image, objects=tuple(objects))

    return {name: counted(image) for name, image in truth.items()}
