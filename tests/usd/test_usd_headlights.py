"""Dipped headlights in USD, which has no cut-off."""

import math

import pytest
from pxr import Usd, UsdGeom, UsdLux

from gen_data.core.se3 import SE3
from gen_data.randomizers.vehicle_lights import dipped_beam
from gen_data.usd.lights import define_light


def test_the_spot_of_a_dipped_headlight_lies_below_its_cutoff() -> None:
    """Its upper edge is 1 % below the horizon, by the spot's own direction."""
    stage = Usd.Stage.CreateInMemory()
    beam = dipped_beam("beam", SE3.about_z(0.5, (1.0, 2.0, 0.7)), 10_000.0)
    define_light(stage, "/beam", [beam])
    prim = stage.GetPrimAtPath("/beam")
    half_rad = math.radians(UsdLux.ShapingAPI(prim).GetShapingConeAngleAttr().Get())
    placed = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
    x, y, z = placed.TransformDir((0, 0, -1))
    upper_edge_rad = math.asin(z / math.hypot(x, y, z)) + half_rad
    assert math.tan(upper_edge_rad) == pytest.approx(-0.01, abs=0.001)
    assert math.atan2(y, x) == pytest.approx(0.5)
    assert list(placed.ExtractTranslation()) == pytest.approx([1.0, 2.0, 0.7])
