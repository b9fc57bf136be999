"""Physics: objects settle and arms accomplish their goals; a pure function of the Scene."""

from typing import TYPE_CHECKING

from gen_data.core.interfaces import AssetLibrary
from gen_data.physics.physics_config import PhysicsConfig, missing_engine

if TYPE_CHECKING:
    from gen_data.physics.engine import Engine

__all__ = ["PhysicsConfig", "missing_engine", "open_engine"]


def open_engine(assets: AssetLibrary, config: PhysicsConfig) -> "Engine":
    """Open the physics engine, to be used as a context manager.

    Raises:
        ConfigError: the configured one is not installed.
    """
    from gen_data.physics.engine import Engine

    return Engine(assets, config)
