"""Import and export of lights (UsdLux: radiance in nits, linear colours)."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gen_data.core import colorimetry, photometry
from gen_data.core.errors import AssetError
from gen_data.core.scene import Environment, Light
from gen_data.core.se3 import SE3, Array, Vec3
from gen_data.usd.prims import along_minus_z, rotation_from_axes, set_transforms

RADIUS_M_MIN = 1e-3
"""Smallest radius of exported spheres: USD gives radiance, which points do not have."""

DIPPED_RAD = 0.2
"""Half angle of the spot that approximates a dipped headlight."""

T_WORLD_DOME = SE3((0.0, 0.0, 0.0), (0.5, 0.5, 0.5, 0.5))
"""USD's sky has its pole along +Y and the image's centre along +Z; here +Z and +X."""


def define_light(
    stage: Any, path: str, steps: Sequence[Light], codes: Sequence[float] = (0.0,)
) -> None:
    """Define a light, with a pose per time code."""
    from pxr import UsdLux

    steps = [_approximate_cutoff(step) for step in steps]
    light = steps[0]
    if light.kind == "sun":
        prim = UsdLux.DistantLight.Define(stage, path)
        prim.CreateAngleAttr(math.degrees(2.0 * light.angular_radius_rad))
        # The intensity of a normalised distant light is the illuminance of a surface facing it.
        prim.CreateNormalizeAttr(True)
        prim.CreateIntensityAttr(light.illuminance_lux)
    elif light.kind == "rectangle":
        prim = UsdLux.RectLight.Define(stage, path)
        prim.CreateWidthAttr(light.size_m[0])
        prim.CreateHeightAttr(light.size_m[1])
        prim.CreateIntensityAttr(photometry.luminance_cd_m2(light))
    elif light.kind == "disk":
        prim = UsdLux.DiskLight.Define(stage, path)
        prim.CreateRadiusAttr(light.radius_m)
        prim.CreateIntensityAttr(photometry.luminance_cd_m2(light))
    else:
        radius_m = max(light.radius_m, RADIUS_M_MIN)
        prim = UsdLux.SphereLight.Define(stage, path)
        prim.CreateRadiusAttr(radius_m)
        prim.CreateIntensityAttr(light.intensity_cd / _disk_area_m2(radius_m))
        if light.kind == "spot":
            shaping = UsdLux.ShapingAPI.Apply(prim.GetPrim())
            shaping.CreateShapingConeAngleAttr(math.degrees(light.cone_rad))
            shaping.CreateShapingConeSoftnessAttr(1.0 - light.even)
    prim.CreateColorAttr(light.color)
    set_transforms(prim.GetPrim(), [_light_pose(step).matrix() for step in steps], codes)


def define_sky(stage: Any, path: str, environment: Environment, image: str) -> None:
    """Define a dome light; ``image`` is the path of a panorama of mean luminance 1."""
    from pxr import UsdLux

    prim = UsdLux.DomeLight.Define(stage, path)
    prim.CreateTextureFileAttr(image)
    prim.CreateTextureFormatAttr(UsdLux.Tokens.latlong)
    prim.CreateIntensityAttr(environment.luminance_cd_m2)
    set_transforms(
        prim.GetPrim(), [(SE3.about_z(environment.yaw_rad) @ T_WORLD_DOME).matrix()], (0.0,)
    )


def read_light(prim: Any, name: str, T_stage_light: Array) -> Light | None:
    """Read a light, in metres, Z up; None if the prim is not a supported light.

    Args:
        prim: Prim of any type.
        name: Name of the light.
        T_stage_light: Column-vector matrix [4, 4], scale included.
    """
    from pxr import UsdLux

    readers = {
        UsdLux.DistantLight: _read_sun,
        UsdLux.SphereLight: _read_sphere,
        UsdLux.RectLight: _read_rectangle,
        UsdLux.DiskLight: _read_disk,
    }
    found = ((kind, read) for kind, read in readers.items() if prim.IsA(kind))
    return next((read(kind(prim), name, T_stage_light) for kind, read in found), None)


def check_light(light: Light, place: str) -> Light:
    """Check and return a light.

    Raises:
        AssetError: if a number is not finite, negative where it must not be, or a panel is empty.
    """
    strengths = {
        "intensity": light.intensity_cd,
        "irradiance": light.illuminance_lux,
        "radius": light.radius_m,
        "width": light.size_m[0],
        "height": light.size_m[1],
        "color": min(light.color),
        "angle": light.angular_radius_rad,
    }
    for name, value in strengths.items():
        if not (math.isfinite(value) and value >= 0.0):
            raise AssetError(
                f"{place}: light '{light.name}' has {name} {value:g}; expected a finite number >= 0"
            )
    if (light.kind == "disk" and light.radius_m == 0.0) or min(light.size_m) == 0.0:
        raise AssetError(f"{place}: light '{light.name}' has no area; set its size or remove it")
    if not np.isfinite((*light.color, *light.position_m, *light.direction)).all():
        raise AssetError(
            f"{place}: light '{light.name}' is not finite; check its position and color"
        )
    return light


def _read_sun(sun: Any, name: str, T_stage_light: Array) -> Light:
    color, strength = _read_color(sun)
    half_rad = math.radians(0.5 * float(sun.GetAngleAttr().Get()))
    if not sun.GetNormalizeAttr().Get() and half_rad > 0.0:
        strength *= math.pi * math.sin(half_rad) ** 2
    return Light(
        name,
        "sun",
        direction=_minus_z(T_stage_light),
        color=color,
        illuminance_lux=strength,
        angular_radius_rad=half_rad,
    )


def _read_rectangle(panel: Any, name: str, T_stage_light: Array) -> Light:
    across = (_length(T_stage_light[:3, 0]), _length(T_stage_light[:3, 1]))
    width_m = float(panel.GetWidthAttr().Get()) * across[0]
    height_m = float(panel.GetHeightAttr().Get()) * across[1]
    light = _read_panel(panel, Light(name, "rectangle"), T_stage_light, width_m * height_m)
    side = _vec3(T_stage_light[:3, 0] / across[0])
    return replace(light, size_m=(width_m, height_m), side=side)


def _read_disk(panel: Any, name: str, T_stage_light: Array) -> Light:
    radius_m = float(panel.GetRadiusAttr().Get()) * _length(T_stage_light[:3, 0])
    light = _read_panel(panel, Light(name, "disk"), T_stage_light, _disk_area_m2(radius_m))
    return replace(light, radius_m=radius_m)


def _read_panel(panel: Any, light: Light, T_stage_light: Array, area_m2: float) -> Light:
    """Read a panel without its size; normalised panels emit the same power at any area."""
    color, strength = _read_color(panel)
    return replace(
        light,
        position_m=_vec3(T_stage_light[:3, 3]),
        direction=_minus_z(T_stage_light),
        color=color,
        intensity_cd=strength if panel.GetNormalizeAttr().Get() else strength * area_m2,
    )


def _read_sphere(ball: Any, name: str, T_stage_light: Array) -> Light:
    """Read a sphere light; a spot if its cone is narrower than a half space."""
    from pxr import UsdLux

    color, strength = _read_color(ball)
    radius_m = float(ball.GetRadiusAttr().Get()) * _length(T_stage_light[:3, 0])
    # Normalised power is per surface area of the sphere, four times its visible disc.
    disc_m2 = 0.25 if ball.GetNormalizeAttr().Get() else _disk_area_m2(radius_m)
    light = Light(
        name,
        "sphere",
        position_m=_vec3(T_stage_light[:3, 3]),
        direction=_minus_z(T_stage_light),
        color=color,
        intensity_cd=strength * disc_m2,
        radius_m=radius_m,
    )
    shaping = UsdLux.ShapingAPI(ball)
    angle_deg = shaping.GetShapingConeAngleAttr().Get()
    if not ball.GetPrim().HasAPI(UsdLux.ShapingAPI) or angle_deg is None or angle_deg >= 90.0:
        return light
    softness = float(shaping.GetShapingConeSoftnessAttr().Get() or 0.0)
    even = min(max(1.0 - softness, 0.0), 1.0)
    return replace(light, kind="spot", cone_rad=math.radians(float(angle_deg)), even=even)


def _approximate_cutoff(light: Light) -> Light:
    """Replace a dipped headlight by a round spot below its cut-off; USD has no cut-off."""
    if light.cutoff <= 0.0:
        return light
    down = math.tan(DIPPED_RAD) + light.cutoff
    direction = np.array(light.direction) - (0.0, 0.0, down)
    unit = _vec3(direction / _length(direction))
    return replace(light, direction=unit, cone_rad=DIPPED_RAD, cutoff=0.0)


def _minus_z(T_stage_light: Array) -> Vec3:
    return _vec3(-T_stage_light[:3, 2] / _length(T_stage_light[:3, 2]))


def _vec3(values: Array) -> Vec3:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def _light_pose(light: Light) -> SE3:
    if light.kind == "rectangle":
        z, x = -np.asarray(light.direction, np.float64), np.asarray(light.side, np.float64)
        return SE3(light.position_m, rotation_from_axes(x, z).quaternion_wxyz)
    turn = along_minus_z(light.direction) if light.kind != "sphere" else SE3()
    at = (0.0, 0.0, 0.0) if light.kind == "sun" else light.position_m
    return SE3(at, turn.quaternion_wxyz)


def _read_color(lux: Any) -> tuple[Vec3, float]:
    """Read a colour, normalised to luminance 1 (Rec. 709), and the corresponding intensity."""
    red, green, blue = (float(c) for c in lux.GetColorAttr().Get())
    relative = float(colorimetry.luminance(np.array([red, green, blue])))
    strength = float(lux.GetIntensityAttr().Get()) * 2.0 ** float(lux.GetExposureAttr().Get())
    if relative == 0.0:
        return (1.0, 1.0, 1.0), 0.0
    return (red / relative, green / relative, blue / relative), strength * relative


def _disk_area_m2(radius_m: float) -> float:
    return math.pi * radius_m * radius_m


def _length(vector: Array) -> float:
    return float(np.sqrt((vector * vector).sum()))
