"""Reference pages of plug-ins, distributions and templates, from the sources of ``describe``."""

import inspect
import re
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel

from docs import pictures
from gen_data.assemble.plugin_tables import TABLES
from gen_data.config.base_model import Strict
from gen_data.config.describe import describe_fields, make_example
from gen_data.config.distributions import DISTRIBUTIONS
from gen_data.config.schema import FieldSchema, docstring_summary
from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.plugins import PluginTable

KINDS = {
    "element": ("Elements", "elements", "An element adds its part to the scene of a template."),
    "randomizer": ("Randomizers", "randomizers", "A randomizer varies the scene."),
    "sensor": ("Sensors", "sensors", "A sensor measures the scene."),
    "annotation": ("Annotations", "annotations", "An annotation is a label to compute."),
    "exporter": ("Exporters", "exporters", "An exporter writes the data set in a format."),
    "renderer": ("Renderers", "render", "The renderer makes the images; the section `render:`."),
}
"""Title, key in YAML and introduction of each kind's page."""

UNITS = {
    "m": "m",
    "m_s": "m/s",
    "per_m": "1/m",
    "mm_h": "mm/h",
    "um": "µm",
    "nm": "nm",
    "s": "s",
    "hz": "Hz",
    "deg": "°",
    "mrad": "mrad",
    "px": "pixels",
    "lux": "lx",
    "lm": "lm",
    "cd": "cd",
    "cd_m2": "cd/m²",
    "k": "K",
    "ev": "stops",
    "e": "electrons",
    "e_s": "electrons/s",
    "kg": "kg",
}
"""Units by the end of a field's name (CONVENTIONS.md)."""


def plugin_pages() -> Iterator[tuple[str, str]]:
    """Yield path and Markdown of every generated page of the reference."""
    yield "reference/index.md", _index()
    for kind, table in TABLES.items():
        yield f"reference/{kind}.md", plugin_page(kind, table)
    yield "reference/distribution.md", distribution_page()
    yield "reference/template.md", template_page()


def plugin_page(kind: str, table: PluginTable[Any]) -> str:
    """The page of one kind: its plug-ins, then the mappings that their fields contain."""
    title, key, about = KINDS[kind]
    plugins: dict[str, Any] = {name: table.load(name) for name in own_names(table)}
    nested = list(dict.fromkeys(m for model in plugins.values() for m in _nested_models(model)))
    titles = {model: _mapping_title(model) for model in nested}
    lines = [f"# {title}", f"{about} `gen-data describe NAME` prints the same texts."]
    for name, model in plugins.items():
        lines += [f"## {name}", _body(model, titles), *_example(kind, key, name, model)]
        lines += _strips(kind, name)
    if nested:
        lines.append("## Mappings in fields")
    for model, heading in titles.items():
        lines += [f"### {heading}", _body(model, titles)]
    return "\n\n".join(lines) + "\n"


def distribution_page() -> str:
    """The page of the distributions, with histograms of draws."""
    lines = [
        "# Distributions",
        "A number is a constant; a mapping with one key is a distribution."
        " [Configurations](../configuration.md#values) shows how to use them."
        " Points of rotations and directions are on a sphere, seen with Z up.",
    ]
    for name in own_names(DISTRIBUTIONS):
        lines += [f"## {name}", _reflow(inspect.getdoc(DISTRIBUTIONS.load(name)) or "")]
        lines += _strips(pictures.DISTRIBUTION, name)
    return "\n\n".join(lines) + "\n"


def template_page() -> str:
    """The page of the scene templates: their files."""
    lines = [
        "# Templates",
        "A template lists the [elements](element.md) of a scene. A configuration names it,"
        " overrides its elements, and varies them.",
    ]
    for path in _template_files():
        text = path.read_text("utf-8")
        lines += [f"## {path.stem}", first_comment(text), yaml_block(text)]
    return "\n\n".join(lines) + "\n"


def _template_files() -> list[Path]:
    return sorted(Path(str(files("gen_data.scene_templates"))).glob("*.yaml"))


def own_names(table: PluginTable[Any]) -> list[str]:
    """Names of built-in plug-ins, sorted, without plug-ins of installed packages."""
    return sorted(table.entries)


def first_comment(text: str) -> str:
    """First paragraph of the comment at the top of a YAML file."""
    lines = [line for line in text.splitlines() if "yaml-language-server" not in line]
    said = []
    for line in lines:
        if not line.startswith("# "):
            break
        said.append(line[2:].strip())
    return " ".join(said)


def yaml_block(text: str) -> str:
    """A fenced block of YAML."""
    return f"```yaml\n{text.rstrip()}\n```"


def field_range(model: type[BaseModel], name: str) -> str:
    """Range of a number field: ``[0, 1]``, ``>= 0``; empty if it has none."""
    schema = FieldSchema.of(model).child(name)
    found = next((part.limits for part in (schema, *schema.branches) if part.limits), None)
    return str(found) if found else ""


def field_unit(name: str) -> str:
    """Unit at the end of a field's name; empty if it has none."""
    words = name.split("_")
    ends = ["_".join(words[first:]) for first in range(1, len(words))]
    return next(
        (UNITS[end] for end in ends if end in UNITS), UNITS["ev"] if name == "ev100" else ""
    )


def _index() -> str:
    lines = [
        "# Reference",
        "Generated from the sources; `gen-data describe` prints the same texts and examples.",
        "| kind | names |",
        "|---|---|",
    ]
    for kind, table in {**TABLES, pictures.DISTRIBUTION: DISTRIBUTIONS}.items():
        title = KINDS[kind][0] if kind in KINDS else "Distributions"
        links = ", ".join(f"[{name}]({kind}.md#{name})" for name in own_names(table))
        lines.append(f"| [{title}]({kind}.md) | {links} |")
    stems = sorted(
        path.stem for path in Path(str(files("gen_data.scene_templates"))).glob("*.yaml")
    )
    links = ", ".join(f"[{stem}](template.md#{stem})" for stem in stems)
    lines.append(f"| [Templates](template.md) | {links} |")
    lines.append("| [Families of assets](asset_family.md) | parameters of asset ids |")
    shipped = sorted(path.stem for path in Path(str(files("gen_data.configs"))).glob("*.yaml"))
    names = ", ".join(f"[{name}](../gallery.md#{name})" for name in shipped)
    lines.append(f"| [Configurations](../gallery.md) | {names} |")
    head, table_lines = lines[:2], lines[2:]
    return "\n\n".join([*head, "\n".join(table_lines)]) + "\n"


def _body(model: type, titles: Mapping[type, str]) -> str:
    parts = [_reflow(_without_sections(inspect.getdoc(model) or docstring_summary(model)))]
    if issubclass(model, BaseModel) and model.model_fields:
        parts.append(as_fields("\n".join(_field_table(model, titles))))
    return "\n\n".join(part for part in parts if part)


def as_fields(table: str) -> str:
    """A table whose rows docs/site.css shows as blocks on narrow screens."""
    return f'<div class="fields" markdown>\n\n{table}\n\n</div>'


def _field_table(model: type[BaseModel], titles: Mapping[type, str]) -> Iterator[str]:
    yield "| field | type | default | range | unit | description |"
    yield "|---|---|---|---|---|---|"
    for row in describe_fields(model):
        limits = field_range(model, row.name)
        words = _type_words(row.words, limits)
        links = [
            f"[{titles[m]}](#{_slug(titles[m])})"
            for m in _models_in(model.model_fields[row.name].annotation)
            if m in titles
        ]
        shown = _cell(words) if not links else f"{_cell(words)}: {', '.join(links)}"
        default = row.default if row.default == "required" else f"`{_cell(row.default)}`"
        unit = field_unit(row.name)
        cells = (_cell(limits), unit, _cell(_prose(row.text)))
        yield f"| `{row.name}` | {shown} | {default} | {' | '.join(cells)} |"


def _type_words(words: str, limits: str) -> str:
    """Words of a type without its range, and without the keys of a mapping."""
    if limits:
        words = words.replace(f" in {limits}", "").replace(f" {limits}", "")
    return re.sub(r"mapping(s?) (\([^)]*\)|with \w+: .*)", r"mapping\1", words)


def _example(kind: str, key: str, name: str, model: type) -> Iterator[str]:
    if kind == "annotation":
        yield yaml_block(f"annotations: [{name}]")
        return
    entry = make_example(model) if issubclass(model, Strict) else None
    if entry is None:
        return
    tag = TABLES[kind].tag
    entry = {tag: name, **{k: v for k, v in entry.items() if k != tag}}
    text = to_flow_yaml(entry) if kind == "renderer" else f"\n  - {to_flow_yaml(entry)}"
    yield yaml_block(f"{key}: {text}" if kind == "renderer" else f"{key}:{text}")


def _strips(kind: str, name: str) -> Iterator[str]:
    for row in pictures.read_rows():
        if (row.kind, row.name) != (kind, name):
            continue
        for strip in row.strips:
            path = pictures.strip_path(kind, name, strip).relative_to(pictures.DOCS)
            field = strip.field.split(".", 2)[-1] or "draws"
            alt = f"{name}: {field}"
            yield f"![{alt}](../{path})" + (f"\n\n{strip.about}" if strip.about else "")


def _nested_models(model: type) -> Iterator[type[BaseModel]]:
    if not issubclass(model, BaseModel):
        return
    for info in model.model_fields.values():
        for found in _models_in(info.annotation):
            yield found
            yield from _nested_models(found)


def _models_in(annotation: Any) -> Iterator[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _models_in(argument)


def _mapping_title(model: type) -> str:
    """Words of a class's name: ``Image pipeline``."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", model.__name__.lstrip("_"))
    return words[0] + words[1:].lower()


def _slug(heading: str) -> str:
    return heading.lower().replace(" ", "-")


def _without_sections(text: str) -> str:
    return re.split(r"\n(?:Attributes|Args|Raises|Returns):\n", text)[0]


def _reflow(text: str) -> str:
    """A docstring as Markdown: its sections become lists."""
    lines: list[str] = []
    for line in text.splitlines():
        section = re.fullmatch(r"(Attributes|Args|Raises|Returns):", line)
        entry = re.fullmatch(r"    ([\w, ]+): (.*)", line)
        if section:
            lines.append("")
        elif entry:
            lines.append(f"* `{entry[1]}`: {entry[2]}")
        elif line.startswith("        "):
            lines.append(f"  {line.strip()}")
        else:
            lines.append(line)
    return _prose("\n".join(lines))


def _prose(text: str) -> str:
    """Text of a docstring as Markdown; outside code, ``<`` does not begin a tag."""
    parts = text.replace("``", "`").split("`")
    parts[::2] = [part.replace("<", "&lt;") for part in parts[::2]]
    return "`".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
