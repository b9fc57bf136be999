"""Options of all commands with a configuration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from gen_data.generator.assemble.config import Config

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class ConfigurationOptions:
    """A configuration and its changes on the command line.

    Attributes:
        source: A path, a shipped name, or the folder of a data set.
        overrides: ``KEY=VALUE`` texts.
        without: Names of randomizers to leave out.
    """

    source: str
    seed: int | None
    overrides: tuple[str, ...]
    without: tuple[str, ...]

    def config(self) -> Config:
        """Load and validate the configuration."""
        from gen_data.generator.assemble.config import load_config

        return load_config(
            self.source, seed=self.seed, overrides=self.overrides, without=self.without
        )


class _ShardRange(click.ParamType):
    """``A:B``, two whole numbers."""

    name = "range"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        """Both numbers of the text."""
        first, colon, end = str(value).partition(":")
        if not (colon and first.isascii() and first.isdigit() and end.isascii() and end.isdigit()):
            self.fail(f"'{value}' is not a range of shards; expected A:B, such as 0:50", param, ctx)
        return int(first), int(end)


SHARD_RANGE = _ShardRange()
"""Type of the option ``--shards``."""


def configuration_options(command: F) -> F:
    """Add ``--seed``, ``--set`` and ``--without`` to a command."""
    for option in (
        click.option("--without", multiple=True, metavar="NAME", help="Omit a randomizer."),
        click.option(
            "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Override one field."
        ),
        click.option("--seed", type=int, help="Overrides the configuration's seed."),
    ):
        command = option(command)
    return command
