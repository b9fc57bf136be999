"""The section ``physics:`` of a configuration."""

from importlib.util import find_spec
from typing import Literal, get_args

from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core.distribution import install_command

EngineName = Literal["pybullet", "mujoco"]


def is_installed(engine: EngineName) -> bool:
    """Whether the package of an engine can be imported; it is not loaded."""
    return find_spec(engine) is not None


def missing_engine(engine: EngineName) -> str:
    """Why an engine cannot be used here, and the remedies; empty if it is installed."""
    if is_installed(engine):
        return ""
    others = " or ".join(f"'{name}'" for name in get_args(EngineName) if is_installed(name))
    remedy = f"pip install {engine}"
    if engine == "pybullet":
        remedy = f"{install_command('bullet')} (Python 3.10 or 3.11 on Linux x86-64)"
    return f"'{engine}' is not installed; expected {others or 'an engine'}, or {remedy}"


def default_engine() -> EngineName:
    """``pybullet`` where it is installed, else ``mujoco``."""
    return "pybullet" if is_installed("pybullet") else "mujoco"


class PhysicsConfig(Strict):
    """Settling: engine, times, accuracy, and thresholds for rejecting a layout."""

    engine: EngineName = Field(
        default_factory=default_engine,
        description="Simulator of rigid bodies; by default pybullet where it is installed, else "
        "mujoco. Each has its own resting poses; the plan of a data set names it.",
    )
    time_step_s: float = Field(
        1.0 / 240.0, gt=0.0, le=1.0 / 60.0, description="Simulated time per step [s]."
    )
    settle_time_s_max: float = Field(
        4.0,
        gt=0.0,
        le=60.0,
        description="Simulated time after which objects that still move are refused [s].",
    )
    rest_speed_m_s: float = Field(
        0.01, gt=0.0, description="An object at rest is slower than this [m/s]."
    )
    rest_spin_rad_s: float = Field(
        0.1, gt=0.0, description="An object at rest turns slower than this [rad/s]."
    )
    rest_time_s: float = Field(
        0.1, gt=0.0, le=1.0, description="For how long all objects must be at rest [s]."
    )
    penetration_m_max: float = Field(
        0.001, gt=0.0, description="Objects that overlap by more than this at rest are refused [m]."
    )
    solver_iterations: int = Field(
        50,
        ge=1,
        le=1000,
        description="Iterations of the contact solver per step; more keep tall stacks upright.",
    )
    guard_walls: bool = Field(
        True,
        description="Invisible walls keep objects from rolling off open surfaces while they "
        "settle; objects that then cannot rest without them are dropped again nearer to the "
        "middle.",
    )
    layout_attempts_max: int = Field(
        20,
        ge=1,
        le=1000,
        description="Layouts tried for one scene before it is given up, and draws tried for each "
        "view of a layout.",
    )
