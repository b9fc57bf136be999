"""The physics engines that are installed: not every interpreter has a wheel of each."""

from __future__ import annotations

from typing import get_args

from gen_data.generator.physics.physics_config import EngineName, is_installed

INSTALLED: tuple[EngineName, ...] = tuple(filter(is_installed, get_args(EngineName)))
