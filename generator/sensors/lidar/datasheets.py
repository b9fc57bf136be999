"""Users' data sheets and beam tables of laser scanners, beside their configurations.

The content of a file replaces its name in the configuration, so that plans are self-contained and
errors name the file, line and column they come from.
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
    """Replace the names of data sheets and beam tables in a sensor's document by their content.

    Raises:
        ConfigError: a file cannot be read or has another layout.
    """
    kind = sensor.get("type")
    if not isinstance(sensor.content, Mapping) or kind is None or kind.content != "lidar":
        return sensor
    content = dict(sensor.content)
    model, beams = sensor.get("model"), sensor.get("beams")
    if model is not None and _names(model, SHEETS + TABLES):
        if _names(model, TABLES):
            raise _error(model.position, "model", "a table of beams belongs into 'beams'")
        content["model"] = _load_sheet(_find_file(model))
    if beams is not None and isinstance(beams.content, str):
        if not _names(beams, TABLES):
            raise _error(beams.position, "beams", "expected a list, or the name of a .csv file")
        content["beams"] = beam_table(_find_file(beams))
    return Node(sensor.position, content, sensor.key_positions)


def beam_table(path: Path) -> Node:
    """Read beams from a CSV file, as a list of (elevation, azimuth offset) [deg].

    The first line names the columns: ``elevation_deg`` and, optionally, ``azimuth_offset_deg``, to
    the left. Blank lines and comments after ``#`` are ignored.

    Raises:
        ConfigError: it cannot be read, has other columns, or a cell is not a number.
    """
    try:
        with path.open("rb") as file:
            text = file.read(MAX_FILE_BYTES).decode("utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise ConfigError(f"{path}: is not UTF-8 text") from None
    lines = [_cells(str(path), k, line) for k, line in enumerate(text.splitlines(), 1)]
    lines = [cells for cells in lines if cells]
    start = Position(str(path), 1, 1)
    if not lines:
        raise _error(start, "", f"expected columns {', '.join(COLUMNS)}, got nothing")
    header = _parse_header(lines[0])
    problems = Problems()
    beams = tuple(_parse_beam(cells, header, problems) for cells in lines[1:])
    problems.raise_if_any()
    return Node(start, beams)


def _load_sheet(path: Path) -> Node:
    """Read a data sheet; its default name is that of the file."""
    node = load_yaml(path)
    assert isinstance(node.content, Mapping)
    name = Node(node.position, path.stem, text=path.stem)
    return Node(node.position, {"name": name, **node.content}, node.key_positions)


def _names(node: Node, endings: tuple[str, ...]) -> bool:
    """Whether a node is a file name with one of the endings."""
    return isinstance(node.content, str) and node.content.lower().endswith(endings)


def _find_file(node: Node) -> Path:
    """Path of the file that a node names, relative to the node's document."""
    return find_path(node.text, node.position, "", "file")


def _cells(file: str, line: int, text: str) -> list[Node]:
    """The cells of a line with their positions; [] for a blank line or a comment."""
    content = text.partition("#")[0]
    if not content.strip():
        return []
    cells, column = [], 1
    for cell in content.split(","):
        indent = len(cell) - len(cell.lstrip())
        place = Position(file, line, column + indent, text)
        cells.append(Node(place, cell.strip(), text=cell.strip()))
        column += len(cell) + 1
    return cells


def _parse_header(cells: list[Node]) -> list[str]:
    """Names of the columns."""
    names = [cell.text for cell in cells]
    for cell in cells:
        if cell.text not in COLUMNS:
            raise _error(
                cell.position,
                "",
                f"unknown column '{cell.text}'; expected {', '.join(COLUMNS)}"
                + did_you_mean(cell.text, COLUMNS),
            )
    if COLUMNS[0] not in names or len(set(names)) < len(names):
        raise _error(cells[0].position, "", f"expected columns {', '.join(COLUMNS)}, each once")
    return names


def _parse_beam(cells: list[Node], header: list[str], problems: Problems) -> Node:
    """A line as (elevation, azimuth offset) [deg]."""
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


def _error(position: Position, field: str, fact: str) -> ConfigError:
    return ConfigError(str(Problem(position, field, fact)))
