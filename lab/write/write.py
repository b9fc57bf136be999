"""A sentence becomes a configuration: the conversation with a model, and the checks of its replies.

A reply is foreign input. It names shipped files, plug-ins and assets, and no others: it is read in
an empty folder, texts that could be paths out of it are refused, and nothing is fetched meanwhile.
"""

import os
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from gen_data.api.config import load_config
from gen_data.assemble.config import Config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.assets.paths import offline
from gen_data.config.problems import Problems, format_path
from gen_data.config.yaml_tree import Node, parse_yaml
from gen_data.core.errors import ConfigError, GenDataError
from gen_data.core.temporary_folders import temporary_folder
from gen_data.lab.write.language_model import LanguageModel, Message
from gen_data.lab.write.vocabulary import Vocabulary, choose_vocabulary
from gen_data.runner.recipe import yaml_lines

TURNS = 4
SENTENCE_CHARS_MAX = 2000
CONFIG_CHARS_MAX = 20_000
ERRORS_CHARS_MAX = 4000
MEGAPIXELS_MAX = 40.0
"""Of all images of one sample; a preview is to be quick."""

_OUTSIDE = re.compile(r"^[/~\\]|^[A-Za-z]:[\\/]|(^|[/\\])\.\.([/\\]|$)|://|\0")
"""Beginnings and parts of texts that are paths out of a folder, or URLs."""


@dataclass(frozen=True)
class Written:
    """A configuration that was checked.

    Attributes:
        text: The file, with the sentence as comment.
        config: As it was loaded.
        turns: Replies that were needed.
    """

    text: str
    config: Config
    turns: int


def write_config(
    sentence: str,
    model: LanguageModel,
    out: Path,
    *,
    turns: int = TURNS,
    show: Callable[[Config], object] | None = None,
    on_errors: Callable[[str], object] | None = None,
    vocabulary: Vocabulary | None = None,
) -> Written:
    """Ask a model for a configuration until it is right; nothing is written.

    Args:
        sentence: Content of the data set, in words.
        model: Answers.
        out: File of the configuration, for messages; shipped files must not be hidden by its
            neighbours.
        turns: Most replies.
        show: Draws samples; an error of it is an error of the configuration.
        on_errors: Told the errors of every reply that is wrong.
        vocabulary: See ``choose_vocabulary``; None = the one for the sentence.

    Raises:
        ConfigError: the last reply is wrong too, or the model gives none.
    """
    sentence = sentence.strip()
    if not 0 < len(sentence) <= SENTENCE_CHARS_MAX:
        raise ConfigError(f"expected a sentence of 1 to {SENTENCE_CHARS_MAX} characters")
    with offline():
        told = choose_vocabulary(sentence) if vocabulary is None else vocabulary
        begin = (Message("system", told.prompt), Message("user", sentence))
        # A conversation keeps its latest reply only: its length is bounded.
        latest: tuple[Message, ...] = ()
        for turn in range(1, turns + 1):
            reply = model.reply((*begin, *latest), told.schema)
            text = reply
            try:
                text = as_yaml(reply, sentence, out.name)
                config = check(text, out)
                if show is not None:
                    show(config)
                return Written(text, config, turn)
            except GenDataError as error:
                errors = str(error)[:ERRORS_CHARS_MAX]
            if on_errors is not None:
                on_errors(errors)
            latest = (
                Message("assistant", text[:CONFIG_CHARS_MAX]),
                Message("user", f"{errors}\nReply with the whole corrected configuration."),
            )
    raise ConfigError(f"no valid configuration (replies: {turns}); nothing was written")


def as_yaml(reply: str, sentence: str, name: str) -> str:
    """The configuration in a reply as a YAML file, whose lines messages refer to.

    Args:
        reply: JSON or YAML; a fence, and thoughts before it, are left out.
        sentence: Becomes a comment.
        name: The file's, in messages.

    Raises:
        ConfigError: it has no mapping, or is too long.
    """
    answer = reply.rpartition("</think>")[2]
    fenced = re.findall(r"```[a-z]*\s*\n(.*?)```", answer, re.DOTALL)
    body = (fenced[-1] if fenced else answer).strip()
    if len(body) > CONFIG_CHARS_MAX:
        raise ConfigError(f"{name}: has {len(body)} characters; expected {CONFIG_CHARS_MAX}")
    comment = " ".join(sentence.split())
    head = ("# Written by gen-data write, from this sentence:", f"# {comment}")
    return "\n".join((*head, *yaml_lines(parse_yaml(body, name).plain()), ""))


def check(text: str, out: Path) -> Config:
    """Validate a configuration as a run would, without its files.

    Raises:
        GenDataError: it is wrong, reaches out of its folder, or has images of more than
            ``MEGAPIXELS_MAX``.
    """
    _refuse_files(parse_yaml(text, out.name), out.parent)
    with temporary_folder("write") as folder:
        path = folder / out.name
        path.write_text(text, "utf-8")
        try:
            config = load_config(path)
            factory = PipelineFactory(config, n=1)
            factory.check()
        except GenDataError as error:
            # The model sees the name of the file only.
            raise type(error)(str(error).replace(f"{folder}{os.sep}", "")) from None
    sizes = [getattr(sensor, "size_px", None) or (0, 0) for sensor in config.sensors]
    megapixels = sum(width * height for width, height in sizes) / 1e6
    if megapixels > MEGAPIXELS_MAX:
        raise ConfigError(
            f"{out.name}: sensors: images have {megapixels:.0f} megapixels a sample; expected at "
            f"most {MEGAPIXELS_MAX:g}: set a smaller size_px"
        )
    return config


def _refuse_files(document: Node, neighbours: Path) -> None:
    """Refuse texts that name files which are not shipped.

    Raises:
        ConfigError: there are some; each has its place.
    """
    problems = Problems()
    if "assets" in document.entries:
        fact = "files of the user; expected assets of gen-data only"
        problems.add(document.key_position("assets"), "assets", fact)
    for key in document.entries.keys() - {"dataset", "assets"}:
        for path, node in _texts(document.entries[key], (key,)):
            text = str(node.content)
            if _OUTSIDE.search(text):
                fact = "is a path or a URL; expected a name of the vocabulary"
                problems.add(node.position, format_path(path), fact)
            elif _is_file(neighbours / text) or _is_file(neighbours / f"{text}.yaml"):
                fact = f"names a file next to {document.position.file}; expected shipped ones only"
                problems.add(node.position, format_path(path), fact)
    problems.raise_if_any()


def _texts(node: Node, path: tuple[str | int, ...]) -> Iterator[tuple[tuple[str | int, ...], Node]]:
    """All texts below a node, with their places."""
    if isinstance(node.content, str):
        yield path, node
    for part, child in node.children.items():
        yield from _texts(child, (*path, part))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
