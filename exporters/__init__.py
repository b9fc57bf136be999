"""Output formats: each is one file and one line in this table.

An exporter adds labels to a shard whose images are already written (``exporters.images``) and, in
the end, merges all shards into the format's own layout; images are hard-linked, never copied twice.
"""

from __future__ import annotations

from generator.core.interfaces import Exporter
from generator.core.plugins import PluginTable

TABLE = PluginTable[Exporter](
    "exporter",
    {
        "birdseye": "exporters.birdseye:Birdseye",
        "coco": "exporters.coco:Coco",
        "kitti": "exporters.kitti:Kitti",
        "kitti_raw": "exporters.kitti_raw:KittiRaw",
        "kitti_stereo": "exporters.kitti_stereo:KittiStereo",
        "kitti_tracking": "exporters.kitti_tracking:KittiTracking",
        "motchallenge": "exporters.motchallenge:MotChallenge",
        "pointclouds": "exporters.pointclouds:PointClouds",
        "semantickitti": "exporters.semantickitti:SemanticKitti",
        "tables": "exporters.tables:Tables",
        "usd": "exporters.usd:Usd",
    },
    (Exporter,),
)
