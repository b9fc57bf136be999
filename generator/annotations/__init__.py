"""Annotators: exact labels of instances, images and samples, without randomness.

Each annotator is one file and one line in this table; ``annotate`` runs them. Their methods
determine their annotations, see ``gen_data.core.interfaces``.
"""

from gen_data.core.interfaces import (
    Annotator,
    AnyAnnotator,
    CaptureAnnotator,
    FrameAnnotator,
    ImageAnnotator,
    SequenceAnnotator,
)
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[AnyAnnotator](
    "annotation",
    {
        "amodal_masks": "gen_data.annotations.amodal_masks:AmodalMasks",
        "bev_map": "gen_data.annotations.bev_map:BevMap",
        "boxes2d": "gen_data.annotations.boxes2d:Boxes2d",
        "boxes3d": "gen_data.annotations.boxes3d:Boxes3d",
        "detectability": "gen_data.annotations.detectability:Detectability",
        "free_space": "gen_data.annotations.free_space:FreeSpace",
        "grasps": "gen_data.annotations.grasps:Grasps",
        "instance_masks": "gen_data.annotations.instance_masks:InstanceMasks",
        "keypoints": "gen_data.annotations.keypoints:Keypoints",
        "lanes": "gen_data.annotations.lanes:Lanes",
        "language": "gen_data.annotations.language:Language",
        "motion": "gen_data.annotations.motion:Motion",
        "occupancy": "gen_data.annotations.occupancy:VoxelOccupancy",
        "oriented_boxes2d": "gen_data.annotations.oriented_boxes2d:OrientedBoxes2d",
        "part_masks": "gen_data.annotations.part_masks:PartMasks",
        "poses": "gen_data.annotations.poses:Poses",
        "relations": "gen_data.annotations.relations:Relations",
        "semantic_masks": "gen_data.annotations.semantic_masks:SemanticMasks",
        "text": "gen_data.annotations.text:Text",
        "tracks": "gen_data.annotations.tracks:Tracks",
        "visibility": "gen_data.annotations.visibility:Visibility",
    },
    (Annotator, ImageAnnotator, FrameAnnotator, CaptureAnnotator, SequenceAnnotator),
)
