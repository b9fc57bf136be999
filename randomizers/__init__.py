"""What varies from scene to scene and from view to view."""

from __future__ import annotations

from generator.core.plugins import PluginTable

TABLE = PluginTable(
    "randomizer",
    {
        "arm_configuration": "randomizers.arm_configuration:ArmConfiguration",
        "backdrop": "randomizers.backdrop:Backdrop",
        "camera_intrinsics": "randomizers.camera_intrinsics:CameraIntrinsics",
        "camera_pose": "randomizers.camera_pose:CameraPose",
        "colors": "randomizers.colors:Colors",
        "distractors": "randomizers.distractors:Distractors",
        "environment": "randomizers.environment:EnvironmentLight",
        "exposure": "randomizers.exposure:Exposure",
        "lighting": "randomizers.lighting:Lighting",
        "materials": "randomizers.materials:Materials",
        "objects": "randomizers.objects:Objects",
        "physics_properties": "randomizers.physics_properties:PhysicsProperties",
        "textures": "randomizers.textures:Textures",
        "traffic_lights": "randomizers.traffic_lights:TrafficLights",
    },
)
