"""Sensors: how a scene becomes readings."""

from __future__ import annotations

from generator.core.interfaces import Sensor
from generator.core.plugins import PluginTable

TABLE = PluginTable[Sensor](
    "sensor",
    {
        "rgb_camera": "generator.sensors.rgb_camera:RgbCamera",
        "depth_camera": "generator.sensors.depth_camera:DepthCamera",
        "lidar": "generator.sensors.lidar:LidarSensor",
        "imu": "generator.sensors.imu:Imu",
        "event_camera": "generator.sensors.event_camera:EventCamera",
        "gnss": "generator.sensors.gnss:Gnss",
        "odometer": "generator.sensors.odometer:Odometer",
        "radar": "generator.sensors.radar:Radar",
        "watcher": "generator.sensors.watcher:Watcher",
    },
    (Sensor,),
)
