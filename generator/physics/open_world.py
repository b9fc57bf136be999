"""The simulator of a configuration."""

from gen_data.core.errors import ConfigError
from gen_data.physics import physics_config, world


def open_world(config: physics_config.PhysicsConfig) -> world.World:
    """Open an empty world of the configured simulator.

    Raises:
        ConfigError: it is not installed.
    """
    missing = physics_config.missing_engine(config.engine)
    if missing:
        raise ConfigError(f"physics.engine: {missing}")
    if config.engine == "mujoco":
        from gen_data.physics.mujoco_world import MujocoWorld

        return MujocoWorld(config.time_step_s, config.solver_iterations)
    from gen_data.physics.bullet_world import BulletWorld

    return BulletWorld(config.time_step_s, config.solver_iterations)
