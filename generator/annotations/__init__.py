"""Annotators: exact labels of instances, images and samples, without randomness.

Each annotator is one file and one line in this table; ``annotate`` runs them. Their methods
determine what they annotate, see ``gen_data.generator.core.interfaces``.
"""

from __future__ import annotations

from gen_data.generator.core.interfaces import (
    Annotator,
    AnyAnnotator,
    FrameAnnotator,
    ImageAnnotator,
)
from gen_data.generator.core.plugins import PluginTable

TABLE = PluginTable[AnyAnnotator](
    "annotation",
    {
        "amodal_masks": "gen_data.generator.annotations.amodal_masks:AmodalMasks",
        "bev_map": "gen_data.generator.annotations.bev_map:BevMap",
        "boxes2d": "gen_data.generator.annotations.boxes2d:Boxes2d",
        "boxes3d": "gen_data.generator.annotations.boxes3d:Boxes3d",
        "free_space": "gen_data.generator.annotations.free_space:FreeSpace",
        "grasps": "gen_data.generator.annotations.grasps:Grasps",
        "instance_masks": "gen_data.generator.annotations.instance_masks:InstanceMasks",
        "keypoints": "gen_data.generator.annotations.keypoints:Keypoints",
        "lanes": "gen_data.generator.annotations.lanes:Lanes",
        "language": "gen_data.generator.annotations.language:Language",
        "motion": "gen_data.generator.annotations.motion:Motion",
        "oriented_boxes2d": "gen_data.generator.annotations.oriented_boxes2d:OrientedBoxes2d",
        "part_masks": "gen_data.generator.annotations.part_masks:PartMasks",
        "poses": "gen_data.generator.annotations.poses:Poses",
        "relations": "gen_data.generator.annotations.relations:Relations",
        "semantic_masks": "gen_data.generator.annotations.semantic_masks:SemanticMasks",
        "visibility": "gen_data.generator.annotations.visibility:Visibility",
    },
    (Annotator, ImageAnnotator, FrameAnnotator),
)
