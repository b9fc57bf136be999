"""Options of commands that make data sets are keywords of the functions that make them."""

import inspect
from collections.abc import Callable
from typing import Any

import click
import pytest

import gen_data
from gen_data.api.merge import merge
from gen_data.api.recipes import pull
from gen_data.api.rerender import rerender
from gen_data.cli import merge_command, options, recipe_commands, rerender_command
from gen_data.cli.export_command import export
from gen_data.cli.main import cli

TRANSLATED = {*options.CLUSTER, "tier"}
"""Options that become the keywords ``cluster`` and ``overrides``."""


@pytest.mark.parametrize(
    ("command", "function"),
    [
        (cli, gen_data.generate),
        (export, gen_data.export),
        (rerender_command.rerender, rerender),
        (merge_command.merge, merge),
        (recipe_commands.pull, pull),
    ],
)
def test_options_are_keywords_of_the_function_with_its_defaults(
    command: click.Command, function: Callable[..., Any]
) -> None:
    keywords = inspect.signature(function).parameters
    names = {o.name for o in command.params if isinstance(o, click.Option)}
    absent = command.make_context("", [], resilient_parsing=True).params
    given = {k: absent[k] or () for k in absent if k in names - TRANSLATED}

    assert given.keys() <= keywords.keys()
    # An absent option is None, False or an empty tuple, also a required one.
    required = inspect.Parameter.empty
    assert given == {
        name: () if keywords[name].default is required else keywords[name].default or ()
        for name in given
    }
