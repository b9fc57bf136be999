"""The arm and the camera of a configuration that an environment uses."""

from __future__ import annotations

from gen_data.generator.assemble.pipeline_factory import PipelineFactory
from gen_data.generator.config.problems import refuse
from gen_data.generator.core.capture import Channel
from gen_data.generator.core.errors import ConfigError, did_you_mean
from gen_data.generator.core.interfaces import Modality
from gen_data.generator.core.intrinsics import Intrinsics
from gen_data.generator.core.scene import Articulation


def choose_arm(factory: PipelineFactory, name: str) -> Articulation:
    """The arm of that name, or the only one; the same robot in all scenes.

    Raises:
        ConfigError: there is none, several have no name given, the robot differs from scene to
            scene, or it has no gripper.
    """
    document = factory.config.document
    place = (document.get("elements") or document).position
    arms = [_named_arm(scene.articulations, name) for scene in factory.nominal]
    first = next((arm for arm in arms if arm is not None), None)
    if first is None or None in arms:
        refuse(place, "elements", "there is no robot; expected one, of which actions move the arm")
    robots = sorted({arm.asset for arm in arms if arm is not None})
    if len(robots) > 1:
        fact = (
            f"the robot differs from scene to scene ({', '.join(robots)}), but actions need one; "
            f"fix it, such as with overrides=['shared.robot={robots[0]}']"
        )
        refuse(place, "elements", fact)
    if factory.library.robot(first.asset).gripper is None:
        refuse(place, "elements", f"robot '{first.asset}' has no gripper; expected one with it")
    return first


def choose_camera(factory: PipelineFactory, name: str) -> tuple[str, Intrinsics]:
    """Name and size of the camera of that name, or of the first one.

    Raises:
        ConfigError: it does not exist, or takes no photographs.
    """
    sensors = [sensor.describe() for sensor in factory.config.sensors]
    known = [s.name for s in sensors if s.modality is Modality.CAMERA and Channel.RGB in s.channels]
    if not known:
        document = factory.config.document
        place = (document.get("sensors") or document).position
        refuse(place, "sensors", "there is no camera with channel 'rgb'; expected one")
    if name and name not in known:
        raise ConfigError(
            f"camera: there is no camera '{name}' with channel 'rgb'; expected "
            f"{', '.join(known)}{did_you_mean(name, known)}"
        )
    chosen = name or known[0]
    return chosen, factory.nominal[0].camera(chosen).intrinsics


def _named_arm(arms: tuple[Articulation, ...], name: str) -> Articulation | None:
    known = [arm.name for arm in arms]
    if name and known and name not in known:
        raise ConfigError(
            f"arm: there is no arm '{name}'; expected {', '.join(known)}{did_you_mean(name, known)}"
        )
    if not name and len(arms) > 1:
        raise ConfigError(f"arm: there are several arms; expected one of {', '.join(known)}")
    return next((arm for arm in arms if name in ("", arm.name)), None)
