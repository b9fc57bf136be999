"""Data sheets and tables of beams that users keep beside their configurations.

What a file says takes the place of its name in the document, so that a plan holds all of it, and
every fault is told with the file, line and column it comes from.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gen_data.generator.config.paths import find_path
from gen_data.generator.config.problems import Position, Problem, Problems
from gen_data.generator.config.yaml_tree import MAX_FILE_BYTES, Node, load_yaml
from gen_data.generator.core.errors import ConfigError, did_you_mean

COLUMNS = ("elevation_deg", "azimuth_offset_deg")
SHEETS, TABLES = (".yaml", ".yml"), (".csv",)


def load_sheets(sensor: Node) -> Node:
    """A sensor's document in which data sheets and tables of beams stand instead of their names.

    Raises:
        ConfigError: a file cannot be read, or is not laid out as it must be.
    """
    kind = sensor.get("type")
    if not isinstance(sensor.content, Mapping) or kind is None or kind.content != "lidar":
        return sensor
    content = dict(sensor.content)
    model, beams = sensor.get("model"), sensor.get("beams")
    if model is not None and _names(model, SHEETS + TABLES):
        if _names(model, TABLES):
            raise _refusal(model.position, "model", "a table of beams belongs into 'beams'")
        content["model"] = _sheet(_path(model))
    if beams is not None and isinstance(beams.content, str):
        if not _names(beams, TABLES):
            raise _refusal(beams.position, "beams", "expected a list, or the name of a .csv file")
        content["beams"] = beam_table(_path(beams))
    return Node(sensor.position, content, sensor.key_positions)


def beam_table(path: Path) -> Node:
    """The beams in a file of comma-separated values, as a list of (elevation, azimuth offset).

    The first line names the columns: ``elevation_deg`` and, if there are any, the
    ``azimuth_offset_deg`` to the left. Blank lines, and what follows a ``#``, say nothing.

    Raises:
        ConfigError: it cannot be read, has other columns, or something in it is no number.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_FILE_BYTES).decode("utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is no text in UTF-8") from None
    lines = [_cells(str(path), k, line) for k, line in enumerate(text.splitlines(), 1)]
    lines = [cells for cells in lines if cells]
    start = Position(str(path), 1, 1)
    if not lines:
        raise _refusal(start, "", f"expected columns {', '.join(COLUMNS)}, got nothing")
    header = _header(lines[0])
    problems = Problems()
    beams = tuple(_beam(cells, header, problems) for cells in lines[1:])
    problems.raise_if_any()
    return Node(start, beams)


def _sheet(path: Path) -> Node:
    """A data sheet, named after its file."""
    node = load_yaml(path)
    assert isinstance(node.content, Mapping)
    name = Node(node.position, path.stem, text=path.stem)
    return Node(node.position, {"name": name, **node.content}, node.key_positions)


def _names(node: Node, endings: tuple[str, ...]) -> bool:
    """Whether a node is the name of a file of some kind."""
    return isinstance(node.content, str) and node.content.lower().endswith(endings)


def _path(node: Node) -> Path:
    """The file that a node names: from the folder of the document that names it."""
    return find_path(node.text, node.position, "", "file")


def _cells(file: str, line: int, text: str) -> list[Node]:
    """The cells of a line with their places; none in a blank line or a comment."""
    said = text.partition("#")[0]
    if not said.strip():
        return []
    cells, column = [], 1
    for cell in said.split(","):
        indent = len(cell) - len(cell.lstrip())
        place = Position(file, line, column + indent, text)
        cells.append(Node(place, cell.strip(), text=cell.strip()))
        column += len(cell) + 1
    return cells


def _header(cells: list[Node]) -> list[str]:
    names = [cell.text for cell in cells]
    for cell in cells:
        if cell.text not in COLUMNS:
            raise _refusal(
                cell.position,
                "",
                f"unknown column '{cell.text}'; expected {', '.join(COLUMNS)}"
                + did_you_mean(cell.text, COLUMNS),
            )
    if COLUMNS[0] not in names or len(set(names)) < len(names):
        raise _refusal(cells[0].position, "", f"expected columns {', '.join(COLUMNS)}, each once")
    return names


def _beam(cells: list[Node], header: list[str], problems: Problems) -> Node:
    """A line as (elevation, azimuth offset)."""
    place = cells[0].position
    values = {name: Node(place, 0.0, text="0") for name in COLUMNS}
    if len(cells) != len(header):
        problems.add(place, "", f"expected {len(header)} numbers, got {len(cells)}")
    for name, cell in zip(header, cells, strict=False):
        try:
            values[name] = Node(cell.position, float(cell.text), text=cell.text)
        except ValueError:
            problems.add(cell.position, name, f"expected a number, got '{cell.text}'")
    return Node(place, tuple(values[name] for name in COLUMNS))


def _refusal(position: Position, field: str, fact: str) -> ConfigError:
    return ConfigError(str(Problem(position, field, fact)))
