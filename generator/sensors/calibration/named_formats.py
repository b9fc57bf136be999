"""Cameras of files in which every number has a name: nerfstudio, ORB-SLAM, Stella, camodocal.

* ``transforms.json`` of nerfstudio and instant-ngp: pixel centres at halves, as in COLMAP.
* Settings of ORB-SLAM2 and 3 and of Stella-VSLAM. ``T_c1_c2`` takes points of camera 2 to camera 1,
  ``T_b_c1`` takes points of camera 1 to the body; so do ``Tlr`` and ``Tbc`` of older files.
* camodocal (VINS-Mono, VINS-Fusion): its ``k2`` to ``k5`` are OpenCV's ``k1`` to ``k4``;
  ``body_T_cam0`` in another file takes points of the camera to the body.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from gen_data.config.yaml_tree import Node
from gen_data.core.errors import did_you_mean
from gen_data.core.lens import LensModel
from gen_data.sensors.calibration import calibration, camera_formats

_Lens = tuple[LensModel, str]
_BROWN: _Lens = ("brown_conrady", "k1 k2 p1 p2 k3")
_FISHEYE: _Lens = ("kannala_brandt", "k1 k2 k3 k4")
_NERF = {
    **dict.fromkeys(("", "OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL"), _BROWN),
    "OPENCV_FISHEYE": _FISHEYE,
}
_SLAM = {
    **dict.fromkeys(("", "PinHole", "Rectified", "perspective"), _BROWN),
    **dict.fromkeys(("KannalaBrandt8", "fisheye"), _FISHEYE),
}


@dataclass(frozen=True)
class _Layout:
    """Names of the entries of a camera; names of nested entries are joined by dots.

    Attributes:
        kind: The format in words.
        camera: Name of the camera.
        numbers: fx, fy, cx and cy.
        model: The entry that names the lens.
        lenses: Lenses with their coefficients, by that name; by an empty one the default.
        prefix: Start of the coefficients' names.
        pixel_centers: Where pixel centres are, as in ``CalibratedCamera``.
    """

    kind: str
    camera: str
    numbers: str
    model: tuple[str, ...]
    lenses: Mapping[str, _Lens]
    prefix: str
    pixel_centers: str = "integers"


def _slam(camera: str, prefix: str) -> _Layout:
    numbers = " ".join(f"{prefix}{name}" for name in ("fx", "fy", "cx", "cy"))
    model = ("Camera.type", "Camera.model")
    return _Layout("settings of ORB-SLAM", camera, numbers, model, _SLAM, prefix)


def _camodocal(names: str, lens: str, coefficients: _Lens, prefix: str) -> _Layout:
    numbers = " ".join(f"projection_parameters.{name}" for name in names.split())
    kind, lenses = "a camera of camodocal", {lens: coefficients}
    return _Layout(kind, "camera", numbers, ("model_type",), lenses, prefix)


_SHIFTED: _Lens = ("kannala_brandt", "k2 k3 k4 k5")
_LAYOUTS = (
    _Layout(
        "transforms of nerfstudio", "camera", "fl_x fl_y cx cy", ("camera_model",), _NERF, "",
        "halves",
    ),
    *(_slam(*names) for names in (("1", "Camera1."), ("2", "Camera2."), ("camera", "Camera."))),
    _camodocal("fx fy cx cy", "PINHOLE", _BROWN, "distortion_parameters."),
    _camodocal("mu mv u0 v0", "KANNALA_BRANDT", _SHIFTED, "projection_parameters."),
)  # fmt: skip
_PLACES = (
    ("1", "body", "IMU.T_b_c1"),
    ("2", "1", "Stereo.T_c1_c2"),
    ("camera", "body", "Tbc"),
    ("2", "camera", "Tlr"),
    ("cam0", "body", "body_T_cam0"),
    ("cam1", "body", "body_T_cam1"),
)
"""Frames with their parents, and the entries with their poses."""


def named_cameras(root: Node) -> calibration.Calibration | None:
    """Cameras of one of these formats; None if the file has another one."""
    entries = camera_formats.Entries(Node(root.position, _flat(root)))
    found = [one for one in _LAYOUTS if all(n in entries.root.entries for n in one.numbers.split())]
    if not found and not any(entries.root.get(name) for *_, name in _PLACES):
        return None
    size_px = camera_formats.size_px_of(entries)
    cameras = {
        layout.camera: calibration.attempt(partial(_camera, layout, entries, size_px))
        for layout in found
    }
    frames: dict[str, calibration.Frame] = {}
    for frame, parent, name in _PLACES:
        pose = entries.take((name,))
        if pose is not None:
            place = calibration.rigid(calibration.numbers(pose, [12, 16], name), pose, name)
            frames.setdefault(parent, calibration.Frame(optical=parent != "body"))
            frames[frame] = calibration.Frame(parent, place, optical=True)
    unused = dict.fromkeys(entries.group(name) for name in entries.unused())
    kind = found[0].kind if found else "places of VINS"
    return calibration.Calibration(root.position.file, kind, cameras, frames, list(unused))


def _flat(node: Node, prefix: str = "") -> dict[str, Node]:
    """Entries of nested mappings, except of OpenCV's matrices, by their names joined by dots."""
    found: dict[str, Node] = {}
    for key, one in node.entries.items():
        is_matrix = not one.entries or "data" in one.entries
        found |= {f"{prefix}{key}": one} if is_matrix else _flat(one, f"{prefix}{key}.")
    return found


def _camera(
    layout: _Layout, entries: camera_formats.Entries, size_px: tuple[int, int] | None
) -> calibration.CalibratedCamera:
    def number(name: str) -> float:
        node = entries.take((name,))
        return 0.0 if node is None else calibration.numbers(node, [1], name)[0]

    first = entries.root.entries[layout.numbers.split()[0]]
    fx, fy, cx, cy = map(number, layout.numbers.split())
    calibration.check_focal(fx, fy, first, layout.numbers.split()[0])
    stated = entries.take(layout.model)
    name = stated.text if stated else ""
    fisheye = entries.take(("is_fisheye",))
    if fisheye is not None and fisheye.content and not name:
        name = "OPENCV_FISHEYE"
    if name not in layout.lenses:
        known = ", ".join(filter(None, layout.lenses))
        fact = f"'{name}' has no lens here; expected one of {known}"
        calibration.fail(stated or first, layout.model[0], fact + did_you_mean(name, layout.lenses))
    model, names = layout.lenses[name]
    coefficients = [number(f"{layout.prefix}{one}") for one in names.split()]
    for further in ("k4", "k5", "k6") if model == "brown_conrady" else ():
        # nerfstudio's k4 is not OpenCV's: it belongs to the numerator.
        if number(layout.prefix + further):
            node = entries.root.entries[layout.prefix + further]
            calibration.fail(node, layout.prefix + further, "other than 0 has no lens here")
    lens = camera_formats.lens_of(model, coefficients, first, "distortion")
    return calibration.CalibratedCamera(
        first.position, (fx, fy), (cx, cy), *lens, size_px, layout.pixel_centers
    )
