"""Cameras, both ways.

USD's camera is a pinhole: what a lens bends is written as attributes beside it
(``genData:lens:model``, ``genData:lens:coefficients``, ``genData:lens:halfField`` in radians).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gen_data.generator.core.scene import Camera
from gen_data.generator.core.se3 import SE3, Array
from gen_data.generator.usd.prims import T_CAMERA_USD, set_transforms

PIXEL = 2.0**-11
"""Width of a pixel on the sensor, in tenths of a metre, USD's unit for it: about 49 micrometres. A
power of two, so that whole pixels have exact apertures."""
CLIPPING_M = (0.01, 100_000.0)


def define_camera(stage: Any, path: str, steps: Sequence[Camera]) -> None:
    """A camera whose frustum is its intrinsics, and where it is at every time code."""
    from pxr import Gf, Sdf, UsdGeom

    k = steps[0].intrinsics
    high = PIXEL * k.fx_px / k.fy_px
    prim = UsdGeom.Camera.Define(stage, path)
    prim.CreateProjectionAttr(UsdGeom.Tokens.perspective)
    prim.CreateFocalLengthAttr(k.fx_px * PIXEL)
    prim.CreateHorizontalApertureAttr(k.width_px * PIXEL)
    prim.CreateVerticalApertureAttr(k.height_px * high)
    prim.CreateHorizontalApertureOffsetAttr((0.5 * k.width_px - k.cx_px) * PIXEL)
    prim.CreateVerticalApertureOffsetAttr((k.cy_px - 0.5 * k.height_px) * high)
    prim.CreateClippingRangeAttr(Gf.Vec2f(*CLIPPING_M))
    size = prim.GetPrim().CreateAttribute("genData:imageSize", Sdf.ValueTypeNames.Int2)
    size.Set(Gf.Vec2i(k.width_px, k.height_px))
    if not k.straight:
        _define_lens(prim.GetPrim(), steps[0])
    set_transforms(
        prim.GetPrim(), [(step.T_world_camera @ T_CAMERA_USD).matrix() for step in steps]
    )


def read_camera_pose(T_stage_usd: Array) -> SE3:
    """``T_stage_camera`` of a camera prim's column-vector matrix [4, 4]."""
    matrix = T_stage_usd.copy()
    matrix[:3, :3] /= abs(float((matrix[:3, 0] ** 2).sum())) ** 0.5
    return SE3.from_matrix(matrix) @ T_CAMERA_USD.inverse()


def _define_lens(prim: Any, camera: Camera) -> None:
    from pxr import Sdf

    lens = camera.intrinsics.lens
    kinds = Sdf.ValueTypeNames
    for name, kind, value in (
        ("model", kinds.Token, lens.model),
        ("coefficients", kinds.DoubleArray, lens.coefficients),
        ("halfField", kinds.Double, lens.half_field_rad),
    ):
        prim.CreateAttribute(f"genData:lens:{name}", kind).Set(value)
