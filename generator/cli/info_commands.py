"""Commands that print information: ``describe``, ``formats``, ``schema``."""

import inspect
import json
import textwrap
from pathlib import Path

import click


@click.command()
@click.argument("name", required=False)
def describe(name: str | None) -> None:
    """Explain a plug-in, section, distribution, template, configuration or family of assets.

    NAME may be a nested mapping: labels.map, rgb_camera.lens, brown_conrady; or the part of
    asset ids before the question mark: desk. Without NAME, all but families are listed.
    """
    from gen_data.assemble.descriptions import describe_name, list_names_of, section_names
    from gen_data.assemble.plugin_tables import TABLES

    shipped = _shipped_texts()
    if name is None:
        click.echo(list_names_of({**TABLES, "section": section_names(), **shipped}))
        return
    name = name.removesuffix(".yaml")
    # A template may have the name of the configuration that uses it.
    found = [(kind, texts[name]) for kind, texts in shipped.items() if name in texts]
    for kind, text in found:
        click.echo(f"{kind} {name}\n{text}")
    if not found:
        click.echo(describe_name(name))


def _shipped_texts() -> dict[str, dict[str, str]]:
    from importlib.resources import files

    from gen_data.config.distributions import DISTRIBUTIONS

    documented = {name: DISTRIBUTIONS.load(name).__doc__ or "" for name in DISTRIBUTIONS}
    texts = {"distribution": {name: inspect.cleandoc(text) for name, text in documented.items()}}
    for kind, package in (
        ("template", "gen_data.scene_templates"),
        ("configuration", "gen_data.configs"),
    ):
        paths = sorted(Path(str(files(package))).glob("*.yaml"))
        texts[kind] = {path.stem: path.read_text("utf-8") for path in paths}
    return texts


@click.command()
def formats() -> None:
    """List the output formats."""
    from gen_data.config.describe import TEXT_WIDTH
    from gen_data.config.schema import docstring_summary
    from gen_data.exporters import TABLE

    width = max(map(len, TABLE)) + 2
    for name in TABLE:
        line = f"{name:<{width}}{docstring_summary(TABLE.load(name))}"
        click.echo(textwrap.fill(line, TEXT_WIDTH, subsequent_indent=" " * width))
    click.echo("\ngen-data describe NAME lists the fields of a format.")


@click.command()
def schema() -> None:
    """Print the JSON Schema of configurations, for completion in editors."""
    from gen_data.assemble.config_schema import config_schema

    click.echo(json.dumps(config_schema(), indent=2, sort_keys=True))
