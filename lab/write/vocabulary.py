"""The knowledge of a language model: names, fields and assets that fit a sentence, within a bound.

The whole vocabulary has a megabyte. Everything is named; fields, and one shipped configuration, are
shown of the plug-ins that share the most and the rarest words with the sentence.
"""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from types import ModuleType
from typing import Any

import yaml

from gen_data import configs, scene_templates
from gen_data.assemble.config import PLUGIN_LISTS
from gen_data.assemble.config_schema import config_schema
from gen_data.assemble.plugin_tables import ANNOTATIONS
from gen_data.config.describe import describe_fields
from gen_data.config.distributions import DISTRIBUTIONS
from gen_data.config.schema import docstring_summary
from gen_data.packs.provision import open_assets

PROMPT_CHARS_MAX = 28_000
"""Some 8,000 tokens."""
DETAILED = 10
"""Plug-ins whose fields are shown."""
ASSETS_SHOWN = 60
COMMON = 0.3
"""Words in a larger share of the texts tell nothing, such as "with"."""

INSTRUCTIONS = """\
You write configurations of gen-data, a generator of synthetic images with exact labels.
Reply with one configuration as a JSON or YAML mapping, and nothing else.
- Begin with `extends: NAME.yaml` of the shipped configuration that is nearest, and change it; or
  with `template: NAME` and own randomizers, sensors, annotations and exporters.
- Lists merge by `name`: an item with an inherited name changes it, another one is added.
  `elements` is a mapping by name, `{table: {height_m: 0.9}}`; a new one needs its `type`.
  `without: {randomizers: [dash]}` leaves inherited items out.
- A value is a constant or a distribution: `count: {uniform_integer: [3, 9]}`.
- Lengths are metres, angles degrees (`_deg`), times seconds; world Z is up.
- Use names of this message only. No files and no paths: `assets` is not allowed.
- After an error, reply with the whole corrected configuration."""

_DROPPED = {"assets", "depth_scale_m", "skip_failed", "sample_timeout_s"}
"""Sections that a reply lacks: files of the user, and options of a run."""
_ANNOTATING = frozenset(
    {"description", "title", "default", "examples", "pattern", "format", "$schema"}
)
"""Keywords that constrain nothing, or in ways that grammars do not know."""


@dataclass(frozen=True)
class Vocabulary:
    """The knowledge of a model for one sentence.

    Attributes:
        prompt: The first message.
        schema: JSON Schema of a reply; it has the plug-ins whose fields are shown, and more.
    """

    prompt: str
    schema: Mapping[str, Any]


def choose_vocabulary(sentence: str) -> Vocabulary:
    """The vocabulary for a sentence; it has at most ``PROMPT_CHARS_MAX`` characters."""
    texts = {path.name: path.read_text("utf-8") for path in shipped(configs)}
    templates = {path.stem: path.read_text("utf-8") for path in shipped(scene_templates)}
    nearest = rank(sentence, {name: f"{name} {text}" for name, text in texts.items()})[0]
    summaries = {
        f"{key}/{name}": docstring_summary(table.load(name))
        for key, table in {**PLUGIN_LISTS, "annotations": ANNOTATIONS}.items()
        for name in table
    }
    types = re.findall(r"type: (\w+)", texts[nearest])
    used = [name for name in summaries if name.partition("/")[2] in types]
    order = rank(sentence, {name: f"{name} {text}" for name, text in summaries.items()})
    detailed = list(dict.fromkeys((*order[: DETAILED // 2], *used, *order)))[:DETAILED]
    parts = (
        INSTRUCTIONS,
        _part("Shipped configurations", (f"{n}: {_comment(t)}" for n, t in texts.items())),
        _part("Templates, with their elements", map(_template_line, templates, templates.values())),
        _part("Distributions", (f"{n}: {_distribution(n)}" for n in DISTRIBUTIONS)),
        *(
            _part(
                key, [", ".join(n.partition("/")[2] for n in summaries if n.startswith(f"{key}/"))]
            )
            for key in (*PLUGIN_LISTS, "annotations")
        ),
        _part("Assets: category (number), the fitting ones first", [_asset_line(sentence)]),
        _part(nearest, texts[nearest].splitlines()[1:]),
        *(_part(name, _fields(name, summaries[name])) for name in detailed),
    )
    return Vocabulary(_join(parts), reply_schema(detailed))


def reply_schema(detailed: Iterable[str]) -> dict[str, Any]:
    """JSON Schema of replies: names that exist, and the fields of some plug-ins."""
    whole, chosen = config_schema(), set(detailed)
    properties = {k: v for k, v in whole["properties"].items() if k not in _DROPPED}
    properties["extends"] = {"enum": [path.name for path in shipped(configs)]}
    properties["template"] = {"enum": [path.stem for path in shipped(scene_templates)]}
    for key, table in PLUGIN_LISTS.items():
        # Of others only the type is prescribed: all fields of all plug-ins have a megabyte.
        rest = [name for name in table if f"{key}/{name}" not in chosen]
        items: list[Any] = [
            {"$ref": f"#/$defs/{table.kind}.{n}"} for n in table if f"{key}/{n}" in chosen
        ]
        items.append(
            {"type": "object", "required": ["type"], "properties": {"type": {"enum": rest}}}
        )
        if key != "exporters":
            named = {"name": {"type": "string"}}
            items.append({"type": "object", "required": ["name"], "properties": named})
        listed = {"type": "array", "items": {"anyOf": items}}
        by_name = {"type": "object", "additionalProperties": {"type": "object"}}
        properties[key] = {"anyOf": [by_name, listed]} if key == "elements" else listed
    properties["render"] = {"type": "object"}
    schema = {"type": "object", "properties": properties, "additionalProperties": False}
    definitions, kept, wanted = whole["$defs"], {}, set(_references(schema))
    while wanted:
        name = min(wanted)
        kept[name] = definitions[name]
        wanted = (wanted | set(_references(kept[name]))) - kept.keys()
    plain: dict[str, Any] = _without_annotations({**schema, "$defs": kept})
    return plain


def shipped(package: ModuleType) -> list[Path]:
    """YAML files of a package."""
    return sorted(Path(str(files(package))).glob("*.yaml"))


def rank(sentence: str, texts: Mapping[str, str]) -> list[str]:
    """Names by the words that their texts share with a sentence: rare words, in short texts."""
    found = {name: words(text) for name, text in texts.items()}
    counts = Counter(word for own in found.values() for word in own)
    asked = {word for word in words(sentence) if counts[word] <= COMMON * len(texts)}

    def score(name: str) -> float:
        shared = sum(math.log(len(texts) / counts[word]) for word in asked & found[name])
        return shared / math.sqrt(len(found[name]) or 1)

    return sorted(texts, key=score, reverse=True)


def words(text: str) -> set[str]:
    """Words of a text without the endings of plurals."""
    return {word.removesuffix("s") for word in re.findall(r"[a-z]{3,}", text.lower())}


def _part(title: str, lines: Iterable[str]) -> str:
    return "\n".join((f"# {title}", *lines))


def _join(parts: Sequence[str]) -> str:
    """Parts in their order; lines beyond the bound are left out."""
    kept: list[str] = []
    left = PROMPT_CHARS_MAX
    for line in "\n\n".join(parts).split("\n"):
        left -= len(line) + 1
        if left < 0:
            break
        kept.append(line)
    return "\n".join(kept)


def _comment(text: str) -> str:
    """The first comment of a configuration, shortened to its first sentence."""
    lines = [line[2:] for line in text.splitlines() if re.match(r"# (?!yaml-)", line)]
    return " ".join(lines).split(". ")[0].split("   ")[0][:160]


def _template_line(name: str, text: str) -> str:
    elements = yaml.safe_load(text).get("elements", [])
    return f"{name}: {', '.join(str(e.get('name', e.get('type'))) for e in elements)}"[:300]


def _distribution(name: str) -> str:
    return docstring_summary(DISTRIBUTIONS.load(name))[:120]


def _asset_line(sentence: str) -> str:
    counts = Counter(asset.category for asset in open_assets().find(()))
    order = rank(sentence, {name: name.replace("_", " ") for name in sorted(counts)})
    return ", ".join(f"{name} ({counts[name]})" for name in order[:ASSETS_SHOWN])


def _fields(name: str, summary: str) -> Iterator[str]:
    key, _, plugin = name.partition("/")
    yield summary
    model: Any = (ANNOTATIONS if key == "annotations" else PLUGIN_LISTS[key]).load(plugin)
    if hasattr(model, "model_fields"):
        for row in describe_fields(model):
            default = "required" if row.default == "required" else f"default {row.default}"
            yield f"  {row.name}: {row.words}, {default}. {row.text}"[:220]


def _references(schema: Any) -> Iterator[str]:
    if isinstance(schema, Mapping):
        for key, value in schema.items():
            if key == "$ref":
                yield value.removeprefix("#/$defs/")
            else:
                yield from _references(value)
    elif isinstance(schema, list):
        for item in schema:
            yield from _references(item)


def _without_annotations(schema: Any, are_names: bool = False) -> Any:
    """The schema without keywords that constrain nothing; keys of ``properties`` are names."""
    if isinstance(schema, Mapping):
        return {
            key: _without_annotations(value, not are_names and key in ("properties", "$defs"))
            for key, value in schema.items()
            if are_names or key not in _ANNOTATING
        }
    return [_without_annotations(v) for v in schema] if isinstance(schema, list) else schema
