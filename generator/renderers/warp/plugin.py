"""The section ``render:`` of the renderer that comes with the program."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gen_data.generator.core.interfaces import AssetLibrary, Renderer
from gen_data.generator.renderers.warp.settings import RenderSettings


class WarpPlugin(RenderSettings):
    """How images are made, and on what.

    Attributes:
        renderer: Which renderer makes the images.
        device: auto, cpu or cuda:N; auto takes a CUDA GPU where there is one.
    """

    renderer: Literal["warp"] = "warp"
    device: str = Field("auto", pattern=r"^(auto|cpu|cuda(:[0-9]+)?)$")

    @property
    def settings(self) -> RenderSettings:
        """Choices about images, without the machine."""
        return RenderSettings(**self.model_dump(exclude={"device", "renderer"}))

    def open(self, assets: AssetLibrary) -> Renderer:
        """The renderer, on its device.

        Raises:
            ConfigError: the device does not exist, or a denoiser is asked for and not there.
        """
        from gen_data.generator.renderers.warp.renderer import WarpRenderer

        return WarpRenderer(assets, self.device, self.settings)
