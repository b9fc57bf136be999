"""What varies from scene to scene and from view to view."""

from __future__ import annotations

from generator.core.interfaces import Randomizer
from generator.core.plugins import PluginTable

TABLE = PluginTable[Randomizer](
    "randomizer",
    {
        "lane_objects": "randomizers.along:Along",
        "arm_configuration": "randomizers.arm_configuration:ArmConfiguration",
        "arm_motion": "randomizers.arm_motion:ArmMotion",
        "backdrop": "randomizers.backdrop:Backdrop",
        "camera_intrinsics": "randomizers.camera_intrinsics:CameraIntrinsics",
        "camera_on_lane": "randomizers.camera_on_lane:CameraOnLane",
        "camera_pose": "randomizers.camera_pose:CameraPose",
        "ceiling_lights": "randomizers.ceiling_lights:CeilingLights",
        "colors": "randomizers.colors:Colors",
        "distractors": "randomizers.distractors:Distractors",
        "ego_on_lane": "randomizers.ego_on_lane:EgoOnLane",
        "environment": "randomizers.environment:EnvironmentLight",
        "exposure": "randomizers.exposure:Exposure",
        "lighting": "randomizers.lighting:Lighting",
        "materials": "randomizers.materials:Materials",
        "objects": "randomizers.objects:Objects",
        "physics_properties": "randomizers.physics_properties:PhysicsProperties",
        "rig_calibration": "randomizers.rig_calibration:RigCalibration",
        "street_lights": "randomizers.street_lights:StreetLights",
        "textures": "randomizers.textures:Textures",
        "time_of_day": "randomizers.time_of_day:TimeOfDay",
        "traffic_flow": "randomizers.traffic_flow:TrafficFlow",
        "vehicle_lights": "randomizers.vehicle_lights:VehicleLights",
        "vehicle_paint": "randomizers.vehicle_paint:VehiclePaint",
        "weather": "randomizers.weather:Weather",
        "traffic_lights": "randomizers.traffic_lights:TrafficLights",
    },
    (Randomizer,),
)
