"""Truth about every instance in an image: exact, from ids and silhouettes, without randomness.

Each annotator is one file and one line in this table. ``truth.image_truth`` runs them.
"""

from __future__ import annotations

from generator.core.plugins import PluginTable

TABLE = PluginTable(
    "annotation",
    {
        "amodal_masks": "generator.annotations.amodal_masks:AmodalMasks",
        "boxes2d": "generator.annotations.boxes2d:Boxes2d",
        "boxes3d": "generator.annotations.boxes3d:Boxes3d",
        "instance_masks": "generator.annotations.instance_masks:InstanceMasks",
        "keypoints": "generator.annotations.keypoints:Keypoints",
        "part_masks": "generator.annotations.part_masks:PartMasks",
        "poses": "generator.annotations.poses:Poses",
        "semantic_masks": "generator.annotations.semantic_masks:SemanticMasks",
        "visibility": "generator.annotations.visibility:Visibility",
    },
)
