"""Figures of real drives, and how far ours may be from them: ``street_figures.yaml``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

FILE = Path(__file__).with_name("street_figures.yaml")


@dataclass(frozen=True, slots=True)
class RealFigures:
    """Real figures of pictures or of scans.

    Attributes:
        asked: Largest relative deviation of simulated figures.
        least: Absolute deviation that is always in range [its unit].
        rows: Figures by name; NaN = unknown.
    """

    asked: float
    least: float
    rows: Mapping[str, float]

    def excess(self, name: str, ours: float) -> float:
        """Distance of our figure from the range of its row [its unit]; 0 = within."""
        real = self.rows[name]
        # A deviation of exactly `asked` is within it, whatever its binary rounding.
        room = max(self.asked * abs(real), self.least) * (1.0 + 1e-9)
        return max(0.0, abs(ours - real) - room)


def real_figures(kind: str) -> RealFigures:
    """Figures of ``pictures`` or ``scans``."""
    return RealFigures(**yaml.safe_load(FILE.read_text(encoding="utf-8"))[kind])


def judge(figures: RealFigures, name: str, ours: float, error: float) -> str:
    """``in``, ``out``, ``?`` = out by less than two standard errors, or ``-`` = not comparable.

    Args:
        figures: The real figures.
        name: Name of the row.
        ours: Our figure; NaN = not measured.
        error: Its standard error [its unit]; NaN = unknown.
    """
    if math.isnan(ours) or math.isnan(figures.rows[name]):
        return "-"
    excess = figures.excess(name, ours)
    if excess == 0.0:
        return "in"
    return "?" if excess < 2.0 * error else "out"
