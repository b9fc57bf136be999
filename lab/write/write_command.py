"""``gen-data write``: a configuration from a sentence."""

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from gen_data.core.errors import ConfigError
from gen_data.core.whole_files import check_new, write_whole

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.lab.write.language_model import LanguageModel

KEY = "GEN_DATA_WRITE_KEY"
HELP = """Write a configuration from a sentence, by a language model of your choice.

Its replies are checked as files of strangers. Errors are sent back to it, a few times; a valid
configuration is planned and drawn on a contact sheet, and written after your consent.

\b
gen-data write "mugs on a table" --url http://localhost:8080/v1
gen-data write "a wet street at night" --url https://HOST/v1 --model NAME
gen-data write "parts in a bin" --command "llm -m MODEL"

The key of a server is read from the environment only (GEN_DATA_WRITE_KEY, or --key-variable).
"""


@click.command("write", help=HELP)
@click.argument("sentence")
@click.option("--url", help="Server with OpenAI's interface, such as llama.cpp's.")
@click.option("--command", help="Command that reads the conversation and prints the reply.")
@click.option("--model", default="", help="Name of the model at the server.")
@click.option("--key-variable", default=KEY, show_default=True, help="Holds the server's key.")
@click.option(
    "--out",
    "-o",
    type=click.Path(path_type=Path),
    default=Path("scene.yaml"),
    show_default=True,
    help="The configuration to write; its contact sheet is a PNG of that name.",
)
@click.option(
    "--turns", type=click.IntRange(1, 20), default=4, show_default=True, help="Most replies."
)
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=300.0,
    show_default=True,
    help="Longest time of a reply [s].",
)
@click.option(
    "--samples", type=click.IntRange(1), default=6, show_default=True, help="Samples on the sheet."
)
@click.option("--yes", is_flag=True, help="Write without asking.")
@click.option("--force", is_flag=True, help="Replace existing files.")
def write(
    sentence: str,
    url: str | None,
    command: str | None,
    model: str,
    key_variable: str,
    out: Path,
    turns: int,
    timeout: float,
    samples: int,
    yes: bool,
    force: bool,
) -> None:
    """Write a configuration from a sentence."""
    sheet = out.with_suffix(".png")
    if out.suffix not in (".yaml", ".yml"):
        raise ConfigError(f"--out: {out}; expected a name that ends with .yaml")
    check_new((out, sheet), force=force)
    asked = _open_model(url, command, model, os.environ.get(key_variable, ""), timeout)
    from rich.console import Console

    from gen_data.cli.plan_command import plan_rows
    from gen_data.cli.tables import print_facts
    from gen_data.lab.write.write import write_config
    from gen_data.runner.durable_files import storage_errors

    drawn: list[bytes] = []

    def show(config: "Config") -> None:
        drawn[:] = [_draw(config, samples)]

    def tell(errors: str) -> None:
        click.echo(f"{errors}\nThese errors are sent back.\n", err=True)

    written = write_config(sentence, asked, out, turns=turns, show=show, on_errors=tell)
    click.echo(written.text)
    print_facts(Console(), f"{out.stem}: 100 samples", list(plan_rows(written.config, 100)))
    with storage_errors(sheet, ""):
        write_whole({sheet: drawn[0]})
        click.echo(f"{sheet}: {samples} samples")
        if not yes and not click.confirm(f"write {out}?"):
            raise click.Abort
        write_whole({out: written.text.encode()})
    click.echo(f"{out}: written (replies: {written.turns}); gen-data --config {out} --n 100")


def _open_model(
    url: str | None, command: str | None, model: str, key: str, timeout_s: float
) -> "LanguageModel":
    from gen_data.lab.write.language_model import ModelCommand, ModelServer

    if (url is None) == (command is None):
        raise ConfigError("expected one of --url and --command")
    if url is not None:
        return ModelServer(url, model, key, timeout_s)
    try:
        return ModelCommand(shlex.split(command or ""), timeout_s)
    except ValueError as error:
        raise ConfigError(f"--command: {error}") from None


def _draw(config: "Config", count: int) -> bytes:
    """PNG of samples with their labels."""
    import cv2

    from gen_data.assemble.pipeline_factory import open_pipeline
    from gen_data.core.capture import Channel
    from gen_data.preview.contact_sheet import arrange_tiles, make_tiles, render_tiles

    with open_pipeline(config) as pipeline:
        # One view of each scene: views of one scene look alike.
        step = config.general.views_per_scene * config.general.steps_per_scene
        samples = (pipeline.sample(index * step) for index in range(count))
        channels = dict.fromkeys(pipeline.info.cameras, (Channel.RGB,))
        tiles = render_tiles(make_tiles(samples, channels, labels=True), 320, captions=False)
    done, data = cv2.imencode(".png", arrange_tiles(tiles, 0)[..., ::-1])
    assert done
    return data.tobytes()
