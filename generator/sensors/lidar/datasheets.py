"""Users' data sheets and beam tables of laser scanners, next to their configurations.

The content of a file replaces its name in the configuration: plans are self-contained, and errors
name the file, line and column they come from.
"""

from collections.abc import Mapping
from pathlib import Path

from gen_data.config import paths, validation
from gen_data.config.problems import Position, Problem, Problems
from gen_data.config.yaml_tree import MAX_FILE_BYTES, Node, load_yaml
from gen_data.core.errors import ConfigError, did_you_mean
from gen_data.sensors.device_presets import preset_names, preset_path
from gen_data.sensors.lidar.scan_pattern import PRESETS, LidarModel, lidar_model

COLUMNS = ("elevation_deg", "azimuth_offset_deg")
LASERS = frozenset({"elevations_deg", "prisms", "azimuth_offsets_deg", "lateral_offsets_m"})
"""Keys of a sheet that belong together: giving one inherits none."""
RATES = frozenset({"points_per_second", "azimuth_step_deg"})
REQUIRED = tuple(name for name, field in LidarModel.model_fields.items() if field.is_required())
SHEETS, TABLES = (".yaml", ".yml"), (".csv",)


def load_sheets(sensor: Node, field: str) -> Node:
    """Replace the names of data sheets and beam tables in a sensor's document by their content.

    ``field`` is the path of the sensor in messages: ``sensors[0]``.

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
        content["model"] = _checked(_load_sheet(_find_file(model)), f"{field}.model")
    elif model is not None and isinstance(model.content, Mapping):
        content["model"] = _checked(_complete(model), f"{field}.model")
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
    """Read a data sheet; its default name is the name of the file."""
    node = load_yaml(path)
    assert isinstance(node.content, Mapping)
    name = Node(node.position, path.stem, text=path.stem)
    named = Node(node.position, {"name": name, **node.content}, node.key_positions)
    return _complete(named)


def _checked(sheet: Node, field: str) -> Node:
    """The sheet, if it is valid: a field that is a name or a sheet would only state that.

    Raises:
        ConfigError: it is not.
    """
    problems = Problems()
    validation.validate(sheet, LidarModel, problems, field)
    problems.raise_if_any()
    return sheet


def _complete(sheet: Node) -> Node:
    """Add the values of the scanner that a sheet is ``like`` to its own.

    Raises:
        ConfigError: there is no such scanner; or the sheet names none and lacks values.
    """
    own, like = dict(sheet.entries), sheet.get("like")
    if like is None:
        missing = [name for name in REQUIRED if name not in own]
        if missing and not _looks_foreign(own):
            fact = f"lacks {', '.join(missing)}; give them, or name a scanner that has the same"
            raise _error(sheet.position, "", f"{fact}: like: VLP-16")
        return sheet
    del own["like"]
    known = preset_names(PRESETS)
    if like.content not in known:
        near = did_you_mean(like.text, known)
        raise _error(like.position, "like", f"expected one of {', '.join(known)}{near}")
    base = dict(load_yaml(preset_path(PRESETS, like.text)).entries)
    if LASERS & own.keys():
        model = lidar_model(like.text)
        base = {name: node for name, node in base.items() if name not in LASERS}
        if "prisms" not in own and model.prisms is None and not RATES & own.keys():
            step = round(360.0 / model.columns, 6)
            own["azimuth_step_deg"] = Node(like.position, step, text=str(step))
    if RATES & own.keys():
        base = {name: node for name, node in base.items() if name not in RATES}
    return Node(sheet.position, {**base, **own}, sheet.key_positions)


def _looks_foreign(own: Mapping[str, Node]) -> bool:
    """Whether a sheet has unknown keys, which the usual message describes better."""
    return bool(own.keys() - LidarModel.model_fields.keys())


def _names(node: Node, endings: tuple[str, ...]) -> bool:
    """Whether a node is a file name with one of the endings."""
    return isinstance(node.content, str) and node.content.lower().endswith(endings)


def _find_file(node: Node) -> Path:
    """Path of the file that a node names, relative to the node's document."""
    return paths.find_path(node.text, node.position, "", "file")


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
