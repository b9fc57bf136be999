"""Geodetic coordinates (WGS 84) of a local tangent plane.

WGS 84 as of NIMA TR8350.2. The world is the east-north-up frame at an origin: X east, Y north, Z
up. Geodetic coordinates by Bowring, "Transformation from spatial to geographical coordinates",
Survey Review 23, 1976, iterated; exact to far below a micrometre near the surface.
"""

from dataclasses import dataclass

import numpy as np

from gen_data.core.se3 import Array

EQUATOR_M = 6_378_137.0
FLATTENING = 1.0 / 298.257223563
POLE_M = EQUATOR_M * (1.0 - FLATTENING)
ECCENTRICITY2 = FLATTENING * (2.0 - FLATTENING)
SECOND_ECCENTRICITY2 = ECCENTRICITY2 / (1.0 - ECCENTRICITY2)


@dataclass(frozen=True, slots=True)
class GeodeticOrigin:
    """Geodetic coordinates of the world's origin; altitude above the ellipsoid."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float = 0.0

    def axes(self) -> Array:
        """East, north and up in earth-centred axes, as columns, [3, 3]."""
        lat, lon = np.radians(self.latitude_deg), np.radians(self.longitude_deg)
        sin_lat, cos_lat, sin_lon, cos_lon = np.sin(lat), np.cos(lat), np.sin(lon), np.cos(lon)
        return np.array(
            [
                [-sin_lon, -sin_lat * cos_lon, cos_lat * cos_lon],
                [cos_lon, -sin_lat * sin_lon, cos_lat * sin_lon],
                [0.0, cos_lat, sin_lat],
            ]
        )


def to_geodetic(points_m: Array, origin: GeodeticOrigin) -> Array:
    """Latitude [deg], longitude [deg] and altitude [m] of points of the world, [n, 3]."""
    centre = geodetic_to_ecef(
        np.array([[origin.latitude_deg, origin.longitude_deg, origin.altitude_m]])
    )
    turned = np.einsum("ij,nj->ni", origin.axes(), np.asarray(points_m), optimize=False)
    return ecef_to_geodetic(centre + turned)


def geodetic_to_ecef(places: Array) -> Array:
    """Earth-centred coordinates [m] of latitude [deg], longitude [deg], altitude [m], [n, 3]."""
    lat, lon, altitude_m = np.radians(places[:, 0]), np.radians(places[:, 1]), places[:, 2]
    normal_m = EQUATOR_M / np.sqrt(1.0 - ECCENTRICITY2 * np.sin(lat) ** 2)
    level_m = (normal_m + altitude_m) * np.cos(lat)
    z_m = ((1.0 - ECCENTRICITY2) * normal_m + altitude_m) * np.sin(lat)
    return np.stack([level_m * np.cos(lon), level_m * np.sin(lon), z_m], axis=1)


def ecef_to_geodetic(points_m: Array) -> Array:
    """The inverse of ``geodetic_to_ecef``."""
    x_m, y_m, z_m = points_m.T
    level_m = np.hypot(x_m, y_m)
    reduced = np.arctan2(z_m * EQUATOR_M, level_m * POLE_M)
    lat = reduced
    for _ in range(3):
        lat = np.arctan2(
            z_m + SECOND_ECCENTRICITY2 * POLE_M * np.sin(reduced) ** 3,
            level_m - ECCENTRICITY2 * EQUATOR_M * np.cos(reduced) ** 3,
        )
        reduced = np.arctan2((1.0 - FLATTENING) * np.sin(lat), np.cos(lat))
    sine = np.sin(lat)
    root = np.sqrt(1.0 - ECCENTRICITY2 * sine**2)
    altitude_m = level_m * np.cos(lat) + z_m * sine - EQUATOR_M * root
    return np.stack([np.degrees(lat), np.degrees(np.arctan2(y_m, x_m)), altitude_m], axis=1)
