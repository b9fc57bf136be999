"""Hooks of MkDocs: pages from files of the repository, and the generated reference.

Files outside docs/ become pages: links in Markdown work both in the repository and on the site.
Linked files of other types are shown as source pages.
"""

import posixpath
import re
import sys
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
# MkDocs loads hooks by path: the checkout's packages are found as for scripts in it.
sys.path.insert(0, str(ROOT))

from docs.hooks.command_reference import command_page  # noqa: E402
from docs.hooks.family_reference import family_page  # noqa: E402
from docs.hooks.narrow_tables import with_breaks  # noqa: E402
from docs.hooks.plugin_reference import first_comment, plugin_pages, yaml_block  # noqa: E402
from docs.hooks.python_reference import python_page  # noqa: E402

PAGES = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "project/architecture.md",
    "CONVENTIONS.md": "project/conventions.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "CHANGELOG.md": "project/changelog.md",
    "examples/README.md": "project/examples.md",
}
"""Pages of the site that are files outside docs/, by path in the repository."""

SOURCE = "source"
"""Folder of the pages that show files of other types."""

LANGUAGES = {".py": "python", ".yaml": "yaml", ".toml": "toml", ".ipynb": "json", ".md": "markdown"}
LINK = re.compile(r"(\]\()([^)\s]+)(\))")
CODE = re.compile(r"^(?:```|~~~).*?^(?:```|~~~)$", re.MULTILINE | re.DOTALL)
SECTION = re.compile(r"^## (\w+)$\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Replace a folder in the navigation by its pages, in the order of ``extra.order``."""
    order = config.extra["order"]
    for section in config.nav or ():
        for title, entry in section.items():
            if isinstance(entry, str) and entry.endswith("/"):
                found = sorted(path.stem for path in (ROOT / "docs" / entry).glob("*.md"))
                names = [*(n for n in order if n in found), *(n for n in found if n not in order)]
                section[title] = [f"{entry}{name}.md" for name in names]
    config.nav = [section for section in config.nav or () if all(section.values())]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add pages from files of the repository, source pages, and the reference."""
    for path, uri in PAGES.items():
        files.append(File.generated(config, uri, content=(ROOT / path).read_text("utf-8")))
    for uri, text in (
        *plugin_pages(),
        ("reference/asset_family.md", family_page()),
        ("reference/commands.md", command_page()),
        ("reference/python.md", python_page()),
    ):
        files.append(File.generated(config, uri, content=text))
    pages = [ROOT / path for path in PAGES]
    pages += [ROOT / "docs" / file.src_uri for file in files if _is_document(file)]
    for path in sorted({link for page in pages for link in _linked_files(page)}):
        files.append(File.generated(config, _source_uri(path), content=_source_page(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Rewrite links to files outside docs/, and show the configurations of the gallery."""
    del config, files
    uri = page.file.src_uri
    if uri.startswith(("reference/", f"{SOURCE}/")):
        return markdown
    origin = next((path for path, target in PAGES.items() if target == uri), f"docs/{uri}")
    parts = CODE.split(markdown)
    blocks = [*CODE.findall(markdown), ""]
    texts = [LINK.sub(lambda m: m[1] + _rewrite(m[2], origin, uri) + m[3], t) for t in parts]
    text = "".join(t + block for t, block in zip(texts, blocks, strict=True))
    return SECTION.sub(_with_configuration, text) if uri == "gallery.md" else text


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let code in the cells of tables break between its words."""
    del page, config, files
    return with_breaks(html)


def _is_document(file: File) -> bool:
    """Whether a file is a page of docs/ that a person wrote."""
    return file.is_documentation_page() and (ROOT / "docs" / file.src_uri).is_file()


def _linked_files(page: Path) -> set[str]:
    """Paths in the repository that a page links to and that are not pages of the site."""
    text = CODE.sub("", page.read_text("utf-8"))
    origin = page.relative_to(ROOT).as_posix()
    targets = (_repository_path(match[2], origin) for match in LINK.finditer(text))
    return {path for path in targets if path and _site_uri(path).startswith(SOURCE)}


def _repository_path(target: str, origin: str) -> str:
    """Path in the repository of a relative link; empty for others."""
    if re.match(r"[a-z]+:|#|/", target):
        return ""
    return posixpath.normpath(posixpath.join(posixpath.dirname(origin), target.partition("#")[0]))


def _site_uri(path: str) -> str:
    """Source path of the page or picture that a path in the repository has on the site."""
    if path in PAGES:
        return PAGES[path]
    return (
        path.removeprefix("docs/")
        if path.startswith("docs/") and _is_copied(path)
        else _source_uri(path)
    )


def _is_copied(path: str) -> bool:
    """Whether MkDocs takes a file of docs/ itself: all but the hooks and YAML files."""
    return PurePosixPath(path).suffix in (".md", ".png", ".webp")


def _source_uri(path: str) -> str:
    return f"{SOURCE}/{path}.md"


def _rewrite(target: str, origin: str, uri: str) -> str:
    """A link of a file of the repository as a link of its page."""
    path = _repository_path(target, origin)
    if not path:
        return target
    _, separator, anchor = target.partition("#")
    return posixpath.relpath(_site_uri(path), posixpath.dirname(uri) or ".") + separator + anchor


def _source_page(path: str) -> str:
    """A page that shows a file, or the names and texts of the files of a folder."""
    file = ROOT / path
    if file.is_file():
        return f"# {path}\n\n{_block(file)}\n"
    lines = [f"# {path}"]
    for part in sorted(p for p in file.rglob("*") if p.suffix in LANGUAGES):
        lines += [f"## {part.relative_to(file)}", _block(part)]
    return "\n\n".join(lines) + "\n"


def _block(file: Path) -> str:
    """A fenced block with the text of a file."""
    return f"````{LANGUAGES.get(file.suffix, 'text')}\n{file.read_text('utf-8').rstrip()}\n````"


def _with_configuration(section: re.Match[str]) -> str:
    """A section of the gallery, and below its picture the file of its configuration."""
    file = ROOT / "configs" / f"{section[1]}.yaml"
    if not file.is_file():
        return section[0]
    text = file.read_text("utf-8")
    block = "\n".join(f"    {line}".rstrip() for line in yaml_block(text).splitlines())
    about = first_comment(text)
    return f'## {section[1]}\n\n{about}\n{section[2]}??? note "{file.name}"\n\n{block}\n\n'
