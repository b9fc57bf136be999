"""Rules of rooms: contents of a room of a type, their places, and the space that they need."""

from dataclasses import dataclass
from functools import cache

from gen_data.config.data_files import load_table
from gen_data.core import errors, plugins

Range = tuple[float, float]
KIND = "room_type"
"""Kind of the plug-ins that are types of rooms."""
APARTMENT = "apartment"
"""Type of several joined rooms."""


@dataclass(frozen=True, slots=True)
class Rule:
    """One kind of piece; ``room_types.yaml`` explains the fields.

    Attributes:
        piece: Name by which other rules refer to it.
        assets: Families to draw from, each as likely as it is listed.
        count: Smallest and largest number; per piece of ``of`` for ``on``.
        place: Row of ``gen_data.rooms.TABLE``.
        of: Pieces that it refers to.
        gap_m: Distance from that piece [m].
        clearance_m: Depth of free floor before its front [m].
        height_m: Height of its lowest point, for wall-mounted pieces [m].
        middle_m: Height of its middle, instead of ``height_m`` [m].
        at: Place on the top that carries it, from -1 to 1 along depth and width.
        matching: Whether all matching pieces of a room have one look.
        optional: Whether a room may do without it, whatever its ``count``.
        movable: Whether a person moves it out of the way.
        clutter: Whether ``clutter`` of the randomizer scales its number.
        things: Families of small objects on it.
        how_many: Smallest and largest number of them per surface.
        filled: Share of its boards that objects cover, side by side; 0 = ``how_many`` lie about.
        inside: Families of objects on the boards behind its doors, at most one per board.
    """

    piece: str
    assets: tuple[str, ...]
    count: tuple[int, int]
    place: str
    of: tuple[str, ...] = ()
    gap_m: Range = (0.0, 0.0)
    clearance_m: float = 0.0
    height_m: Range = (0.0, 0.0)
    middle_m: Range = (0.0, 0.0)
    at: tuple[float, float] = (0.0, 0.0)
    matching: bool = False
    optional: bool = False
    movable: bool = False
    clutter: bool = False
    things: tuple[str, ...] = ()
    how_many: tuple[int, int] = (0, 0)
    filled: Range = (0.0, 0.0)
    inside: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class RoomType:
    """Rules of one type of room.

    Attributes:
        size_m: Ranges of length, width and height [m].
        windows: Smallest and largest number of windows.
        floor, walls: Families of textures; ``paint`` is tinted.
        accent: Textures of a single wall that stands out; in a share of the rooms.
        splashback: Textures behind worktops.
        pieces: Rules in the order of placing.
        pale: Whether its walls are always near white.
        blinds: Whether its windows may have blinds.
        skirting: Whether skirting boards differ from its walls.
        door_m: Width and height of the openings of its doors; empty = the usual ones.
        sill_m: Height of the lower edges of its windows.
        window_width_m: Width of its windows.
        clerestory: Whether its windows are below the ceiling.
        french_windows: Share of windows that begin at the floor.
    """

    size_m: tuple[Range, Range, Range]
    windows: tuple[int, int]
    floor: tuple[str, ...]
    walls: tuple[str, ...]
    pieces: tuple[Rule, ...]
    accent: tuple[str, ...] = ()
    splashback: tuple[str, ...] = ()
    pale: bool = False
    blinds: bool = True
    skirting: bool = True
    door_m: tuple[float, ...] = ()
    sill_m: Range = (0.8, 0.95)
    window_width_m: Range = (1.0, 2.1)
    clerestory: bool = False
    french_windows: float = 0.0

    @property
    def usual_area_m2(self) -> float:
        """Area of a floor of the mean size."""
        (x0, x1), (y0, y1), _ = self.size_m
        return 0.25 * (x0 + x1) * (y0 + y1)

    @property
    def families(self) -> frozenset[str]:
        """Families of everything that may be in such a room."""
        return frozenset(
            name for rule in self.pieces for name in (*rule.assets, *rule.things, *rule.inside)
        )


@cache
def room_types() -> dict[str, RoomType]:
    """Types by name: shipped ones, and types of the entry points ``gen_data.room_type``.

    Raises:
        ConfigError: an entry point is not a RoomType.
    """
    found: dict[str, RoomType] = {}
    for name, entry in plugins.third_party(KIND).items():
        room_type: object = plugins.loaded(entry.value, f"{KIND} '{name}'")
        if not isinstance(room_type, RoomType):
            raise errors.ConfigError(f"{KIND} '{name}': {entry.value} is not a {__name__}.RoomType")
        found[name] = room_type
    return {**found, **load_table(__name__.rpartition(".")[0], "room_types", RoomType)}


def find_room_type(name: str, field: str) -> RoomType:
    """The type of that name.

    Raises:
        ConfigError: there is none; the text begins with ``field``.
    """
    known = room_types()
    if name not in known:
        raise errors.ConfigError(
            f"{field}: there is no room type '{name}'; expected one of "
            f"{', '.join((*known, APARTMENT))}{errors.did_you_mean(name, known)}"
        )
    return known[name]
