"""Lenses."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

from generator.config.distributions import Bounds, Normal, Scalar, Uniform
from generator.core.interfaces import AssetIndex
from generator.core.intrinsics import Intrinsics
from generator.core.scene import Camera, Scene
from generator.core.streams import Rng
from randomizers.base import RandomizerBase


class CameraIntrinsics(RandomizerBase):
    """Draws the field of view and the principal point of every camera.

    Attributes:
        hfov_deg: Horizontal field of view.
        principal_offset_px: How far the principal point is from the centre, along each axis.
    """

    type: Literal["camera_intrinsics"] = "camera_intrinsics"
    every: Literal["scene", "view"] = "view"
    hfov_deg: Annotated[Scalar, Bounds(1, 170)] = Uniform(50.0, 70.0)
    principal_offset_px: Scalar = Normal(0.0, 3.0, clip=(-10.0, 10.0))

    def __call__(self, scene: Scene, assets: AssetIndex, rng: Rng) -> Scene:
        """The scene with other lenses; square pixels, the same image size."""
        del assets
        return replace(scene, cameras=tuple(self._with_lens(c, rng) for c in scene.cameras))

    def _with_lens(self, camera: Camera, rng: Rng) -> Camera:
        before = camera.intrinsics
        width, height = before.width_px, before.height_px
        lens = Intrinsics.from_hfov(width, height, math.radians(self.hfov_deg.draw(rng)))
        return replace(
            camera,
            intrinsics=replace(
                lens,
                cx_px=round(lens.cx_px + self.principal_offset_px.draw(rng), 4),
                cy_px=round(lens.cy_px + self.principal_offset_px.draw(rng), 4),
            ),
        )
