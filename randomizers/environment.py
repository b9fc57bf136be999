"""Environment maps."""

import math
from dataclasses import replace
from typing import Literal

from pydantic import Field

from gen_data.config import distributions as dist
from gen_data.config.yaml_scalars import quote_value
from gen_data.core import errors, interfaces, streams
from gen_data.core.scene import Environment, Scene
from gen_data.randomizers.base import RandomizerBase, choose


class EnvironmentLight(RandomizerBase):
    """Draws the environment map, its brightness and its orientation.

    Attributes:
        images: Families or tags of environments, such as studio, indoor, overcast; empty = all.
        luminance_cd_m2: Mean luminance over the sphere.
        yaw_deg: Rotation about the vertical.
        visible: Whether the map is visible as the background of images.
    """

    type: Literal["environment"] = "environment"
    images: tuple[str, ...] = ()
    luminance_cd_m2: dist.NonNegative = dist.LogUniform(10.0, 80.0)
    yaw_deg: dist.Scalar = dist.Uniform(0.0, 360.0)
    visible: bool = Field(True)

    def possible_assets(self, assets: interfaces.AssetIndex) -> tuple[str, ...]:
        """Ids of the environment maps to draw from."""
        every = assets.find((), kind="environment")
        if not self.images:
            return tuple(a.asset_id for a in every)
        fitting = {
            name: {a.asset_id for a in every if name in a.tags or f"/{name}?" in f"{a.asset_id}?"}
            for name in self.images
        }
        known = sorted({tag for a in every for tag in a.tags})
        for name, found in fitting.items():
            if not found:
                raise errors.ConfigError(
                    f"randomizers.{self.name}.images: no environment is {quote_value(name)}; "
                    f"expected some of {', '.join(known)}{errors.did_you_mean(name, known)}"
                )
        return tuple(a.asset_id for a in every if any(a.asset_id in f for f in fitting.values()))

    def __call__(self, scene: Scene, assets: interfaces.AssetIndex, rng: streams.Rng) -> Scene:
        """Return the scene with a drawn environment map."""
        environment = Environment(
            image=choose(self.possible_assets(assets), rng),
            luminance_cd_m2=round(self.luminance_cd_m2.draw(rng), 4),
            yaw_rad=round(math.radians(self.yaw_deg.draw(rng)), 6),
            visible=self.visible,
        )
        return replace(scene, environment=environment)
