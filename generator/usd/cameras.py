"""Import and export of cameras.

USD's camera is a pinhole; lens distortion is written as additional attributes
(``genData:lens:model``, ``genData:lens:coefficients``, ``genData:lens:halfField`` in radians), the
delay of a camera's images after their steps as ``genData:timeOffset`` in time codes.
"""

from collections.abc import Sequence
from typing import Any

from gen_data.core.scene import Camera
from gen_data.core.se3 import SE3, Array
from gen_data.usd.prims import T_CAMERA_USD, set_transforms

PIXEL = 2.0**-11
"""Pixel width on the sensor in tenths of a scene unit, USD's unit for apertures: about 49
micrometres. A power of two makes apertures of whole pixels exact."""
CLIPPING_M = (0.01, 100_000.0)


def define_camera(
    stage: Any, path: str, steps: Sequence[Camera], codes: Sequence[float], offset: float = 0.0
) -> None:
    """Define a camera from its intrinsics, with a pose per time code.

    ``offset`` is the delay of its images after their steps, in time codes.
    """
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
    if offset:
        delay = prim.GetPrim().CreateAttribute("genData:timeOffset", Sdf.ValueTypeNames.Double)
        delay.Set(offset)
    poses = [(step.T_world_camera @ T_CAMERA_USD).matrix() for step in steps]
    set_transforms(prim.GetPrim(), poses, codes)


def read_camera_pose(T_stage_usd: Array) -> SE3:
    """``T_stage_camera`` of a camera prim's column-vector matrix [4, 4]."""
    matrix = T_stage_usd.copy()
    matrix[:3, :3] /= abs(float((matrix[:3, 0] ** 2).sum())) ** 0.5
    return SE3.from_matrix(matrix) @ T_CAMERA_USD.inverse()


def _define_lens(prim: Any, camera: Camera) -> None:
    from pxr import Sdf, Vt

    lens = camera.intrinsics.lens
    kinds = Sdf.ValueTypeNames
    for name, kind, value in (
        ("model", kinds.Token, lens.model),
        # A tuple of four numbers would become a vector.
        ("coefficients", kinds.DoubleArray, Vt.DoubleArray(lens.coefficients)),
        ("halfField", kinds.Double, lens.half_field_rad),
    ):
        prim.CreateAttribute(f"genData:lens:{name}", kind).Set(value)
