"""Scene templates: YAML files, and the element types that they consist of."""

from __future__ import annotations

from gen_data.core.interfaces import Element
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[Element](
    "element",
    {
        "lane_objects": "gen_data.scene_templates.lane_objects:LaneObjects",
        "backdrop": "gen_data.scene_templates.backdrop:Backdrop",
        "bin": "gen_data.scene_templates.bin:Bin",
        "carrier": "gen_data.scene_templates.carrier:Carrier",
        "crosswalk": "gen_data.scene_templates.crosswalk:Crosswalk",
        "drone": "gen_data.scene_templates.drone:Drone",
        "ego": "gen_data.scene_templates.ego:Ego",
        "fields": "gen_data.scene_templates.fields:Fields",
        "ground": "gen_data.scene_templates.ground:GroundElement",
        "horizon": "gen_data.scene_templates.horizon:Horizon",
        "junction": "gen_data.scene_templates.junction:Junction",
        "level_crossing": "gen_data.scene_templates.level_crossing:LevelCrossing",
        "light": "gen_data.scene_templates.light:LightElement",
        "objects": "gen_data.scene_templates.objects:Objects",
        "overpass": "gen_data.scene_templates.overpass:Overpass",
        "parking_area": "gen_data.scene_templates.parking_area:ParkingArea",
        "petrol_station": "gen_data.scene_templates.petrol_station:PetrolStation",
        "plate": "gen_data.scene_templates.plate:PlateElement",
        "power_line": "gen_data.scene_templates.power_line:PowerLine",
        "prop": "gen_data.scene_templates.prop:Prop",
        "road": "gen_data.scene_templates.road:Road",
        "road_marking": "gen_data.scene_templates.road_marking:RoadMarking",
        "road_network": "gen_data.scene_templates.road_network:RoadNetwork",
        "robot": "gen_data.scene_templates.robot:Robot",
        "roundabout": "gen_data.scene_templates.roundabout:Roundabout",
        "room": "gen_data.scene_templates.room:Room",
        "room_layout": "gen_data.scene_templates.room_layout:RoomLayout",
        "shelf": "gen_data.scene_templates.shelf:Shelf",
        "signals": "gen_data.scene_templates.signals:Signals",
        "square": "gen_data.scene_templates.square:Square",
        "stand": "gen_data.scene_templates.stand:Stand",
        "surface": "gen_data.scene_templates.surface:SurfaceElement",
        "tram_line": "gen_data.scene_templates.tram_line:TramLine",
        "usd_stage": "gen_data.scene_templates.usd_stage:UsdStage",
    },
    (Element,),
)
