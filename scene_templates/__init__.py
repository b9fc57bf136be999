"""Declarative scenes: YAML templates, and the element types they are made of."""

from __future__ import annotations

from generator.core.interfaces import Element
from generator.core.plugins import PluginTable

TABLE = PluginTable[Element](
    "element",
    {
        "lane_objects": "scene_templates.along:Along",
        "backdrop": "scene_templates.backdrop:Backdrop",
        "bin": "scene_templates.bin:Bin",
        "crosswalk": "scene_templates.crosswalk:Crosswalk",
        "ego": "scene_templates.ego:Ego",
        "ground": "scene_templates.ground:GroundElement",
        "junction": "scene_templates.junction:Junction",
        "light": "scene_templates.light:LightElement",
        "objects": "scene_templates.objects:Objects",
        "parking_area": "scene_templates.parking_area:ParkingArea",
        "prop": "scene_templates.prop:Prop",
        "road": "scene_templates.road:Road",
        "road_network": "scene_templates.road_network:RoadNetwork",
        "robot": "scene_templates.robot:Robot",
        "room": "scene_templates.room:Room",
        "shelf": "scene_templates.shelf:Shelf",
        "signals": "scene_templates.signals:Signals",
        "surface": "scene_templates.surface:SurfaceElement",
        "usd_stage": "scene_templates.usd_stage:UsdStage",
    },
    (Element,),
)
