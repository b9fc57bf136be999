"""Documents: configurations in them are valid, links and names of modules exist."""

import importlib.util
import itertools
import re
import shlex
from pathlib import Path

import click
import pytest
import yaml

from gen_data.assemble.config import load_config
from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.cli.main import cli
from tests.tiers import slow

ROOT = Path(__file__).parents[2]
FOLDERS = ("*.md", "docs/*.md", "docs/decisions/*.md", "examples/**/*.md")
PAGES = sorted(path for pattern in FOLDERS for path in ROOT.glob(pattern))
TUTORIALS = sorted(ROOT.glob("docs/tutorials/*.md"))
OLD_NAMES = {ROOT / "docs/migration.md", ROOT / "CHANGELOG.md"}
"""Pages that list names which no longer exist."""

EXAMPLES = [
    (page, number, text)
    for page in PAGES
    for number, text in enumerate(
        re.findall(r"^```yaml\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    )
    if page not in OLD_NAMES
    and "licence:" not in text  # an index of assets, which has its own test
]


def completed(text: str, props: Path) -> str:
    """An excerpt of a configuration with the sections that it leaves out."""
    sections = yaml.safe_load(text)
    if not {"template", "extends"} & sections.keys() and not isinstance(
        sections.get("elements"), list
    ):
        in_street = any(word in text for word in ("lane_objects", "rig:"))
        text += f"template: {'street' if in_street else 'tabletop'}\n"
    if not {"sensors", "extends"} & sections.keys():
        text += "sensors: [{type: rgb_camera, name: color}]\n"
    return text.replace("~/props", str(props)).replace("user, metal", "user")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("page", "text"),
    [
        pytest.param(page, text, id=f"{page.name}-{number}", marks=slow if number else ())
        for page, number, text in EXAMPLES
    ],
)
def test_configurations_are_valid(page: Path, text: str, tmp_path: Path) -> None:
    """Every field is known and in range, no word is old; the first example of a page is quick."""
    props = tmp_path / "props"
    props.mkdir()
    (props / "one.obj").write_text(
        "v 0 0 0\nv .05 0 0\nv 0 .05 0\nv 0 0 .05\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
    )
    path = tmp_path / "excerpt.yaml"
    path.write_text(completed(text, props))

    assert PipelineFactory(load_config(str(path)), n=1).nominal


@pytest.mark.parametrize("page", [*PAGES, *TUTORIALS], ids=lambda page: page.name)
def test_links_lead_to_files(page: Path) -> None:
    """Relative links and pictures exist; an anchor is a heading of its page."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text("utf-8"), re.MULTILINE)
            slugs = {
                re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings
            }
            assert anchor in slugs, target


@pytest.mark.parametrize(
    "page", [page for page in [*PAGES, *TUTORIALS] if page not in OLD_NAMES],
    ids=lambda page: page.name,
)  # fmt: skip
def test_modules_exist(page: Path) -> None:
    """Dotted names below ``gen_data``, and paths of files in the repository."""
    text = page.read_text("utf-8")
    for dotted in set(
        re.findall(
            r"\bgen_data\.(?:annotations|api|assemble|assets|cli|config|configs|content|core|exporters|lab|packs|physics|pipeline|preview|randomizers|renderers|report|roads|rooms|runner|scene_templates|sensors|sky|traffic|usd)\b[\w.]*",
            text,
        )
    ):
        parts = dotted.rstrip(".").split(".")
        while parts and not (parts[-1][0].islower() and importlib.util.find_spec(".".join(parts))):
            attribute = parts.pop()
            assert attribute[0].isupper() or attribute.isupper(), dotted
    for name in set(
        re.findall(
            r"`((?:generator|content|lab|randomizers|exporters|configs|tests|docs|examples)/[\w./]+)`",
            text,
        )
    ):
        assert (ROOT / name).exists(), name


def test_the_readme_is_short() -> None:
    """At most 80 lines, and no paragraph in a cell of a table."""
    lines = (ROOT / "README.md").read_text("utf-8").splitlines()
    links = re.compile(r"\]\([^)]*\)")

    assert len(lines) <= 80
    for line in lines:
        assert not line.startswith("|") or len(links.sub("", line)) <= 160, line


def tables(page: Path) -> list[list[list[str]]]:
    """Cells of a page's tables by row, without targets of links; code has no tables."""
    text = re.sub(r"^```.*?^```$", "", page.read_text("utf-8"), flags=re.MULTILINE | re.DOTALL)
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return [
        [
            re.split(r"(?<!\\)\|", line.strip())[1:-1]
            for line in table.splitlines()
            if "---" not in line
        ]
        for table in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE)
    ]


def narrowest_px(table: list[list[str]]) -> float:
    """Width at which no word of a table is cut: in site.css, 6.8 px a letter and 11 px a column."""
    words = [[max(map(len, WORD_END.split(cell))) for cell in row] for row in table]
    longest = [max(column) for column in itertools.zip_longest(*words, fillvalue=0)]
    return 6.8 * sum(longest) + 11.0 * len(longest)


WORD_END = re.compile(r"[\s`*]+|(?<=[-_/.,:=])")
"""Where lines may break; in code by docs/hooks/narrow_tables.py."""


@pytest.mark.parametrize(
    "page", [page for page in [*PAGES, *TUTORIALS] if page not in OLD_NAMES],
    ids=lambda page: page.name,
)  # fmt: skip
def test_tables_are_readable_on_a_telephone(page: Path) -> None:
    """On 400 px, of which margins take 32; tables with more than five columns scroll."""
    for table in tables(page):
        assert max(len(re.sub("[`*]", "", cell).strip()) for row in table for cell in row) <= 160, (
            table[0]
        )
        assert len(table[0]) > 5 or narrowest_px(table) <= 368.0, table[0]


def commands_of(page: Path) -> list[str]:
    """Command lines in a page's blocks of shell code and in its tables."""
    text = page.read_text("utf-8")
    blocks = re.findall(r"^```(?:bash|sh)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    lines += re.findall(r"`(gen-data [a-z-][^`]*)`", text)
    return [part for line in lines for part in re.split(r"&&|\||;|>", line.partition(" #")[0])]


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page not in OLD_NAMES], ids=lambda page: page.name
)
def test_commands_and_their_options_exist(page: Path) -> None:
    """Every ``gen-data`` line of a page is accepted by the parser of its command."""
    for line in commands_of(page):
        if not line.strip().startswith("gen-data ") or "..." in line:
            continue
        context = click.Context(cli, info_name="gen-data")
        command: click.Command = cli
        words = shlex.split(line)[1:]
        while isinstance(command, click.Group) and words and not words[0].startswith("-"):
            found = command.get_command(context, words[0])
            assert found is not None, f"{page.name}: {line}"
            command, words = found, words[1:]
            context = click.Context(command, info_name=words[0] if words else None, parent=context)
        # The parser looks at names only: folders and files of the examples do not exist here.
        try:
            command.make_parser(context).parse_args(words)
        except click.UsageError as error:
            pytest.fail(f"{page.name}: {line}: {error.format_message()}")
