"""Claim: third-party readers recover the data set's labels from every export.

Pictures, boxes, categories, splits and masks must be equal; and the labels, scored as predictions
against the export by COCO's evaluation, must have an average precision of 1.
"""

import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path

from gen_data.core import errors, interfaces
from gen_data.exporters.sensor_selection import rgb_cameras
from gen_data.lab.certificate import labelled_images, scoring
from gen_data.lab.certificate.examined import Examined
from gen_data.lab.certificate.finding import Contradictions, Figure, Finding, not_checked
from gen_data.lab.certificate.readers import READERS, Reader

PERFECT = 1.0 - 1e-9
"""Average precision that rounding of sums leaves of 1."""


def check_exports(examined: Examined) -> Iterator[Finding]:
    """Read every export of the data set."""
    stated: list[labelled_images.LabelledImage] | None = None
    for exporter in sorted(examined.config.exporters, key=lambda e: e.type):
        root = examined.stored.folder / exporter.type
        reader = READERS.get(exporter.type)
        reason = _unable(examined, exporter, reader)
        if reason or reader is None:
            yield not_checked(exporter.type, reason)
            continue
        if stated is None:
            cameras = rgb_cameras(examined.stored.info)
            stated = [
                labelled_images.image_of(image, examined.photograph(image.index, image.camera))
                for image in examined.images()
                if image.camera in cameras and examined.arrived(image.index, image.camera)
            ]
        yield _check_export(examined, root, reader, stated)


def _unable(examined: Examined, exporter: interfaces.Exporter, reader: Reader | None) -> str:
    """Why an export cannot be checked; empty if it can."""
    if reader is None:
        return "no reader of this format is known to gen-data"
    if not (examined.stored.folder / exporter.type).is_dir():
        return "the export has no files"
    if not examined.config.general.labels.map.is_identity:
        return "a label map changes the classes of all exports: labels and exports differ by design"
    if getattr(exporter, "cameras", ()) or getattr(exporter, "rectify", False):
        return "its fields cameras or rectify give it other images than the labels have, by design"
    if getattr(exporter, "bbox", "visible") != "visible":
        return "its boxes enclose whole silhouettes, unlike labels of visible pixels"
    return reader.missing()


def _check_export(
    examined: Examined, root: Path, reader: Reader, stated: Sequence[labelled_images.LabelledImage]
) -> Finding:
    contradictions = Contradictions()
    releases = sorted(reader.versions().items())
    figures: dict[str, Figure] = {"reader": " ".join(f"{k} {v}" for k, v in releases)}
    try:
        # Warnings of readers concern their packages.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = reader.load()(root, examined.stored)
    except ImportError as error:
        return not_checked(root.name, f"{reader.package} cannot be loaded: {error}")
    # A reader may refuse a damaged file with an exception of any kind.
    except Exception as error:
        if errors.is_refused(error):
            raise
        contradictions.add(f"{reader.package} refuses it: {type(error).__name__}: {error}")
        return contradictions.judge(root.name, figures)
    for fault in loaded.faults:
        contradictions.add(fault)
    figures |= loaded.counts
    if loaded.images is not None:
        figures |= _compare(stated, loaded.images, reader, contradictions)
    return contradictions.judge(root.name, figures)


def _compare(
    stated: Sequence[labelled_images.LabelledImage],
    found: Sequence[labelled_images.LabelledImage],
    reader: Reader,
    contradictions: Contradictions,
) -> dict[str, Figure]:
    """Compare images with the labels, and score them; adds contradictions, returns figures."""
    for fact in labelled_images.compare_images(stated, found, reader.tolerance_px):
        contradictions.add(fact)
    figures: dict[str, Figure] = {
        "images": len(found),
        "pictures": sum(bool(image.pixels) for image in found),
        "objects": sum(len(image.objects) for image in found),
    }
    masked = all(o.mask is not None for image in (*stated, *found) for o in image.objects)
    for kind, noun in (("bbox", "boxes"), ("segm", "masks")):
        if kind == "segm" and not masked:
            continue
        score = scoring.average_precision(found, stated, kind)  # type: ignore[arg-type]
        figures[f"AP of {noun}"] = round(score, 6)
        if score < PERFECT:
            contradictions.add(f"labels as predictions: AP of {noun} {score:.4f}, expected 1")
    return figures
