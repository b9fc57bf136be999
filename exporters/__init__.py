"""Output formats: each is one file and one line in this table.

An exporter adds labels to a shard whose images are already written
(``gen_data.exporters.image_files``) and, in the end, merges all shards into the format's own
layout; images are hard-linked, never copied twice.
"""

from __future__ import annotations

from gen_data.generator.core.interfaces import Exporter
from gen_data.generator.core.plugins import PluginTable

TABLE = PluginTable[Exporter](
    "exporter",
    {
        "birdseye": "gen_data.exporters.birdseye:Birdseye",
        "coco": "gen_data.exporters.coco:Coco",
        "kitti": "gen_data.exporters.kitti:Kitti",
        "kitti_raw": "gen_data.exporters.kitti_raw:KittiRaw",
        "kitti_stereo": "gen_data.exporters.kitti_stereo:KittiStereo",
        "kitti_tracking": "gen_data.exporters.kitti_tracking:KittiTracking",
        "motchallenge": "gen_data.exporters.motchallenge:MotChallenge",
        "pointclouds": "gen_data.exporters.pointclouds:PointClouds",
        "semantickitti": "gen_data.exporters.semantickitti:SemanticKitti",
        "tables": "gen_data.exporters.measurement_tables:Tables",
        "usd": "gen_data.exporters.usd:Usd",
    },
    (Exporter,),
)
