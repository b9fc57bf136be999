"""Where a sensor is mounted, and how often it reads."""

from __future__ import annotations

import math

from pydantic import Field

from generator.config.strict import Strict
from generator.core.errors import ConfigError, did_you_mean
from generator.core.scene import Scene
from generator.core.se3 import SE3


class Mounted(Strict):
    """A sensor that may be on a rig.

    Attributes:
        rig: Name of the rig it is on: an ego vehicle's, an arm's wrist; empty = none.
        offset_m: On the rig: forward, left, up.
        yaw_deg, pitch_deg, roll_deg: Turn to the left, then upwards, then clockwise as seen from
            behind, from the rig's forward axis.
        rate_hz: Readings per second; null = one at every step.
        time_offset_s: It reads this much later than the step's instant; what it saw then, and the
            labels of that, belong to the step.
    """

    rig: str = ""
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_deg: float = Field(0.0, ge=-180, le=180)
    pitch_deg: float = Field(0.0, ge=-90, le=90)
    roll_deg: float = Field(0.0, ge=-180, le=180)
    rate_hz: float | None = Field(None, gt=0, le=10_000)
    time_offset_s: float = Field(0.0, ge=-10, le=10)

    @property
    def T_rig_sensor(self) -> SE3:  # noqa: N802
        """Its pose on the rig; both frames are X forward, Y left, Z up."""
        pitch, roll = -0.5 * math.radians(self.pitch_deg), 0.5 * math.radians(self.roll_deg)
        upwards = SE3((0.0, 0.0, 0.0), (math.cos(pitch), 0.0, math.sin(pitch), 0.0))
        leaning = SE3((0.0, 0.0, 0.0), (math.cos(roll), math.sin(roll), 0.0, 0.0))
        turned = SE3.about_z(math.radians(self.yaw_deg), self.offset_m)
        return (turned @ upwards @ leaning).rounded()


def known_rig(scene: Scene, sensor: str, rig: str) -> str:
    """The rig's name, if the scene has it.

    Raises:
        ConfigError: it has not.
    """
    known = [r.name for r in scene.rigs]
    if rig not in known:
        raise ConfigError(
            f"sensor '{sensor}': there is no rig '{rig}'; there is {', '.join(known) or 'none'}"
            + did_you_mean(rig, known)
        )
    return rig


def stride(sensor: str, rate_hz: float | None, step_s: float) -> int:
    """Every how many steps a sensor reads that is no faster than the sequence.

    Raises:
        ConfigError: its period is no whole number of steps.
    """
    if rate_hz is None:
        return 1
    steps = 1.0 / (rate_hz * step_s)
    if steps < 0.999 or abs(steps - round(steps)) > 1e-6 * steps:
        k = max(1, round(steps))
        raise ConfigError(
            f"sensor '{sensor}': rate_hz {rate_hz:g} does not fit step_s {step_s:g}; expected a"
            f" whole number of steps between readings, such as {1.0 / (k * step_s):g} Hz"
        )
    return round(steps)
