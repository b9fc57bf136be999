"""Output formats: one file and one line in this table each.

An exporter adds labels to shards, after ``gen_data.exporters.image_files`` has written their
images. At the end it merges all shards into the layout of its format; images are hard links.
"""

from gen_data.core.interfaces import Exporter
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[Exporter](
    "exporter",
    {
        "argoverse2": "gen_data.exporters.argoverse2:Argoverse2",
        "birdseye": "gen_data.exporters.birdseye:Birdseye",
        "bop": "gen_data.exporters.bop:Bop",
        "calibration": "gen_data.exporters.calibration:CalibrationFiles",
        "cityscapes": "gen_data.exporters.cityscapes:Cityscapes",
        "coco": "gen_data.exporters.coco:Coco",
        "coco_panoptic": "gen_data.exporters.coco_panoptic:CocoPanoptic",
        "control_clips": "gen_data.exporters.control_clips:ControlClips",
        "croissant": "gen_data.exporters.croissant:Croissant",
        "culane": "gen_data.exporters.culane:CULane",
        "cvat": "gen_data.exporters.cvat:Cvat",
        "dota": "gen_data.exporters.dota:Dota",
        "graspnet": "gen_data.exporters.graspnet:GraspNet",
        "hdf5": "gen_data.exporters.hdf5:Hdf5",
        "huggingface": "gen_data.exporters.huggingface:HuggingFace",
        "kitti": "gen_data.exporters.kitti:Kitti",
        "kitti_raw": "gen_data.exporters.kitti_raw:KittiRaw",
        "kitti_stereo": "gen_data.exporters.kitti_stereo:KittiStereo",
        "kitti_tracking": "gen_data.exporters.kitti_tracking:KittiTracking",
        "label_studio": "gen_data.exporters.label_studio:LabelStudio",
        "language": "gen_data.exporters.language:LanguageJsonl",
        "lerobot": "gen_data.exporters.lerobot:LeRobot",
        "lidar_flow": "gen_data.exporters.lidar_flow:LidarFlow",
        "map_vectors": "gen_data.exporters.map_vectors:MapVectors",
        "mcap": "gen_data.exporters.mcap:Mcap",
        "motchallenge": "gen_data.exporters.motchallenge:MotChallenge",
        "nuscenes": "gen_data.exporters.nuscenes:NuScenes",
        "occupancy": "gen_data.exporters.occupancy:OccupancyGrids",
        "opendrive": "gen_data.exporters.opendrive:OpenDrive",
        "openlane": "gen_data.exporters.openlane:OpenLane",
        "pointclouds": "gen_data.exporters.pointclouds:PointClouds",
        "rerun": "gen_data.exporters.rerun:Rerun",
        "scannet": "gen_data.exporters.scannet:ScanNet",
        "scene_text": "gen_data.exporters.scene_text:SceneText",
        "semantickitti": "gen_data.exporters.semantickitti:SemanticKitti",
        "solo": "gen_data.exporters.solo:Solo",
        "tables": "gen_data.exporters.measurement_tables:Tables",
        "rlds": "gen_data.exporters.rlds:Rlds",
        "tapvid": "gen_data.exporters.tapvid:TapVid",
        "tfrecord": "gen_data.exporters.tfrecord:TfRecord",
        "tum_rgbd": "gen_data.exporters.tum_rgbd:TumRgbd",
        "usd": "gen_data.exporters.usd:Usd",
        "voc": "gen_data.exporters.voc:Voc",
        "webdataset": "gen_data.exporters.webdataset:WebDataset",
        "yolo": "gen_data.exporters.yolo:Yolo",
    },
    (Exporter,),
)
