"""Illuminance by sun and sky.

Altitudes are the sun's over the horizon [rad]; ``cloudiness`` runs from 0 (clear) over 0.5 (broken
clouds) to 1 (overcast); ``turbidity`` is Linke's and Preetham's: 2 very clear, 6 hazy.

Sources: IES RP-21, "Calculation of daylight availability", 1984 (sun and skies by day); Janiczek
and DeYoung, "Computer programs for sun and moon illuminance", US Naval Observatory Circular 171,
1987 (twilight); Kyba et al., "Cloud coverage acts as an amplifier for ecological light pollution
in urban ecosystems", PLoS ONE 6, 2011 (nights of a city); Kasten and Young, Applied Optics 28,
1989 (air mass); Preetham et al., "A practical analytic model for daylight", SIGGRAPH 1999
(extinction by colour).
"""

import math

import numpy as np

from gen_data.core import colorimetry, se3

SOLAR_ILLUMINANCE_LUX = 127_500.0
"""Outside the atmosphere, on a surface that faces the sun (IES RP-21)."""
CLEAR_TURBIDITY = 2.5
"""At which the clear atmosphere has the extinction of IES RP-21."""

_EXTINCTION_CLEAR, _EXTINCTION_BROKEN = 0.21, 0.80
# Horizontal illuminance of the sky: constant and factor on a power of the sine of the altitude.
_CLEAR, _BROKEN, _OVERCAST = (800.0, 15_500.0, 0.5), (300.0, 45_000.0, 1.0), (300.0, 21_000.0, 1.0)
# Lower end [deg] and coefficients of log10 of the illuminance over altitude / 90 deg.
_TWILIGHT = ((-0.8, (2.88, 22.26, -207.64, 1034.30)), (-5.0, (2.88, 21.81, -258.11, -858.36)),
             (-12.0, (2.70, 12.17, -431.69, -1899.83)),
             (-18.0, (13.84, 262.72, 1447.42, 2797.93)))  # fmt: skip
_SUNSET_DEG = -0.8
# Of a city's sky without moon; clouds throw ten times as much light back (Kyba et al. 2011).
_NIGHT_LUX, _NIGHT_OVERCAST_LUX = 0.03, 0.3
# Wavelengths of the sun's colour [um], and its colour outside the atmosphere.
_WAVELENGTHS_UM = (0.610, 0.550, 0.465)
_SOLAR_COLOR = (1.07, 0.985, 0.90)
# 0.35 cm of ozone, which takes 0.1 per cm at 555 nm (Preetham 1999, A.1).
_OZONE_DEPTH = 0.035


def air_mass(altitude_rad: float) -> float:
    """Length of the sun's way through the atmosphere, relative to the zenith's."""
    altitude_deg = max(math.degrees(altitude_rad), -1.0)
    return float(1.0 / (math.sin(altitude_rad) + 0.50572 * (altitude_deg + 6.07995) ** -1.6364))


def sun_illuminance_lux(
    altitude_rad: float, turbidity: float = CLEAR_TURBIDITY, cloudiness: float = 0.0
) -> float:
    """Of the sun alone, on a surface that faces it [lx]; 0 once it has set or clouds hide it."""
    if math.degrees(altitude_rad) <= _SUNSET_DEG:
        return 0.0
    clear = _EXTINCTION_CLEAR * turbidity / CLEAR_TURBIDITY
    veil = min(cloudiness / 0.5, 1.0) * (_EXTINCTION_BROKEN - _EXTINCTION_CLEAR)
    reach = math.exp(-(clear + veil) * air_mass(max(altitude_rad, 0.0)))
    # The disc sinks from a quarter of a degree above the horizon to the refracted one below.
    rim = _step(math.radians(_SUNSET_DEG), math.radians(0.25), altitude_rad)
    return SOLAR_ILLUMINANCE_LUX * reach * rim * (1.0 - _step(0.5, 0.85, cloudiness))


def sun_color(altitude_rad: float, turbidity: float = CLEAR_TURBIDITY) -> se3.Vec3:
    """Linear RGB of the sun's light at the ground, luminance 1."""
    mass = air_mass(max(altitude_rad, 0.0))
    aerosol = _aerosol(turbidity)
    rgb = []
    for wavelength_um, outside in zip(_WAVELENGTHS_UM, _SOLAR_COLOR, strict=True):
        rayleigh = math.exp(-0.008735 * wavelength_um**-4.08 * mass)
        rgb.append(outside * rayleigh * math.exp(-aerosol * wavelength_um**-1.3 * mass))
    relative = float(colorimetry.luminance(np.array(rgb)))
    red, green, blue = (round(part / relative, 6) for part in rgb)
    return (red, green, blue)


def preetham_sun_lux(altitude_rad: float, turbidity: float) -> float:
    """Of the sun alone in clear air, on a surface that faces it [lx]; 0 below the horizon.

    Preetham 1999, A.1: extinction by air, aerosol and ozone, at the wavelength to which the eye is
    most sensitive.
    """
    if altitude_rad <= 0.0:
        return 0.0
    mass, wavelength_um = air_mass(altitude_rad), 0.555
    depth = 0.008735 * wavelength_um**-4.08 + _aerosol(turbidity) * wavelength_um**-1.3
    return float(SOLAR_ILLUMINANCE_LUX * math.exp(-(depth + _OZONE_DEPTH) * mass))


def preetham_zenith_cd_m2(altitude_rad: float, turbidity: float) -> float:
    """Luminance of the clear sky's zenith; Preetham 1999, A.2, after Karayel et al. 1984."""
    chi = (4.0 / 9.0 - turbidity / 120.0) * (2.0 * altitude_rad)
    slope = 4.0453 * turbidity - 4.9710
    return 1e3 * (slope * math.tan(chi) - 0.2155 * turbidity + 2.4192)


def sun_radius_rad(cloudiness: float = 0.0) -> float:
    """Angular radius of the sun as a light source; thin cloud enlarges it."""
    return math.radians(0.266 + 4.0 * _step(0.2, 0.85, cloudiness))


def sky_illuminance_lux(altitude_rad: float, cloudiness: float = 0.0) -> float:
    """Of the sky without the sun, on level ground [lx]."""
    day = [_day_lux(kind, max(altitude_rad, 0.0)) for kind in (_CLEAR, _BROKEN, _OVERCAST)]
    if cloudiness < 0.5:
        lux = day[0] + (day[1] - day[0]) * 2.0 * cloudiness
    else:
        lux = day[1] + (day[2] - day[1]) * (2.0 * cloudiness - 1.0)
    return lux * _afterglow(altitude_rad) + night_illuminance_lux(cloudiness)


def night_illuminance_lux(cloudiness: float = 0.0) -> float:
    """Of a city's sky long after sunset, on level ground [lx]."""
    return float(_NIGHT_LUX * (_NIGHT_OVERCAST_LUX / _NIGHT_LUX) ** cloudiness)


def _aerosol(turbidity: float) -> float:
    """Angstrom's coefficient (Preetham 1999, A.1)."""
    return max(0.04608 * turbidity - 0.04586, 0.0)


def _day_lux(kind: tuple[float, float, float], altitude_rad: float) -> float:
    constant, factor, power = kind
    return float(constant + factor * math.sin(altitude_rad) ** power)


def _afterglow(altitude_rad: float) -> float:
    """Light of the sky relative to that at sunrise; 1 by day."""
    altitude_deg = math.degrees(altitude_rad)
    if altitude_deg >= 0.0:
        return 1.0
    x = max(altitude_deg, -18.0) / 90.0
    c = next(c for end, c in _TWILIGHT if max(altitude_deg, -18.0) >= end)
    exponent = c[0] + x * (c[1] + x * (c[2] + x * c[3]))
    return float(10.0 ** (exponent - _TWILIGHT[0][1][0]))


def _step(low: float, high: float, x: float) -> float:
    t = min(max((x - low) / (high - low), 0.0), 1.0)
    return t * t * (3.0 - 2.0 * t)
