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


def parse_shards(
    context: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[int, int] | None:
    """Both numbers of the option ``--shards A:B``; a click callback."""
    if text is None:
        return None
    first, _, end = text.partition(":")
    if not all(number.isascii() and number.isdigit() for number in (first, end)):
        raise click.BadParameter(
            f"'{text}' is not a range of shards; expected A:B, such as 0:50", context, parameter
        )
    return int(first), int(end)


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
