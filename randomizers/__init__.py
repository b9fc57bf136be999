"""Randomizers: plug-ins that vary a scene from index to index, per scene or per view."""

from __future__ import annotations

from gen_data.core.interfaces import Randomizer
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[Randomizer](
    "randomizer",
    {
        "lane_objects": "gen_data.randomizers.lane_objects:LaneObjects",
        "arm_configuration": "gen_data.randomizers.arm_configuration:ArmConfiguration",
        "arm_motion": "gen_data.randomizers.arm_motion:ArmMotion",
        "arm_task": "gen_data.randomizers.arm_task:ArmTask",
        "backdrop": "gen_data.randomizers.backdrop:Backdrop",
        "camera_intrinsics": "gen_data.randomizers.camera_intrinsics:CameraIntrinsics",
        "camera_on_lane": "gen_data.randomizers.camera_on_lane:CameraOnLane",
        "camera_pose": "gen_data.randomizers.camera_pose:CameraPose",
        "ceiling_camera": "gen_data.randomizers.ceiling_camera:CeilingCamera",
        "ceiling_lights": "gen_data.randomizers.ceiling_lights:CeilingLights",
        "colors": "gen_data.randomizers.colors:Colors",
        "companions": "gen_data.randomizers.companions:Companions",
        "distractors": "gen_data.randomizers.distractors:Distractors",
        "door_paths": "gen_data.randomizers.door_paths:DoorPaths",
        "drone_flight": "gen_data.randomizers.drone_flight:DroneFlight",
        "ego_on_lane": "gen_data.randomizers.ego_on_lane:EgoOnLane",
        "environment": "gen_data.randomizers.environment:EnvironmentLight",
        "exposure": "gen_data.randomizers.exposure:Exposure",
        "furnish": "gen_data.randomizers.furnish:Furnish",
        "lighting": "gen_data.randomizers.lighting:Lighting",
        "object_states": "gen_data.randomizers.object_states:ObjectStates",
        "room_camera": "gen_data.randomizers.room_camera:RoomCamera",
        "room_path": "gen_data.randomizers.room_path:RoomPath",
        "room_lighting": "gen_data.randomizers.room_lighting:RoomLighting",
        "materials": "gen_data.randomizers.materials:Materials",
        "objects": "gen_data.randomizers.objects:Objects",
        "physics_properties": "gen_data.randomizers.physics_properties:PhysicsProperties",
        "plate": "gen_data.randomizers.plate:PhotoPlate",
        "reaching_hand": "gen_data.randomizers.reaching_hand:ReachingHand",
        "rig_calibration": "gen_data.randomizers.rig_calibration:RigCalibration",
        "street_lights": "gen_data.randomizers.street_lights:StreetLights",
        "textures": "gen_data.randomizers.textures:Textures",
        "time_of_day": "gen_data.randomizers.time_of_day:TimeOfDay",
        "traffic_flow": "gen_data.randomizers.traffic_flow:TrafficFlow",
        "umbrellas": "gen_data.randomizers.umbrellas:Umbrellas",
        "vehicle_lights": "gen_data.randomizers.vehicle_lights:VehicleLights",
        "vehicle_paint": "gen_data.randomizers.vehicle_paint:VehiclePaint",
        "weather": "gen_data.randomizers.weather:Weather",
        "traffic_lights": "gen_data.randomizers.traffic_lights:TrafficLights",
    },
    (Randomizer,),
)
