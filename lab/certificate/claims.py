"""All claims of a certificate: one file and one line in this table each."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module

from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Finding

_HERE = "gen_data.lab.certificate"


@dataclass(frozen=True)
class Claim:
    """A claim about a data set.

    Attributes:
        name: In certificates.
        statement: Statement that holds if it passes.
        place: ``module:function`` of the check, which yields findings.
    """

    name: str
    statement: str
    place: str

    def check(self, examined: Examined) -> Iterable[Finding]:
        """Findings of the check."""
        module, _, function = self.place.partition(":")
        check: Callable[[Examined], Iterable[Finding]] = getattr(
            import_module(f"{_HERE}.{module}"), function
        )
        return check(examined)


FILES = Claim(
    "files",
    "Every file has the size and the SHA-256 that the manifest declares; none is missing or extra.",
    "files:check_files",
)
"""Comes first: nothing else is said about a data set whose files are damaged."""

CLAIMS = (
    FILES,
    Claim(
        "run log",
        "Shards and data set agree with the commits and the seal in the log of the run.",
        "run_log:check_run_log",
    ),
    Claim(
        "samples",
        "Every sample can be decoded and obeys the rules that hold before a sample is written.",
        "sample_rules:check_sample_rules",
    ),
    Claim(
        "boxes and masks",
        "Every 2D box is the tight box of its mask, and every mask has the stated number of "
        "pixels, as pycocotools measures them.",
        "boxes_and_masks:check_boxes_and_masks",
    ),
    Claim(
        "exports",
        "Third-party packages read the exports. Where a format has 2D boxes and its reader "
        "compares them, classes, splits, boxes and masks equal the labels, which score an "
        "average precision of 1 as predictions.",
        "exports:check_exports",
    ),
    Claim(
        "written again",
        "Exports and documents that are written again from the stored samples are the stored ones; "
        "there is no other file.",
        "written_again:check_written_again",
    ),
    Claim(
        "pixels",
        "Intel Embree, an independent ray caster, meets the stated objects at the stated depths "
        "in random pixels of random images.",
        "pixels:check_pixels",
    ),
    Claim(
        "laser points",
        "Intel Embree meets the stated objects at random laser points of random scans, within the "
        "noise of the device.",
        "points:check_points",
    ),
    Claim(
        "draws",
        "Scenes that are drawn again from the declared parameters are the stored ones.",
        "parameters:check_draws",
    ),
    Claim(
        "generated again",
        "Random samples that are generated again from the plan have the stored pictures, points "
        "and labels.",
        "again:check_again",
    ),
    Claim(
        "distributions",
        "Drawn parameters follow their declared distributions.",
        "parameters:check_parameters",
    ),
    Claim("splits", "No scene is in two splits.", "splits:check_splits"),
)
"""In the order of the certificate."""
