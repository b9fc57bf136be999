"""Truth about instances in images, about images and about samples: exact, without randomness.

Each annotator is one file and one line in this table. ``truth`` runs them: what an annotator is
about, its methods say (``generator.core.interfaces``).
"""

from __future__ import annotations

from generator.core.interfaces import (
    Annotator,
    AnyAnnotator,
    FrameAnnotator,
    ImageAnnotator,
)
from generator.core.plugins import PluginTable

TABLE = PluginTable[AnyAnnotator](
    "annotation",
    {
        "amodal_masks": "generator.annotations.amodal_masks:AmodalMasks",
        "bev_map": "generator.annotations.bev_map:BevMap",
        "boxes2d": "generator.annotations.boxes2d:Boxes2d",
        "boxes3d": "generator.annotations.boxes3d:Boxes3d",
        "free_space": "generator.annotations.free_space:FreeSpace",
        "instance_masks": "generator.annotations.instance_masks:InstanceMasks",
        "keypoints": "generator.annotations.keypoints:Keypoints",
        "lanes": "generator.annotations.lanes:Lanes",
        "motion": "generator.annotations.motion:Motion",
        "part_masks": "generator.annotations.part_masks:PartMasks",
        "poses": "generator.annotations.poses:Poses",
        "semantic_masks": "generator.annotations.semantic_masks:SemanticMasks",
        "visibility": "generator.annotations.visibility:Visibility",
    },
    (Annotator, ImageAnnotator, FrameAnnotator),
)
