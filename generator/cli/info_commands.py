"""Commands that print information: ``verify``, ``describe``, ``schema``."""

from __future__ import annotations

import json
from pathlib import Path

import click


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--full", is_flag=True, help="Hash every file, not only sizes.")
def verify(folder: Path, full: bool) -> None:
    """Check a data set against its manifest: sizes, or every sha256 with --full."""
    from gen_data.generator.runner.verify import verify as check

    report = check(folder, full=full)
    click.echo(f"{folder}: {report}")


@click.command()
@click.argument("name", required=False)
def describe(name: str | None) -> None:
    """Explain a plug-in from its own fields; without NAME, list them all."""
    from gen_data.generator.assemble.plugin_tables import TABLES, find_plugin
    from gen_data.generator.config.describe import describe as text_of

    if name is None:
        for kind, table in TABLES.items():
            click.echo(f"{kind}: {', '.join(table)}")
        return
    kind, plugin = find_plugin(name)
    click.echo(f"{kind} {name}\n{text_of(plugin)}")


@click.command()
def schema() -> None:
    """Print the JSON Schema of configurations, for completion in editors."""
    from gen_data.generator.assemble.config_schema import config_schema

    click.echo(json.dumps(config_schema(), indent=2, sort_keys=True))
