"""``gen-data``: commands and exit codes.

Imports are few here: each command imports its modules when it runs.
"""

import os
import shlex
import sys
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import click
from click.core import ParameterSource

from gen_data.cli.options import (
    cluster_options,
    configuration_options,
    parse_shards,
)
from gen_data.cli.stop_signals import handle_stop_signals, ignore_stop_signals, is_stop_requested
from gen_data.core import errors, processes, version
from gen_data.core.urls import is_url, needs_folder

FOLDERS_ONLY = frozenset(
    "adapt certify contact-sheet diff edit export match merge preview recipe repair report".split()  # noqa: SIM905
) | {"ladder", "repro", "rerender", "sample", "study"}
"""Commands that read no data set at a URL."""


class LazyCommands(click.Group):
    """A group of commands that are imported on demand."""

    modules = {  # noqa: RUF012
        "init": "gen_data.cli.init_command:init",
        "write": "gen_data.lab.write.write_command:write",
        "plan": "gen_data.cli.plan_command:plan",
        "sample": "gen_data.cli.sample_command:sample",
        "export": "gen_data.cli.export_command:export",
        "rerender": "gen_data.cli.rerender_command:rerender",
        "edit": "gen_data.lab.edit.edit_command:edit",
        "preview": "gen_data.cli.preview_commands:preview",
        "contact-sheet": "gen_data.cli.preview_commands:contact_sheet",
        "assets": "gen_data.cli.asset_commands:assets",
        "cache": "gen_data.cli.cache_commands:cache",
        "report": "gen_data.cli.report_command:report",
        "study": "gen_data.lab.study.study_command:study",
        "adapt": "gen_data.lab.study.adapt_command:adapt",
        "ladder": "gen_data.lab.study.ladder_command:ladder",
        "match": "gen_data.lab.matching.match_command:match",
        "verify": "gen_data.cli.verification_commands:verify",
        "certify": "gen_data.lab.certificate.certify_command:certify",
        "recipe": "gen_data.cli.recipe_commands:recipe",
        "pull": "gen_data.cli.recipe_commands:pull",
        "merge": "gen_data.cli.merge_command:merge",
        "repair": "gen_data.cli.verification_commands:repair",
        "diff": "gen_data.cli.verification_commands:diff",
        "repro": "gen_data.cli.verification_commands:repro",
        "describe": "gen_data.cli.info_commands:describe",
        "formats": "gen_data.cli.info_commands:formats",
        "schema": "gen_data.cli.info_commands:schema",
        "completion": "gen_data.cli.init_command:completion",
        "doctor": "gen_data.cli.doctor:doctor",
    }
    summaries = {  # noqa: RUF012
        "init": "Write a commented configuration and template to start from.",
        "write": "Write a configuration from a sentence, by a language model.",
        "plan": "Print shards, size, categories and exports of a run, without rendering.",
        "sample": "Write one sample of a configuration or of a data set.",
        "export": "Write a finished data set in other formats, without rendering.",
        "rerender": "Render the scenes of a data set again: other sensors, weather, light.",
        "edit": "Edit a configuration, or browse a data set, in the browser, with live samples.",
        "preview": "Show samples in Rerun: live, in a browser, or as a .rrd file.",
        "contact-sheet": "Draw samples with their labels on one PNG.",
        "assets": "Install, list, show, verify and remove packs of assets.",
        "cache": "Show or clear caches of assets, data sets at URLs, and kernels.",
        "report": "Statistics of a data set, and an HTML page with its samples.",
        "study": "Measure the value of changes of a configuration on real pictures.",
        "adapt": "Draw more of the objects that a detector missed: the next round of a curriculum.",
        "ladder": "Generate the same scenes at several steps of one factor, and judge by them.",
        "match": "Fit exposure, colour, noise, blur and laser to real recordings.",
        "verify": "Check a data set: sizes, checksums, labels, reproducibility.",
        "certify": "Check a data set by independent means; write its certificate.",
        "recipe": "Print the recipe of a data set: a few kilobytes that make it again.",
        "pull": "Make the data set of a recipe, and prove that it is the same.",
        "merge": "Join parts that were generated with --shards.",
        "repair": "Restore damaged files of a data set, byte for byte.",
        "diff": "Name the first difference of two data sets.",
        "repro": "Generate one sample by itself and compare it with the stored one.",
        "describe": "Explain a plug-in, distribution, template or configuration.",
        "formats": "List the output formats.",
        "schema": "Print the JSON Schema of configurations.",
        "completion": "Print the completion script of a shell.",
        "doctor": "Check this machine: load and try every engine.",
    }

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order of the help."""
        del ctx
        return list(self.modules)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None if unknown."""
        del ctx
        if cmd_name not in self.modules:
            return None
        import importlib

        module, _, attribute = self.modules[cmd_name].partition(":")
        command: click.Command = getattr(importlib.import_module(module), attribute)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command; refuses URLs in the place of folders.

        Raises:
            ConfigError: there is no such command, or it reads or writes folders only.
        """
        if args[0] not in self.modules:
            raise errors.ConfigError(_no_command(args, list(self.modules)))
        name, command, rest = super().resolve_command(ctx, args)
        urls = [argument for argument in rest if is_url(argument)]
        if urls and name in FOLDERS_ONLY:
            raise errors.ConfigError(needs_folder(urls[0]))
        return name, command, rest

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing them."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl(list(self.summaries.items()))


GENERATING = frozenset({"generate", "run", "gen", "create", "make", "build"})
"""Words that stand for generating elsewhere; here a configuration does it."""


def _no_command(args: list[str], known: list[str]) -> str:
    """Message for a command line whose first word is not a command."""
    from importlib.resources import files

    word = args[0]
    rest = args[1:] if word in GENERATING else args
    shipped = files("gen_data.configs") / f"{word.removesuffix('.yaml')}.yaml"
    if word in GENERATING or word.endswith((".yaml", ".yml")) or shipped.is_file():
        named = [*([] if "--config" in rest or "-c" in rest else ["--config"]), *rest]
        return f"there is no command '{word}'; did you mean: {shlex.join(['gen-data', *named])}"
    hint = errors.did_you_mean(word, known)
    return f"there is no command '{word}'{hint}; see: gen-data --help"


HELP = """Generate a labelled synthetic data set.

\b
gen-data --config tabletop.yaml --n 1000
gen-data --config tabletop.yaml --n 1000 --set randomizers.clutter.count=20
gen-data --config tabletop.yaml --n 1000 --without colors --out ablation

An interrupted run is resumed by the same command. Exit codes: 0 done, 2 configuration or usage,
3 asset, 4 storage (resumable), 5 determinism, 6 sample, 7 verification, 8 certification,
9 finished without any label, 10 finished without samples that failed, 130 interrupted.
"""


@click.group(cls=LazyCommands, invoke_without_command=True, help=HELP)
@click.version_option(version.__version__, prog_name="gen-data")
@click.option("--config", "-c", metavar="FILE", help="Configuration: a path, or a shipped name.")
@click.option("--n", "-n", type=int, help="Number of samples.")
@click.option(
    "--out", "-o", metavar="FOLDER", help="Folder, or URL such as s3://... [default: out/<config>]."
)
@click.option("--workers", "-w", type=int, help="Worker processes [default: one per core].")
@click.option("--repair", is_flag=True, help="Hash existing files first; restore damaged ones.")
@click.option(
    "--allow-mixed-numerics",
    is_flag=True,
    help="Resume on a machine whose computations differ in the last bits.",
)
@click.option("--force", is_flag=True, help="Start although the disk is probably too small.")
@click.option(
    "--skip-failed", is_flag=True, help="Go on without samples that fail; exit code 10 then."
)
@click.option(
    "--sample-timeout",
    "sample_timeout_s",
    type=float,
    metavar="SECONDS",
    help="A sample that takes longer hangs; no second try [default: 300 s, 3 tries].",
)
@click.option(
    "--shards",
    callback=parse_shards,
    metavar="A:B",
    help="Generate shards A to B - 1 only; see merge.",
)
@cluster_options
@configuration_options
@click.pass_context
def cli(context: click.Context, /, config: str | None, n: int | None, **keywords: Any) -> None:
    """Generate a data set, unless a command follows."""
    given = _given_options(context)
    if context.invoked_subcommand is not None:
        if config is not None:
            raise errors.ConfigError(
                f"--config cannot precede a command; expected: "
                f"gen-data {context.invoked_subcommand} {config}"
            )
        if given:
            command = context.invoked_subcommand
            raise errors.ConfigError(
                f"{given[0]} cannot precede a command; expected it after {command}"
            )
        return
    if config is None:
        if given:
            raise errors.ConfigError(
                "--config is missing: a file, or the name of a shipped configuration"
            )
        click.echo(context.get_help())
        return
    if n is None:
        raise errors.ConfigError("--n is missing: how many samples?")
    from gen_data.cli.generate_command import generate_with_progress

    generate_with_progress(config, n, **keywords)


def _given_options(context: click.Context) -> list[str]:
    """Options on the command line, such as ``--config``."""
    return [
        parameter.opts[0]
        for parameter in context.command.params
        if context.get_parameter_source(parameter.name or "") is ParameterSource.COMMANDLINE
    ]


def main() -> None:
    """Run the command line and exit with its code."""
    for name in processes.SINGLE_THREADED:
        os.environ[name] = "1"
    # A cluster that a run starts reports nothing to anybody.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    # A reader of exports that certificates use queries no hub.
    os.environ.setdefault("HF_HUB_OFFLINE", "1")
    warnings.showwarning = partial(_show_warning, warnings.showwarning)
    code = _exit_code()
    if code == errors.Interrupted.exit_code:
        ignore_stop_signals()
    sys.exit(code)


def _show_warning(
    show_others: Callable[..., None],
    message: Warning | str,
    category: type[Warning],
    *place: Any,
    **options: Any,
) -> None:
    """Print our own warnings as plain messages, and warnings of libraries as usual."""
    if category in (FutureWarning, errors.AssetWarning, errors.ConfigWarning, errors.CacheWarning):
        click.echo(f"gen-data: warning: {message}", err=True)
    else:
        show_others(message, category, *place, **options)


def _exit_code() -> int:
    try:
        handle_stop_signals()
        cli.main(standalone_mode=False)
    except click.exceptions.Exit as leave:
        return leave.exit_code
    except click.ClickException as usage:
        click.echo(f"gen-data: {usage.format_message()}", err=True)
        return errors.ConfigError.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("gen-data: interrupted", err=True)
        return errors.Interrupted.exit_code
    except BrokenPipeError:
        # The reader of the output has closed it, as in `| head`.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except errors.GenDataError as error:
        if os.environ.get("GEN_DATA_DEBUG"):
            raise
        click.echo(f"gen-data: {error}", err=True)
        return error.exit_code
    except Exception as error:
        # Libraries turn a KeyboardInterrupt in their imports or callbacks into other errors.
        if is_stop_requested():
            click.echo("gen-data: interrupted", err=True)
            return errors.Interrupted.exit_code
        lacking = errors.lack_of_memory(error)
        if not lacking:
            raise
        click.echo(f"gen-data: {lacking}", err=True)
        return errors.OutOfMemory.exit_code
    return 0
