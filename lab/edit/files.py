"""Files that the page may read and write, and the bytes of an edited file."""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from pathlib import Path

from gen_data.config.problems import Position
from gen_data.config.yaml_tree import MAX_FILE_BYTES, Node, parse_yaml
from gen_data.core.errors import ConfigError, GenDataError, StorageError
from gen_data.core.whole_files import write_whole

ASSETS = "assets"
"""Folder of the user's files, next to the configuration."""
_LINE = re.compile(r"([^\r\n]*)(\r\n|\r|\n|$)")
_BOM = "\ufeff"


@dataclass(frozen=True)
class Folders:
    """Folders that the page may use, including all subfolders.

    Attributes:
        roots: Resolved paths.
    """

    roots: tuple[Path, ...]

    def contains(self, path: Path) -> bool:
        """Whether a path is in one of the folders after all links are followed."""
        resolved = path.resolve()
        return any(resolved.is_relative_to(root) for root in self.roots)

    def with_references(self, text: str, file: Path) -> "Folders":
        """The same folders and those named by a file of the user, which its run would read."""
        try:
            tree = parse_yaml(text, str(file))
        except GenDataError:
            return self
        named = (path.resolve() for _, path in _references(tree, file.parent))
        found = {path if path.is_dir() else path.parent for path in named}
        return Folders((*self.roots, *sorted(found - set(self.roots))))

    def refuse_outside(self, text: str, file: str) -> None:
        """Refuse a text that names a file or folder outside these folders.

        Raises:
            ConfigError: it names one, with its position; or the text is not a valid document.
        """
        for position, path in _references(parse_yaml(text, file), Path(file).parent):
            if not self.contains(path):
                raise ConfigError(
                    f"{position}: '{path}' is outside of the folders of this page; expected a file "
                    f"in {', '.join(map(str, self.roots))}: start gen-data edit with --folder"
                )


def _references(tree: Node, folder: Path) -> Iterator[tuple[Position, Path]]:
    """Texts of a document that are paths of existing files or folders."""
    for child in tree.children.values():
        yield from _references(child, folder)
    text = tree.content
    # Also texts without slashes: a link next to the file may lead anywhere.
    if isinstance(text, str) and text:
        try:
            path = folder / Path(text).expanduser()
            if path.exists():
                yield tree.position, path
        except (OSError, RuntimeError, ValueError):
            return


class ChangedError(StorageError):
    """A file has changed since it was read."""


@dataclass(frozen=True)
class OpenedFile:
    """A file as it was read, and its text for an editor, with lines that end in LF.

    Attributes:
        content: The bytes as text; None if there is no such file yet.
    """

    path: Path
    content: str | None

    @property
    def text(self) -> str:
        """Text for an editor."""
        body = (self.content or "").removeprefix(_BOM)
        return "\n".join(line for line, _ in _lines(body))

    def save(self, text: str, *, overwrite: bool = False) -> "OpenedFile":
        """Write an edited text; lines that were not edited keep their bytes.

        Args:
            text: Text of the editor.
            overwrite: Write even if the file has changed since it was read.

        Raises:
            ChangedError: it has changed, or is gone, by another tab or program.
            StorageError: it cannot be written, as on a full disk; the old file stays.
        """
        now = read_file(self.path).content
        if not overwrite and now is None and self.content is not None:
            raise ChangedError(
                f"{self.path} is gone since it was read; overwrite it to write it again"
            )
        if not overwrite and now != self.content:
            raise ChangedError(
                f"{self.path} has changed since it was read, in another tab or program; reload it, "
                "or overwrite it"
            )
        content = restore_lines(self.content or "", text)
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_whole({self.path: content.encode()})
        except OSError as error:
            raise StorageError(f"{self.path}: {error.strerror}") from error
        return OpenedFile(self.path, content)


def read_file(path: Path) -> OpenedFile:
    """Read a configuration; a file that does not exist is empty.

    Raises:
        ConfigError: it is not a text of a reasonable size.
    """
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise ConfigError(f"{path}: larger than {MAX_FILE_BYTES} bytes")
        return OpenedFile(path, path.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        return OpenedFile(path, None)
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: cannot be read as UTF-8: {error}") from None


def restore_lines(original: str, edited: str) -> str:
    """The edited text with the byte order mark and the line ends of the original.

    Args:
        original: With any line ends, mixed ones too.
        edited: With LF; lines that are not in the original get its most frequent line end.
    """
    bom = _BOM if original.startswith(_BOM) else ""
    before, after = _lines(original.removeprefix(_BOM)), _lines(edited)
    usual = Counter(end for _, end in before if end).most_common(1)
    default = usual[0][0] if usual else "\n"
    ends = [default] * (len(after) - 1) + [""]
    matcher = SequenceMatcher(None, [b for b, _ in before], [a for a, _ in after], autojunk=False)
    for old, new, count in matcher.get_matching_blocks():
        for k in range(count):
            if new + k < len(after) - 1 and before[old + k][1]:
                ends[new + k] = before[old + k][1]
    return bom + "".join(line + end for (line, _), end in zip(after, ends, strict=True))


def _lines(text: str) -> list[tuple[str, str]]:
    """Lines and their ends; the last line has none."""
    found = [match.groups() for match in _LINE.finditer(text)]
    # The pattern also matches the empty text behind a last line without an end.
    if len(found) > 1 and found[-2][1] == "":
        found.pop()
    return [(line, end) for line, end in found]
