"""State of one tab without its widgets: the text, its meaning, the grid and its results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gen_data.config.yaml_scalars import to_flow_yaml
from gen_data.core.errors import GenDataError, StorageError
from gen_data.lab.edit import text_edits
from gen_data.lab.edit.document import Analysis, Fault, analyse, find_faults
from gen_data.lab.edit.files import Folders, OpenedFile, read_file
from gen_data.lab.edit.overlays import View
from gen_data.lab.edit.photographs import is_empty
from gen_data.lab.edit.samples import Check, Order, Shown
from gen_data.lab.edit.workers import Refused

if TYPE_CHECKING:
    from gen_data.assemble.config import Config
    from gen_data.lab.edit.workers import Ticket

BEGIN = (
    "The file is empty. Begin with a shipped configuration, whose name is completed after "
    "'extends: ', or drop a photograph on 'Own files'."
)
BEGINNINGS = ("tabletop.yaml", "rooms.yaml", "street.yaml", "photo_plates.yaml")
"""Configurations offered for an empty file."""
SLOTS = (4, 6, 8, 12, 16, 24)
EACH = ("scene", "view", "step")
"""Quantities that can vary from one picture to the next."""


@dataclass(frozen=True)
class Variation:
    """One sample, drawn with several values of one field; all its other draws stay.

    Attributes:
        field: Dotted path, as for ``--set``.
        values: Plain data, one value per picture.
        kept: Names and values of the other draws of the same plug-in.
        drawn: Name of the draw that the values replace; empty = the field is a constant.
    """

    index: int
    field: str
    values: tuple[Any, ...]
    kept: tuple[tuple[str, Any], ...] = ()
    drawn: str = ""

    def order(self, order: Order, value: Any) -> Order:
        """The order of the picture with a value."""
        order = replace(order, index=self.index)
        if self.drawn:
            return replace(order, pinned=(*self.kept, (self.drawn, value)))
        return replace(order, pinned=self.kept, overrides=(f"{self.field}={to_flow_yaml(value)}",))


@dataclass(frozen=True)
class Grid:
    """Samples of the grid.

    Attributes:
        first: Number of the first scene, view or step.
        each: One of ``EACH``.
    """

    slots: int = 8
    first: int = 0
    each: str = "scene"
    view: View = field(default_factory=View)
    variation: Variation | None = None

    def indices(self, config: Config) -> list[int]:
        """Numbers of the samples."""
        general = config.general
        per_view = general.steps_per_scene
        stride = {"scene": per_view * general.views_per_scene, "view": per_view, "step": 1}
        return [(self.first + k) * stride[self.each] for k in range(self.slots)]


@dataclass
class Session:
    """One tab.

    Attributes:
        file: The file as it was last read or written.
        text: Text of the editor.
        analysis: Analysis of the text; its configuration is the latest valid one.
        results: Results by slot; a result stays until a newer text's result replaces it.
        outdated: Slots whose result belongs to an older text.
    """

    file: OpenedFile
    folders: Folders
    text: str = ""
    grid: Grid = field(default_factory=Grid)
    analysis: Analysis = field(default_factory=lambda: Analysis(None))
    config: Config | None = None
    results: dict[int, Shown | Refused] = field(default_factory=dict)
    outdated: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Begin with the text of the file."""
        self.text = self.text or self.file.text

    @property
    def name(self) -> str:
        """Name of the file in messages."""
        return str(self.file.path)

    @property
    def is_changed(self) -> bool:
        """Whether the text differs from the file, or there is no file yet."""
        return self.file.content is None or self.text != self.file.text

    def find_change(self) -> str:
        """Changes by another program to the file since it was read, in words; empty if none."""
        try:
            content = read_file(self.file.path).content
        except GenDataError:
            return "cannot be read any more"
        if content == self.file.content:
            return ""
        return "has changed on disk" if content is not None else "is gone from disk"

    def set_text(self, text: str) -> None:
        """Take a text and find the faults of its first scene; the latest valid configuration stays.

        Pictures can be ordered then; the job ``Check`` finds the other faults.
        """
        self.text = text
        if is_empty(text):
            self.analysis = Analysis(None)
            return
        try:
            self.folders.refuse_outside(text, self.name)
        except GenDataError as error:
            self.analysis = Analysis(None, tuple(find_faults(str(error), self.name)))
            return
        self.analysis = analyse(text, self.name, first_scene_only=True)
        self.config = self.analysis.config or self.config

    def accept_check(self, check: Check, faults: tuple[Fault, ...]) -> None:
        """Take the faults of all scenes of a text, unless there is a newer one."""
        if faults and check.text == self.text:
            self.analysis = Analysis(None, faults)

    def orders(self) -> list[Order]:
        """Orders of all pictures; none for a text with faults, whose pictures are outdated then."""
        self.outdated = set(self.results)
        config = self.analysis.config
        if config is None:
            return []
        order = Order(self.text, self.name, 0, self.grid.view)
        varied = self.grid.variation
        if varied is None:
            orders = [replace(order, index=index) for index in self.grid.indices(config)]
        else:
            orders = [varied.order(order, value) for value in varied.values]
        self.results = {k: r for k, r in self.results.items() if k < len(orders)}
        self.outdated &= set(self.results)
        return orders

    def accept(self, ticket: Ticket, result: Shown | Refused) -> None:
        """Take the result of an order."""
        self.results[ticket.slot] = result
        self.outdated.discard(ticket.slot)

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Errors of the text, and of the scenes whose pictures could not be rendered."""
        if self.analysis.faults:
            return self.analysis.faults
        refused = (r for k, r in sorted(self.results.items()) if k not in self.outdated)
        texts = dict.fromkeys(one.text for one in refused if isinstance(one, Refused))
        return tuple(fault for text in texts for fault in find_faults(text, self.name))

    @property
    def empty(self) -> list[str]:
        """Kinds of labels and pictures that are empty in every picture of the current text."""
        found = [one.empty for one in self.shown]
        return sorted(frozenset.intersection(*found)) if found else []

    @property
    def shown(self) -> list[Shown]:
        """Pictures of the current text, in their order."""
        results = sorted(self.results.items())
        return [r for k, r in results if isinstance(r, Shown) and k not in self.outdated]

    @property
    def size_px(self) -> tuple[int, int]:
        """Shape of the next pictures: from the shown camera, otherwise from the first one."""
        sensors = self.config.probes[0].sensors if self.config else ()
        sized = [one for one in sensors if getattr(one, "size_px", None)]
        wanted = [one for one in sized if one.name == self.grid.view.sensor]
        size_px = getattr(next(iter((*wanted, *sized)), None), "size_px", (4, 3))
        return int(size_px[0]), int(size_px[1])

    def set_field(self, section: str, name: str, path: Sequence[str | int], value: Any) -> str:
        """The text with another value of a field of a named item, or of a section (no name).

        Raises:
            ConfigError: the field has no separate place in the text.
        """
        return text_edits.set_value(self.text, [section, *([name] if name else []), *path], value)

    def save(self, *, overwrite: bool = False) -> None:
        """Write the file.

        Raises:
            StorageError: it has changed since it was read, or cannot be written.
        """
        self.file = self.file.save(self.text, overwrite=overwrite)

    def save_as(self, path: Path, *, overwrite: bool = False) -> None:
        """Write another file in the folders of the page, which is edited from now on.

        A name without the ending of YAML gets it.

        Raises:
            StorageError: it is outside, exists, has no folder, or cannot be written.
        """
        if not self.folders.contains(path):
            raise StorageError(f"{path} is outside of the folders of this page")
        if path.suffix not in (".yaml", ".yml"):
            path = path.with_name(f"{path.name}.yaml")
        if not path.parent.is_dir():
            raise StorageError(f"{path.parent} does not exist; expected a folder that is there")
        if path.exists() and not overwrite:
            raise StorageError(f"{path}: a file of that name is there; choose another name")
        self.file = OpenedFile(path, None).save(self.text, overwrite=overwrite)


def vary(shown: Shown, section: str, name: str, field_: str, values: Sequence[Any]) -> Variation:
    """The sample of a picture with several values of one field of an item.

    A value replaces the drawn one, whose random numbers are still consumed: other draws are
    unchanged. Draws of the same randomizer that are single numbers are kept even if another attempt
    is necessary; other plug-ins have separate streams.

    Args:
        shown: Picture of the sample.
        section: Section of the item; empty for a field of the configuration itself.
        name: Name of the item.
        field_: The field that varies.
        values: Its values.
    """
    own = f"{name}.{field_}" if section == "randomizers" else ""
    kept = tuple(
        (drawn, found[0])
        for drawn, found in shown.draws.items()
        if section == "randomizers"
        and drawn.rpartition(".")[0] == name
        and drawn != own
        and len(found) == 1
        and isinstance(found[0], (int, float))
        and not isinstance(found[0], bool)
        and "[" not in drawn
    )
    place = ".".join(part for part in (section, name, field_) if part)
    return Variation(shown.index, place, tuple(values), kept, own if own in shown.draws else "")


def drawn_values(shown: Sequence[Shown], parameter: str) -> list[Any]:
    """Values of a parameter in all pictures, in order."""
    return [value for one in shown for value in one.draws.get(parameter, ())]
