"""Assignment of scenes to splits."""

import warnings
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal

from pydantic import Field, model_validator

from gen_data.config.base_model import Strict
from gen_data.core import errors, streams

Assignment = Literal["random", "round_robin"]
"""``random``: every scene draws its split. ``round_robin``: splits take turns by their shares."""

SHARES = ("train", "val", "test")

_FIRST_BLOCK = 1024


class Splits(Strict):
    """Shares of the scenes; all views of a scene are in one split."""

    train: float = Field(
        0.8,
        ge=0,
        le=1,
        description="Share of the scenes for training; 0 if only other shares are given.",
    )
    val: float = Field(0.1, ge=0, le=1, description="Share for validation during training.")
    test: float = Field(0.1, ge=0, le=1, description="Share for tests after training.")
    assign: Assignment = Field(
        "random",
        description="random: every scene draws its split; round_robin: splits take turns, which "
        "gives small data sets scenes in all of them.",
    )

    @model_validator(mode="before")
    @classmethod
    def _missing_shares_are_zero(cls, given: Any) -> Any:
        if isinstance(given, Mapping) and not given.keys().isdisjoint(SHARES):
            return {**dict.fromkeys(SHARES, 0.0), **given}
        return given

    @model_validator(mode="after")
    def _sums_to_one(self) -> "Splits":
        total = self.train + self.val + self.test
        if abs(total - 1.0) > 1e-9:
            raise ValueError(f"shares must sum to 1, got {total:g}")
        return self

    @property
    def shares(self) -> dict[str, float]:
        """Shares above 0 by split, in order."""
        return {name: share for name in SHARES if (share := getattr(self, name)) > 0}

    def of_scene(self, scene_index: int, seed: int) -> str:
        """Split of a scene; see ``split_of``."""
        return split_of(scene_index, self.shares, self.assign, seed)


def split_of(
    scene_index: int, shares: Mapping[str, float], assignment: Assignment, seed: int
) -> str:
    """Split of a scene; it does not depend on the number of scenes.

    Args:
        scene_index: From 0.
        shares: ``{split: share}`` in order; shares sum to 1.
        assignment: Method of assignment.
        seed: Seed of the data set.
    """
    if assignment == "round_robin":
        count = _FIRST_BLOCK
        while count <= scene_index:
            count *= 2
        return _turns(tuple(shares.items()), count)[scene_index]
    draw = streams.Streams(seed, scene_index).rng("split").uniform()
    for name, share in shares.items():
        if draw < share:
            return name
        draw -= share
    return next(reversed(list(shares)))


def warn_of_empty_splits(
    scene_count: int, shares: Mapping[str, float], assignment: Assignment, seed: int, stated: bool
) -> None:
    """Warn with a ConfigWarning if a split that should have a scene has none.

    Args:
        scene_count: Number of scenes of the data set.
        shares: See ``split_of``, as the next two.
        assignment: Method of assignment.
        seed: Seed of the data set.
        stated: Whether the user has set splits: then each should have a scene, otherwise each whose
            share is a whole scene.
    """
    expected = {name for name, share in shares.items() if stated or share * scene_count >= 1.0}
    used: set[str] = set()
    for scene_index in range(scene_count):
        if expected <= used:
            break
        used.add(split_of(scene_index, shares, assignment, seed))
    if expected <= used:
        return
    empty = " and ".join(name for name in shares if name in expected - used)
    remedy = "" if assignment == "round_robin" else ", splits.assign: round_robin"
    message = (
        f"splits: {scene_count} {'scene leaves' if scene_count == 1 else 'scenes leave'} {empty} "
        f"empty; expected more scenes{remedy}, or other shares"
    )
    warnings.warn(message, errors.ConfigWarning, stacklevel=2)


@lru_cache(maxsize=8)
def _turns(shares: tuple[tuple[str, float], ...], count: int) -> tuple[str, ...]:
    """Splits of the first scenes; each goes to the split that is furthest below its share."""
    made = dict.fromkeys((name for name, _ in shares), 0)
    turns = []
    for number in range(1, count + 1):
        # Rounded: equal shares tie despite floating-point errors; the first one wins.
        behind = {name: round(share * number - made[name], 9) for name, share in shares}
        name = max(behind, key=lambda split: behind[split])
        made[name] += 1
        turns.append(name)
    return tuple(turns)
