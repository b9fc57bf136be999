"""Output formats: one file and one line in this table each.

An exporter adds labels to shards, after ``gen_data.exporters.image_files`` has written their
images. At the end it merges all shards into the layout of its format; images are hard links.
"""

from __future__ import annotations

from gen_data.generator.core.interfaces import Exporter
from gen_data.generator.core.plugins import PluginTable

TABLE = PluginTable[Exporter](
    "exporter",
    {
        "birdseye": "gen_data.exporters.birdseye:Birdseye",
        "cityscapes": "gen_data.exporters.cityscapes:Cityscapes",
        "coco": "gen_data.exporters.coco:Coco",
        "coco_panoptic": "gen_data.exporters.coco_panoptic:CocoPanoptic",
        "cvat": "gen_data.exporters.cvat:Cvat",
        "kitti": "gen_data.exporters.kitti:Kitti",
        "kitti_raw": "gen_data.exporters.kitti_raw:KittiRaw",
        "kitti_stereo": "gen_data.exporters.kitti_stereo:KittiStereo",
        "kitti_tracking": "gen_data.exporters.kitti_tracking:KittiTracking",
        "motchallenge": "gen_data.exporters.motchallenge:MotChallenge",
        "pointclouds": "gen_data.exporters.pointclouds:PointClouds",
        "semantickitti": "gen_data.exporters.semantickitti:SemanticKitti",
        "tables": "gen_data.exporters.measurement_tables:Tables",
        "usd": "gen_data.exporters.usd:Usd",
        "voc": "gen_data.exporters.voc:Voc",
        "yolo": "gen_data.exporters.yolo:Yolo",
    },
    (Exporter,),
)
