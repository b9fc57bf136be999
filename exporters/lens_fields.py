"""Lenses in exports: the fields that make a K complete for other lenses than a pinhole."""

from typing import Any

from gen_data.core.interfaces import DatasetInfo
from gen_data.core.lens import COEFFICIENTS, Lens


def lens_fields(lens: Lens) -> dict[str, Any]:
    """A lens as ``{"lens": {...}}``; empty for a pinhole.

    Its ``model`` is one of ``gen_data.core.lens``; ``distortion`` are its coefficients in
    the order of OpenCV's functions, with the names ``coefficients``; beyond ``half_field_rad`` from
    the axis it has no image. A panorama has the model only. K has the pixel centres of the format.
    """
    if lens.model == "pinhole":
        return {}
    names = COEFFICIENTS[lens.model]
    known: dict[str, Any] = {"model": lens.model, "coefficients": list(names)}
    if names:
        known["distortion"] = list(lens.coefficients)
        known["half_field_rad"] = lens.half_field_rad
    return {"lens": known}


def has_bent_camera(info: DatasetInfo) -> bool:
    """Whether a table of images needs columns for lenses."""
    return any(info.sensor(camera).lens != "pinhole" for camera in info.cameras)
