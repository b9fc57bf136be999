"""Columns of devices' measurements: the dtypes of ``Measurements.rows``.

Every table has a ``time_s``, in seconds from the beginning of the sequence. Axes are those of the
device, X forward, Y left, Z up, unless the name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

TIME_DECIMALS = 9
"""Decimals of instants: sums of different terms give the same instant."""


@dataclass(frozen=True, slots=True)
class Column:
    """One quantity of a table.

    Attributes:
        name: With its unit at the end.
        type: Of the stored number, as numpy spells it, little-endian.
        meaning: In a few words; value for "nothing".
    """

    name: str
    type: str
    meaning: str


TIME = Column("time_s", "<f8", "since the beginning of the sequence")

RADAR = (
    TIME,
    Column("range_m", "<f4", "distance from the radar"),
    Column("azimuth_rad", "<f4", "to the left of its axis"),
    Column("elevation_rad", "<f4", "above its axis; 0 where the device cannot tell"),
    Column("velocity_m_s", "<f4", "radial, relative to the radar; positive = receding"),
    Column("velocity_compensated_m_s", "<f4", "the same without the radar's own motion"),
    Column("rcs_dbsm", "<f4", "radar cross section as measured, fluctuation included"),
    Column("snr_db", "<f4", "signal over noise"),
    Column("instance_id", "<u2", "what sent most of it back; 0 = unlabelled or noise"),
    Column("category_id", "<u2", "of that instance; 0"),
    Column("origin", "|u1", "0 false alarm, 1 a thing with an instance id, 2 ground and the like"),
)

IMU = (
    TIME,
    Column("force_x_m_s2", "<f8", "specific force forward: acceleration minus gravity"),
    Column("force_y_m_s2", "<f8", "to the left"),
    Column("force_z_m_s2", "<f8", "upward; 9.8 at rest"),
    Column("rate_x_rad_s", "<f8", "angular rate about the forward axis"),
    Column("rate_y_rad_s", "<f8", "about the left axis"),
    Column("rate_z_rad_s", "<f8", "about the upward axis"),
)

GNSS = (
    TIME,
    Column("latitude_deg", "<f8", "WGS 84; NaN without a fix"),
    Column("longitude_deg", "<f8", "WGS 84; NaN"),
    Column("altitude_m", "<f8", "above the ellipsoid; NaN"),
    Column("velocity_east_m_s", "<f4", "NaN without a fix"),
    Column("velocity_north_m_s", "<f4", "NaN"),
    Column("velocity_up_m_s", "<f4", "NaN"),
    Column("horizontal_sigma_m", "<f4", "standard deviation of the position, per axis; NaN"),
    Column("vertical_sigma_m", "<f4", "standard deviation of the altitude; NaN"),
    Column("satellites", "|u1", "in sight"),
    Column("quality", "|u1", "as in NMEA GGA: 0 no fix, 1 alone, 2 differential, 4 RTK, 5 float"),
)

ODOMETER = (
    TIME,
    Column("distance_m", "<f8", "travelled since the beginning; backwards counts down"),
    Column("speed_m_s", "<f4", "forward"),
    Column("yaw_rate_rad_s", "<f4", "to the left"),
    Column("steering_rad", "<f4", "of the front wheels, to the left; 0 below walking pace"),
    Column("wheel_rear_left_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_rear_right_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_front_left_m_s", "<f4", "speed of the wheel's rim"),
    Column("wheel_front_right_m_s", "<f4", "speed of the wheel's rim"),
)

OCCURRENCES = ("collision", "lane_invasion", "obstacle", "traffic_light", "proximity")
"""Events that a watcher (event detector) reports, by index."""

LIGHT_STATES = ("dark", "red", "red_yellow", "yellow", "green")
"""``value`` of the occurrence ``traffic_light``, by number."""

WATCHER = (
    TIME,
    Column(
        "occurrence",
        "|u1",
        "0 collision, 1 lane_invasion, 2 obstacle, 3 traffic_light, 4 proximity",
    ),
    Column("instance_id", "<u2", "the other thing; 0 = none"),
    Column(
        "value",
        "<f4",
        "collision: speed against each other [m/s]; lane_invasion: 1 = the line to the left, -1 ="
        " to the right; obstacle, proximity: distance [m]; traffic_light: 0 dark, 1 red, 2 red and"
        " yellow, 3 yellow, 4 green",
    ),
)

EVENT_CAMERA = (
    TIME,
    Column("x_px", "<u2", "column of the pixel"),
    Column("y_px", "<u2", "row of the pixel"),
    Column("polarity", "|i1", "1 brighter, -1 darker"),
    Column("instance_id", "<u2", "what the pixel shows at the nearest frame; 0"),
)

TABLE_COLUMNS: Mapping[str, tuple[Column, ...]] = {
    "radar": RADAR,
    "imu": IMU,
    "gnss": GNSS,
    "odometer": ODOMETER,
    "watcher": WATCHER,
    "event_camera": EVENT_CAMERA,
}
"""Columns by ``Device.kind``."""


def table_dtype(kind: str) -> np.dtype[np.void]:
    """The type of the rows of one kind of device; KeyError if there is no such kind."""
    return columns_dtype(TABLE_COLUMNS[kind])


def columns_dtype(columns: Sequence[Column]) -> np.dtype[np.void]:
    """Type of a row with these columns."""
    return np.dtype([(column.name, column.type) for column in columns])


def table_rows(kind: str, count: int, /, **columns: ArrayLike) -> NDArray[np.void]:
    """Rows of a table of a kind of device.

    Columns hold one value per row, or one for all; those that are not given are 0.
    """
    rows: NDArray[Any] = np.zeros(count, table_dtype(kind))
    for name, values in columns.items():
        rows[name] = values
    rows["time_s"] = np.round(rows["time_s"], TIME_DECIMALS)
    return rows
