"""Counts the elements of an OpenDRIVE file that have no effect on lanes and surface here."""

from collections import Counter
from collections.abc import Iterator, Mapping
from xml.etree.ElementTree import Element

_LINKS = frozenset({"predecessor", "successor"})
_READ: Mapping[str, frozenset[str]] = {
    "OpenDRIVE": frozenset({"header", "road", "junction"}),
    "road": frozenset({"link", "type", "planView", "elevationProfile", "lateralProfile", "lanes"}),
    "link": _LINKS,
    "type": frozenset({"speed"}),
    "planView": frozenset({"geometry"}),
    "geometry": frozenset({"line", "arc", "spiral", "poly3", "paramPoly3"}),
    "elevationProfile": frozenset({"elevation"}),
    "lateralProfile": frozenset({"superelevation", "crossfall", "shape"}),
    "lanes": frozenset({"laneOffset", "laneSection"}),
    "laneSection": frozenset({"left", "center", "right"}),
    **dict.fromkeys(("left", "center", "right"), frozenset({"lane"})),
    "lane": frozenset({"link", "width", "border", "roadMark", "height", "speed"}),
    "junction": frozenset({"connection"}),
    "connection": frozenset({"laneLink"}),
}
"""Elements that are read, by the one that they are in."""
_GROUPS = frozenset({"objects", "signals", "railroad", "surface"})
"""Elements that only hold others."""
_REMARKS = frozenset({"userData", "dataQuality", "vectorScene"})
"""Remarks of programs, which are not part of the roads."""

_MARKS = frozenset({
    "none", "solid", "broken", "solid solid", "solid broken", "broken solid", "broken broken",
    "curb", "edge", "grass",
})  # fmt: skip
_BARE = frozenset({"none", "curb", "edge", "grass"})
"""Known kinds of marks, and the ones without paint."""
_COLORS = frozenset({"standard", "white", "yellow"})


def count_unused(root: Element) -> dict[str, int]:
    """Names of the elements without effect, with their number, sorted by name."""
    return dict(sorted(Counter(_unused(root)).items()))


def _unused(element: Element) -> Iterator[str]:
    if element.tag == "header":
        # Places in the file count from its own origin, wherever that is on the globe.
        yield from (f"{child.tag} of header" for child in element if child.tag not in _REMARKS)
        return
    yield from _unused_attributes(element)
    yield from _repeated(element)
    for child in element:
        if child.tag in _REMARKS:
            continue
        if child.tag in _GROUPS:
            yield from (grandchild.tag for grandchild in child if grandchild.tag not in _REMARKS)
        elif child.tag not in _READ.get(element.tag, frozenset()):
            yield f"{child.tag} of {element.tag}"
        else:
            yield from _unused(child)


def _repeated(element: Element) -> Iterator[str]:
    """Records of a lane of which only the first has an effect."""
    for tag, path in (("height", "height"), *((tag, f"link/{tag}") for tag in sorted(_LINKS))):
        if element.tag == "lane":
            yield from [f"{tag} after a lane's first"] * (len(element.findall(path)) - 1)


def _unused_attributes(element: Element) -> Iterator[str]:
    if element.tag == "lane" and element.get("direction") == "both":
        yield "direction='both' of lane"
    if element.tag == "laneSection" and element.get("singleSide") == "true":
        yield "singleSide='true' of laneSection"
    if element.tag == "junction" and element.get("type") == "virtual":
        yield "virtual junction"
    elif element.tag == "junction":
        ways = element.findall("connection")
        yield from ["connection without laneLink" for way in ways if way.find("laneLink") is None]
    if element.tag == "road" and element.get("junction", "-1") != "-1":
        marks = (mark.get("type", "none") for mark in element.iter("roadMark"))
        yield from ["roadMark in a junction" for kind in marks if kind in _MARKS - _BARE]
    if element.tag == "roadMark":
        kind, color = element.get("type", "none"), element.get("color", "white")
        if kind not in _MARKS:
            yield f"type='{kind}' of roadMark"
        if color not in _COLORS:
            yield f"color='{color}' of roadMark"
    if element.tag in _LINKS and "elementS" in element.attrib:
        yield "link into a road (elementS)"
