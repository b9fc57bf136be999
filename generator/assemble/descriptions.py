"""Descriptions of everything that a configuration can contain, by name."""

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel

from gen_data.assemble.config import GeneralSettings
from gen_data.assemble.plugin_tables import TABLES, find_plugin
from gen_data.assets import asset_ids, families
from gen_data.config.describe import TEXT_WIDTH, describe
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.packs.provision import open_assets

SECTION = "section"
"""Kind of the mappings of a configuration that are not plug-ins."""


def describe_name(name: str) -> str:
    """Kind, name and description of a plug-in, section, nested mapping or family of assets.

    Args:
        name: ``coco``, ``exporter/coco``, ``labels``, ``labels.map``, ``rgb_camera.lens``,
            ``brown_conrady``, ``desk``; a family of assets has the name of a plug-in:
            ``asset_family/overpass``.

    Raises:
        ConfigError: there is nothing of that name; the message has the nearest.
    """
    first, *path = name.split(".")
    found = [(first, model) for model in _start(first)]
    for field in path:
        below = [
            (at, one)
            for place, model in found
            for at, all_ in _fields(place, model)
            for one in all_
        ]
        found = [(at, one) for at, one in below if at.endswith(f".{field}")]
        if not found:
            ends = sorted({at.rpartition(".")[2] for at, _ in below})
            raise ConfigError(
                f"'{name}': there is no mapping '{field}' to describe; expected one of "
                f"{', '.join(ends) or 'none'}{did_you_mean(field, ends)}"
            )
    if not found:
        found = _selected_by(first)
    if found:
        return "\n".join(f"{_title(at, model)}\n{describe(model)}" for at, model in found)
    family = name.removeprefix(f"{families.KIND}/")
    if family in families.known_families() and (name != family or not _is_plugin(name)):
        return f"{families.KIND} {family}\n{_describe_family(family)}"
    try:
        kind, plugin = find_plugin(first)
    except ConfigError as error:
        known = {*_sections(), *_words(), *(n for t in TABLES.values() for n in t)}
        known |= families.known_families().keys()
        short = first.rpartition("/")[2]
        if "several" in str(error):
            raise
        raise ConfigError(
            f"there is nothing '{name}' to describe{did_you_mean(short, known)}; see: "
            "gen-data describe"
        ) from None
    return f"{kind} {first}\n{describe(plugin)}"


def _is_plugin(name: str) -> bool:
    return any(name in table for table in TABLES.values())


def _describe_family(name: str) -> str:
    """Summary of a family of assets, its parameters with their values, and an example."""
    family = families.known_families()[name]
    lines = [_fill(families.family_summary(family)), ""]
    lines += [f"{key}: default {_in_id(value)}" for key, value in family.parameters.items()]
    if not family.variants:
        return "\n".join(lines) + "\n"
    lines += [f"seed: the variants 0 to {family.variants - 1} are offered for selection; default 0"]
    drawn = open_assets().parameters(name)
    for parameter in drawn:
        some = "" if parameter.is_common else " (of some variants)"
        lines.append(_fill(f"{parameter.name}: {parameter.words()}{some}", "        "))
    lines += ["", "Values that an id does not give are drawn from the seed. Example:"]
    asked = [f"{p.name}={_in_id(p.values[0])}" for p in drawn[:1] if p.is_common]
    return "\n".join((*lines, f"  asset: {name}?{'&'.join((*asked, 'seed=0'))}")) + "\n"


def _in_id(value: Any) -> str:
    return asset_ids.format_parameter(round(value, 3) if isinstance(value, float) else value)


def _fill(text: str, others: str = "") -> str:
    return textwrap.fill(text, TEXT_WIDTH, subsequent_indent=others, break_on_hyphens=False)


def described_models(kind: str) -> Iterator[tuple[str, type[BaseModel]]]:
    """Paths and models of all plug-ins of a kind, or of all sections, with nested mappings."""
    if kind == SECTION:
        roots: Mapping[str, Any] = {f"{SECTION}/{name}": m for name, m in _sections().items()}
    else:
        roots = {f"{kind}/{name}": TABLES[kind].load(name) for name in TABLES[kind]}
    for name, model in roots.items():
        if isinstance(model, type) and issubclass(model, BaseModel):
            yield from _tree(name, model, ())


def list_names_of(names: Mapping[str, Iterable[str]]) -> str:
    """Names by kind, wrapped."""
    return "\n".join(
        textwrap.fill(
            f"{kind}: {', '.join(listed)}",
            TEXT_WIDTH,
            subsequent_indent="  ",
            break_on_hyphens=False,
        )
        for kind, listed in names.items()
    )


def section_names() -> tuple[str, ...]:
    """Names of the mappings of a configuration that are not plug-ins."""
    return tuple(_sections())


def _start(name: str) -> list[type[BaseModel]]:
    """The model of a section or plug-in."""
    kind, _, short = name.rpartition("/")
    if kind in ("", SECTION) and short in _sections():
        return [_sections()[short]]
    hits = [k for k, t in TABLES.items() if short in t and kind in ("", k)]
    plugins = [TABLES[hits[0]].load(short)] if len(hits) == 1 else []
    return [p for p in plugins if isinstance(p, type) and issubclass(p, BaseModel)]


def _sections() -> dict[str, type[BaseModel]]:
    found = {}
    for name, info in GeneralSettings.model_fields.items():
        for model in _models(info.annotation):
            found[name] = model
    return found


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)


def _fields(name: str, model: type[BaseModel]) -> Iterator[tuple[str, list[type[BaseModel]]]]:
    for field, info in model.model_fields.items():
        nested = list(_models(info.annotation))
        if nested:
            yield f"{name}.{field}", nested


def _tree(
    name: str, model: type[BaseModel], above: tuple[type, ...]
) -> Iterator[tuple[str, type[BaseModel]]]:
    yield name, model
    for path, nested in _fields(name, model):
        for one in nested:
            if one not in above:
                yield from _tree(path, one, (*above, model))


def _tags(model: type[BaseModel]) -> list[str]:
    """Values of a model's fields that have one value: words that select it."""
    constants = (get_args(info.annotation) for info in model.model_fields.values())
    return [values[0] for values in constants if len(values) == 1 and isinstance(values[0], str)]


def _words() -> dict[str, dict[type[BaseModel], str]]:
    words: dict[str, dict[type[BaseModel], str]] = {}
    for kind in (*TABLES, SECTION):
        for path, model in described_models(kind):
            if "." in path:
                for word in _tags(model):
                    words.setdefault(word, {}).setdefault(model, path)
    return words


def _selected_by(word: str) -> list[tuple[str, type[BaseModel]]]:
    if any(word in table for table in TABLES.values()) or "/" in word:
        return []
    return [(path, model) for model, path in _words().get(word, {}).items()]


def _title(path: str, model: type[BaseModel]) -> str:
    """Kind and name of a section or plug-in, or the path of a nested mapping."""
    kind, _, name = path.rpartition("/")
    if kind or "." in name:
        words = _tags(model) if "." in name else []
        return f"{path}{f' ({words[0]})' if words else ''}"
    if name in _sections():
        return f"{SECTION} {name}"
    return f"{find_plugin(name)[0]} {name}"
