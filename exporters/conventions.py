"""Conventions in which formats differ, stated once by the class of each exporter.

The table in docs/formats.md, and the statements in the files of formats with room for them, are
made from these records.
"""

from dataclasses import asdict, dataclass

NONE = ""
PINHOLE = "pinholes only"
ANY_LENS = "any; labels are where the lens puts them"
EDGES = "left, top, width, height along the edges of pixels"
READING = "s from the sequence's first instant; middle of the exposure or sweep"
POINT_TIME = "times of points from `point_time`"
SAMPLE = "s from the sequence's first instant"


@dataclass(frozen=True, slots=True, kw_only=True)
class Conventions:
    """Meaning of the numbers of a format; empty where the format has no such number.

    Attributes:
        pixel_centre: Coordinate of the centre of pixel ``i`` in calibrations (keypoints and
            polygons, in formats without calibration): ``i`` or ``i + 0.5``.
        box: Numbers of a box in an image.
        lens: Lenses that it takes, and where their coefficients are.
        time: Unit, origin and instant of its times.
        ring: Which laser has number 0.
        intensity: Range of the intensity of laser points.
    """

    pixel_centre: str = NONE
    box: str = NONE
    lens: str = NONE
    time: str = NONE
    ring: str = NONE
    intensity: str = NONE

    def facts(self) -> dict[str, str]:
        """The conventions that the format has, by name, for a file's metadata."""
        return {name: text for name, text in asdict(self).items() if text}


NO_CONVENTIONS = Conventions()
"""Of a format without any of these numbers."""
