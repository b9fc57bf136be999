"""Parameters of a family that its asset ids may set: the named draws of its variants."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from gen_data.assets.asset_ids import format_parameter
from gen_data.core.variant_rng import Draw, DrawnValue


@dataclass(frozen=True, slots=True)
class FamilyParameter:
    """A named draw of a family, over all its variants.

    Attributes:
        name: Key in asset ids; the unit is its ending.
        options: Possible values of any variant; of a range, the smallest and the largest.
        is_range: Whether all numbers between are possible too; a variant may allow a part of them.
        is_common: Whether every variant draws it.
        values: Drawn values, one per variant that draws it.
    """

    name: str
    options: tuple[DrawnValue, ...]
    is_range: bool
    is_common: bool
    values: tuple[DrawnValue, ...]

    def words(self) -> str:
        """Its possible values: ``1.2 to 1.8``, ``false, true``."""
        if self.is_range:
            ends = (str(end) if isinstance(end, int) else f"{end:.4g}" for end in self.options)
            return " to ".join(ends)
        return ", ".join(map(format_parameter, self.options))


def merge_draws(variants: Iterable[Mapping[str, Draw]]) -> tuple[FamilyParameter, ...]:
    """Named draws of a family in their order, from the draws of its variants."""
    listed = list(variants)
    by_name: dict[str, list[Draw]] = {}
    for draws in listed:
        for name, draw in draws.items():
            by_name.setdefault(name, []).append(draw)
    return tuple(
        FamilyParameter(
            name,
            _merge_options(draws),
            draws[0].is_range,
            len(draws) == len(listed),
            tuple(draw.value for draw in draws),
        )
        for name, draws in by_name.items()
    )


def _merge_options(draws: list[Draw]) -> tuple[DrawnValue, ...]:
    options = dict.fromkeys(option for draw in draws for option in draw.options)
    ordered = sorted(options, key=lambda value: (isinstance(value, str), value))
    return (ordered[0], ordered[-1]) if draws[0].is_range else tuple(ordered)
