"""Sensors: cameras, laser scanners, radars and other devices that read a scene."""

from gen_data.core.interfaces import Sensor
from gen_data.core.plugins import PluginTable

TABLE = PluginTable[Sensor](
    "sensor",
    {
        "rgb_camera": "gen_data.sensors.camera.rgb_camera:RgbCamera",
        "plate_camera": "gen_data.sensors.camera.plate_camera:PlateCamera",
        "depth_camera": "gen_data.sensors.depth.depth_camera:DepthCamera",
        "lidar": "gen_data.sensors.lidar.lidar_sensor:LidarSensor",
        "pseudo_lidar": "gen_data.sensors.lidar.pseudo_lidar:PseudoLidar",
        "imu": "gen_data.sensors.navigation.imu:Imu",
        "event_camera": "gen_data.sensors.event_camera.event_camera:EventCamera",
        "gnss": "gen_data.sensors.navigation.gnss:Gnss",
        "odometer": "gen_data.sensors.navigation.odometer:Odometer",
        "radar": "gen_data.sensors.radar.radar_sensor:Radar",
        "watcher": "gen_data.sensors.events.event_detector:EventDetector",
    },
    (Sensor,),
)
