"""Options that several commands share."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypedDict, TypeVar

import click

from gen_data.core.errors import ConfigError

if TYPE_CHECKING:
    from gen_data.runner.ray_cluster import RayCluster

F = TypeVar("F", bound=Callable[..., Any])


CLUSTER = ("runner", "address", "cpus", "gpus")
"""Parameters of ``cluster_options``."""


class Changes(TypedDict):
    """Parameters of ``configuration_options``; functions of the API have the same.

    Attributes:
        overrides: ``KEY=VALUE`` texts.
        without: Names of randomizers to leave out.
    """

    seed: int | None
    overrides: tuple[str, ...]
    without: tuple[str, ...]


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


def cluster_options(command: F) -> F:
    """Add ``--runner`` and the options of a Ray cluster to a command."""
    for option in (
        click.option("--gpus", type=float, help="GPUs per worker, such as 0.25 [default: 0]."),
        click.option("--cpus", type=float, help="CPU cores per worker [default: 1]."),
        click.option(
            "--address",
            metavar="ADDRESS",
            help="Ray cluster: auto, or HOST:PORT [default: start one on this machine].",
        ),
        click.option(
            "--runner",
            type=click.Choice(["local", "ray"]),
            default="local",
            help="Processes of this machine, or workers on a Ray cluster.",
        ),
    ):
        command = option(command)
    return command


def choose_cluster(
    runner: str, address: str | None, cpus: float | None, gpus: float | None
) -> "RayCluster | None":
    """The cluster that the options of ``cluster_options`` name; None = this machine.

    Raises:
        ConfigError: an option of a cluster without one, or one with a wrong value.
    """
    given = {"--address": address, "--cpus": cpus, "--gpus": gpus}
    if runner != "ray":
        extra = [name for name, value in given.items() if value is not None]
        if extra:
            raise ConfigError(f"{extra[0]} belongs to a cluster; expected --runner ray with it")
        return None
    from gen_data.runner.ray_cluster import RayCluster

    return RayCluster(address or "", 1.0 if cpus is None else cpus, gpus or 0.0)
