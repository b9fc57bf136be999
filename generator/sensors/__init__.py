"""Sensors: cameras, laser scanners, radars and other devices that read a scene."""

from __future__ import annotations

from gen_data.generator.core.interfaces import Sensor
from gen_data.generator.core.plugins import PluginTable

TABLE = PluginTable[Sensor](
    "sensor",
    {
        "rgb_camera": "gen_data.generator.sensors.camera.rgb_camera:RgbCamera",
        "plate_camera": "gen_data.generator.sensors.camera.plate_camera:PlateCamera",
        "depth_camera": "gen_data.generator.sensors.depth.depth_camera:DepthCamera",
        "lidar": "gen_data.generator.sensors.lidar.lidar_sensor:LidarSensor",
        "pseudo_lidar": "gen_data.generator.sensors.lidar.pseudo_lidar:PseudoLidar",
        "imu": "gen_data.generator.sensors.navigation.imu:Imu",
        "event_camera": "gen_data.generator.sensors.event_camera.event_camera:EventCamera",
        "gnss": "gen_data.generator.sensors.navigation.gnss:Gnss",
        "odometer": "gen_data.generator.sensors.navigation.odometer:Odometer",
        "radar": "gen_data.generator.sensors.radar.radar_sensor:Radar",
        "watcher": "gen_data.generator.sensors.events.event_detector:EventDetector",
    },
    (Sensor,),
)
