"""The documentation site: the generated reference is complete, and every picture is there."""

import re
from functools import cache
from pathlib import Path
from typing import Any

import click
import pytest
from PIL import Image

from docs import pictures
from docs.hooks import plugin_reference
from docs.hooks.command_reference import command_page
from docs.hooks.family_reference import family_section
from docs.hooks.narrow_tables import with_breaks
from gen_data import configs, scene_templates
from gen_data.assemble.plugin_tables import TABLES
from gen_data.assets.families import own_families
from gen_data.assets.family import Family
from gen_data.assets.library import open_library
from gen_data.cli.main import cli
from gen_data.config.distributions import DISTRIBUTIONS
from gen_data.config.yaml_tree import parse_yaml
from gen_data.randomizers.lighting import Lighting

PICTURES_MAX_MB = 4.0
ROOT = Path(__file__).parents[2]


@cache
def page_of(kind: str) -> str:
    return plugin_reference.plugin_page(kind, TABLES[kind])


def sections(page: str) -> dict[str, str]:
    """Texts of a page by the headings of the second level."""
    parts = re.split(r"^## (.*)$", page, flags=re.MULTILINE)
    return dict(zip(parts[1::2], parts[2::2], strict=True))


@pytest.mark.parametrize("kind", list(TABLES))
def test_every_plugin_is_there_with_every_field_and_a_valid_example(kind: str) -> None:
    """Headings are the names of the table, rows the fields; the example is read back."""
    table, texts = TABLES[kind], sections(page_of(kind))

    assert set(texts) - {"Mappings in fields"} == set(table.entries)
    for name in table.entries:
        model: Any = table.load(name)
        rows = re.findall(r"^\| `(\w+)` \|", texts[name], re.MULTILINE)
        assert sorted(rows) == sorted(model.model_fields)
        block = re.findall(r"^```yaml\n(.*?)^```$", texts[name], re.MULTILINE | re.DOTALL)[0]
        example: Any = parse_yaml(block, name).plain()
        entry = example[plugin_reference.KINDS[kind][1]]
        entry = entry if isinstance(entry, dict) else entry[0]
        plain = {table.tag: entry} if isinstance(entry, str) else entry
        assert plain[table.tag] == name
        model.model_validate(plain, strict=False)


@pytest.mark.parametrize("kind", list(TABLES))
def test_tables_of_fields_become_blocks_on_narrow_screens(kind: str) -> None:
    """Each is in an element of the class that docs/site.css rearranges."""
    page = page_of(kind)

    assert 1 <= page.count("| field |") == page.count('<div class="fields" markdown>\n\n| field |')


def test_code_in_cells_may_break_between_its_words_and_nowhere_else() -> None:
    """Tags, entities, other text of cells, and code outside of tables are unchanged."""
    page = (
        "<p><code>a/b</code></p><td class='x/y'>c/d <a href='e.f'><code>g_h/&lt;i</code></a></td>"
    )

    assert with_breaks(page) == page.replace("g_h/&lt;i", "g_<wbr>h/<wbr>&lt;i")


@pytest.mark.parametrize("kind", list(TABLES))
def test_headings_are_unique_and_links_lead_to_them(kind: str) -> None:
    """A second heading of the same name would get another anchor."""
    page = page_of(kind)
    anchors = [h.lower().replace(" ", "-") for h in re.findall(r"^##+ (.*)$", page, re.MULTILINE)]

    assert len(set(anchors)) == len(anchors)
    assert set(re.findall(r"\]\(#([^)]+)\)", page)) <= set(anchors)


def test_ranges_and_units_are_those_of_the_fields() -> None:
    """Hand-picked fields of a light."""
    assert plugin_reference.field_range(Lighting, "temperature_k") == "[1667, 25000]"
    assert plugin_reference.field_range(Lighting, "illuminance_lux") == ">= 0"
    assert plugin_reference.field_range(Lighting, "kind") == ""
    assert plugin_reference.field_unit("illuminance_lux") == "lx"
    assert plugin_reference.field_unit("luminance_cd_m2") == "cd/m²"
    assert plugin_reference.field_unit("speed_m_s") == "m/s"
    assert plugin_reference.field_unit("name") == ""


def test_distributions_templates_and_commands_are_complete() -> None:
    """The other generated pages list everything that the program knows."""
    assert set(sections(plugin_reference.distribution_page())) == set(DISTRIBUTIONS.entries)
    templates = {path.stem for path in Path(scene_templates.__path__[0]).glob("*.yaml")}
    assert set(sections(plugin_reference.template_page())) == templates
    commands = sections(command_page())
    for name in cli.list_commands(click.Context(cli)):
        assert f"gen-data {name}" in commands
        command = cli.get_command(click.Context(cli), name)
        assert command is not None
        for option in command.params:
            assert all(word in commands[f"gen-data {name}"] for word in option.opts[:1]) or (
                isinstance(option, click.Argument)
            )


def test_parameters_of_a_family_are_listed_with_their_values() -> None:
    """Draws of every variant, of some, and parameters with a default."""
    library, families = open_library(), own_families()

    def text(name: str) -> str:
        family = families[name]
        assert isinstance(family, Family)
        return "\n".join(family_section(name, family, library))

    assert text("chair").startswith("A chair for tables")
    assert "| `seat_m` | 0.44 to 0.47 |" in text("chair")
    assert "| `slats` | 2, 3; some variants |" in text("chair")
    assert "| `size_m` | default 4,4 |" in text("floor")


def test_every_plugin_with_an_effect_in_images_has_pictures_or_a_reason() -> None:
    """All randomizers, sensors, renderers and distributions are in docs/pictures.yaml."""
    listed = {(row.kind, row.name) for row in pictures.read_rows()}
    tables = [TABLES[kind] for kind in ("randomizer", "sensor", "renderer")] + [DISTRIBUTIONS]
    assert listed == {(table.kind, name) for table in tables for name in table.entries}


def test_every_configuration_has_a_picture_and_a_section_of_the_gallery() -> None:
    """Sheets and headings are the names of the shipped files."""
    shipped = {path.stem for path in Path(configs.__path__[0]).glob("*.yaml")}
    gallery = sections((ROOT / "docs/gallery.md").read_text("utf-8"))

    assert shipped <= set(gallery)
    for name in shipped:
        shown = f"(pictures/configuration/{name}.webp)" in gallery[name]
        assert shown == (name in pictures.read_sheets())


def test_every_ladder_is_in_the_gallery() -> None:
    gallery = (ROOT / "docs/gallery.md").read_text("utf-8")
    ladders = pictures.read_ladders()

    assert ladders
    for name, strip in ladders.items():
        path = pictures.strip_path(pictures.LADDER, name, strip).relative_to(pictures.DOCS)
        assert f"({path.as_posix()})" in gallery


def test_pictures_are_drawn_and_small() -> None:
    """One file per entry and no other; each has as many columns as its strip."""
    jobs = list(pictures.find_jobs())
    paths = [job.path for job in jobs]

    assert len(set(paths)) == len(paths)
    # Photographs of the live page are made in a browser.
    drawn = set(pictures.FOLDER.rglob("*.webp")) - set(pictures.FOLDER.glob("edit/*"))
    assert set(paths) == drawn
    assert sum(path.stat().st_size for path in paths) < PICTURES_MAX_MB * 1e6
    for job in jobs:
        if isinstance(job.entry, pictures.Strip):
            columns = len(job.entry.values)
            width = columns * (pictures.WIDTH_PX + pictures.GAP_PX) - pictures.GAP_PX
            with Image.open(job.path) as picture:
                assert picture.width == width, job.path


@pytest.mark.parametrize(
    "job", [job for job in pictures.find_jobs() if job.kind in ("sensor", "renderer")][::12],
    ids=lambda job: job.path.stem,
)  # fmt: skip
def test_configurations_of_strips_are_valid(job: pictures.Job) -> None:
    """Fields and values exist; the others are checked when they are drawn."""
    strip = job.entry
    assert isinstance(strip, pictures.Strip)
    assert len(pictures.strip_configurations(strip)) == len(strip.values)
