"""What a user may change about physics."""

from __future__ import annotations

from pydantic import Field

from generator.config.strict import Strict


class PhysicsConfig(Strict):
    """Settling: how long, how exactly, and when a layout is refused."""

    time_step_s: float = Field(default=1.0 / 240.0, gt=0.0, le=1.0 / 60.0)
    """Simulated time per step [s]."""
    settle_time_s_max: float = Field(default=4.0, gt=0.0, le=60.0)
    """Simulated time after which objects that still move are refused [s]."""
    rest_speed_m_s: float = Field(default=0.01, gt=0.0)
    """An object slower than this [m/s] ..."""
    rest_spin_rad_s: float = Field(default=0.1, gt=0.0)
    """... and turning slower than this [rad/s] ..."""
    rest_time_s: float = Field(default=0.1, gt=0.0, le=1.0)
    """... for this long [s] is at rest."""
    penetration_m_max: float = Field(default=0.001, gt=0.0)
    """Objects that overlap by more than this [m] once at rest are refused."""
    solver_iterations: int = Field(default=50, ge=1, le=1000)
    """Iterations of the contact solver per step; more keep tall stacks upright."""
    guard_walls: bool = True
    """Keep objects from rolling off open surfaces by invisible walls while they settle. Whatever
    touches a wall at rest must also rest without it."""
    layout_attempts_max: int = Field(default=20, ge=1, le=1000)
    """Layouts tried for one scene before it is given up."""
