"""Reference page of the command line, from the commands themselves."""

import inspect
from collections.abc import Iterator

import click

from docs.hooks.plugin_reference import as_fields
from gen_data.cli.main import cli


def command_page() -> str:
    """The page of all commands: usage, help, arguments and options."""
    lines = ["# Command line", "`gen-data COMMAND --help` prints the same texts."]
    for name, command in _commands(cli, "gen-data"):
        context = click.Context(command, info_name=name)
        usage = " ".join((name, *command.collect_usage_pieces(context)))
        lines += [f"## {name}", f"```text\n{usage}\n```", _help(command)]
        options = [p for p in command.get_params(context) if isinstance(p, click.Option)]
        rows = [_row(option, context) for option in options if not option.hidden]
        if rows:
            lines.append(as_fields("\n".join(("| option | default | |", "|---|---|---|", *rows))))
    return "\n\n".join(part for part in lines if part) + "\n"


def _commands(command: click.Command, name: str) -> Iterator[tuple[str, click.Command]]:
    """A command and, below it, the commands of a group, with their full names."""
    yield name, command
    if isinstance(command, click.Group):
        context = click.Context(command, info_name=name)
        for word in command.list_commands(context):
            found = command.get_command(context, word)
            if found is not None and not found.hidden:
                yield from _commands(found, f"{name} {word}")


def _help(command: click.Command) -> str:
    """Help as Markdown. Paragraphs that click prints verbatim begin with a backspace."""
    parts = []
    for part in inspect.cleandoc(command.help or "").split("\n\n"):
        verbatim = part.startswith("\b\n")
        parts.append(f"```text\n{part[2:]}\n```" if verbatim else part.replace("<", "&lt;"))
    return "\n\n".join(parts)


def _row(option: click.Option, context: click.Context) -> str:
    names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    if not option.is_flag:
        kind = option.make_metavar(context) if _takes_context(option) else option.make_metavar()  # type: ignore[call-arg]
        names += f" `{kind}`"
    default = option.get_default(context, call=False)
    shown = f"`{default}`" if option.show_default and default not in (None, ()) else ""
    text = (option.help or "").replace("<", "&lt;")
    # Bars in code need no escape, and would show it.
    return "| " + " | ".join((names, *(cell.replace("|", "\\|") for cell in (shown, text)))) + " |"


def _takes_context(option: click.Option) -> bool:
    """Whether this release of click passes the context to ``make_metavar``; 8.2 and later do."""
    return "ctx" in inspect.signature(option.make_metavar).parameters
