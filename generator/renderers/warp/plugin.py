"""The Warp renderer as a plug-in."""

from typing import Literal

from pydantic import Field

from gen_data.core.interfaces import AssetLibrary, Renderer
from gen_data.renderers.warp.settings import RenderSettings


class WarpPlugin(RenderSettings):
    """Settings and device of the Warp renderer.

    Attributes:
        renderer: Name of the renderer.
        device: auto, cpu or cuda:N; auto uses a CUDA GPU if there is one.
    """

    renderer: Literal["warp"] = "warp"
    device: str = Field("auto", pattern=r"^(auto|cpu|cuda(:[0-9]+)?)$")

    @property
    def settings(self) -> RenderSettings:
        """The settings without the device."""
        return RenderSettings(**self.model_dump(exclude={"device", "renderer"}))

    def open(self, assets: AssetLibrary) -> Renderer:
        """Open the renderer on its device.

        Raises:
            ConfigError: the device does not exist, or the denoiser is requested but not installed.
        """
        from gen_data.renderers.warp.renderer import WarpRenderer

        return WarpRenderer(assets, self.device, self.settings)
