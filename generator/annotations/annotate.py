"""Runs the annotators on the objects of an image, on images and on samples."""

from collections.abc import Mapping, Sequence

from pydantic import Field

from gen_data.annotations import consistency_checks, instance_extents
from gen_data.config.base_model import Strict
from gen_data.core import errors, interfaces
from gen_data.core.capture import Capture, Channel, SensorReading
from gen_data.core.sample import EgoTruth, ImageTruth, ObjectTruth
from gen_data.core.scene import Scene
from gen_data.core.scene_time import ego_rig, rig_twist

NO_READINGS = Capture({})


class Thresholds(Strict):
    """Thresholds for annotating an instance in an image; the others remain in the id images.

    Instances without a visible pixel are annotated only with ``include_invisible``.
    """

    min_visible_px: int = Field(16, ge=1)
    """Smallest number of visible pixels."""
    min_visible_fraction: float = Field(0.0, ge=0.0, le=1.0)
    """Smallest visible share of the silhouette; above 0 it requires the annotation visibility."""
    min_box_px: int = Field(3, ge=1)
    """Smallest side of the visible box."""
    include_invisible: bool = False
    """Annotate all instances, hidden ones too; the other thresholds do not apply then."""


def annotate_reading(
    scene: Scene,
    reading: SensorReading,
    annotators: Sequence[interfaces.AnyAnnotator],
    thresholds: Thresholds,
    assets: interfaces.AssetLibrary,
) -> ImageTruth:
    """Annotate one reading: its objects, and the image as a whole.

    Raises:
        SampleError, ConfigError: see ``annotate_objects``.
    """
    truth = annotate_objects(scene, reading, annotators, thresholds)
    for annotator in annotators:
        if isinstance(annotator, interfaces.ImageAnnotator):
            truth = annotator.annotate_image(scene, assets, reading, truth)
    return truth


def annotate_ego(
    scenes: Mapping[str, Scene],
    annotators: Sequence[interfaces.AnyAnnotator],
    assets: interfaces.AssetLibrary,
    capture: Capture = NO_READINGS,
) -> EgoTruth | None:
    """Annotate one sample as a whole; None without an annotator of samples.

    ``scenes`` are as in ``FrameAnnotator``. Annotators of sequences add their fields later.
    """
    whole = (interfaces.FrameAnnotator, interfaces.CaptureAnnotator, interfaces.SequenceAnnotator)
    if not any(isinstance(a, whole) for a in annotators):
        return None
    scene = scenes[""]
    rig = ego_rig(scene)
    truth = EgoTruth()
    if rig is not None:
        truth = EgoTruth(rig.name, scene.rig_pose(rig.name).rounded(), rig_twist(scene, rig))
    for annotator in annotators:
        if isinstance(annotator, interfaces.FrameAnnotator):
            truth = annotator.annotate_frame(scenes, assets, truth)
        if isinstance(annotator, interfaces.CaptureAnnotator):
            truth = annotator.annotate_capture(scenes, assets, capture, truth)
    return truth


def annotate_objects(
    scene: Scene,
    reading: SensorReading,
    annotators: Sequence[interfaces.AnyAnnotator],
    thresholds: Thresholds,
) -> ImageTruth:
    """Annotate the objects in one reading, in order of instance id.

    Annotators of whole images and samples are skipped.

    Raises:
        SampleError: the labels of an instance contradict each other or the images.
        ConfigError: a threshold requires an annotation that is not configured.
    """
    of_objects = [a for a in annotators if isinstance(a, interfaces.Annotator)]
    if not of_objects:
        return ImageTruth(reading.camera, ())
    seen = instance_extents.find_extents(reading.channels[Channel.INSTANCE])
    instances = sorted((i for i in scene.instances if i.annotated), key=lambda i: i.instance_id)
    objects = []
    for instance in instances:
        extent = seen.get(instance.instance_id)
        if extent is None and not thresholds.include_invisible:
            continue
        truth = ObjectTruth(
            instance,
            visible_px=extent.visible_px if extent else 0,
            box=extent.box if extent else None,
        )
        for annotator in of_objects:
            truth = annotator.annotate(scene, reading, truth)
        consistency_checks.check_truth(reading, truth)
        if is_listed(truth, thresholds):
            objects.append(truth)
    return ImageTruth(reading.camera, tuple(objects))


def is_listed(truth: ObjectTruth, thresholds: Thresholds) -> bool:
    """Whether an object is visible enough to be annotated.

    Raises:
        ConfigError: if ``min_visible_fraction`` is set and the visible fraction is not known.
    """
    if thresholds.include_invisible:
        return True
    if truth.box is None or truth.visible_px < thresholds.min_visible_px:
        return False
    if min(truth.box.width_px, truth.box.height_px) < thresholds.min_box_px:
        return False
    if thresholds.min_visible_fraction > 0 and truth.visible_fraction is None:
        raise errors.ConfigError(
            "min_visible_fraction: the visible fraction of objects is unknown; "
            "add 'visibility' to annotations or set min_visible_fraction to 0"
        )
    return (truth.visible_fraction or 0.0) >= thresholds.min_visible_fraction
