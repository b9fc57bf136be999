"""Type of room: a gallery with two pieces."""

from gen_data.rooms.rules import RoomType, Rule

GALLERY = RoomType(
    size_m=((6.0, 6.0), (4.0, 4.0), (3.0, 3.0)),
    windows=(0, 0),
    floor=("stranger_stripes",),
    walls=("plaster",),
    pieces=(Rule("exhibit", ("stranger_block",), (2, 2), "stranger_quarters"),),
)
