"""The arm and the camera of a configuration that an environment uses."""

from gen_data.assemble.pipeline_factory import PipelineFactory
from gen_data.config.yaml_tree import Node
from gen_data.core.capture import Channel
from gen_data.core.errors import did_you_mean
from gen_data.core.interfaces import Modality
from gen_data.core.intrinsics import Intrinsics
from gen_data.core.scene import Articulation
from gen_data.lab.environment.settings import refuse_field


def choose_arm(factory: PipelineFactory, name: str, settings: Node) -> Articulation:
    """The arm of that name, or the only one; the same robot in all scenes.

    Args:
        factory: Factory of the configuration.
        name: Name of the arm; empty = the only one.
        settings: Source of the name.

    Raises:
        ConfigError: there is none, several have no name given, the robot differs from scene to
            scene, or it has no gripper.
    """
    document = factory.config.document
    arms: list[Articulation] = []
    for scene in factory.nominal:
        known = [arm.name for arm in scene.articulations]
        if not known:
            refuse_field(document, "elements", "there is no robot; expected one with a gripper")
        if name not in known and (name or len(known) > 1):
            wrong = f"there is no arm '{name}'" if name else "there are several arms"
            hint = did_you_mean(name, known)
            refuse_field(settings, "arm", f"{wrong}; expected {' or '.join(known)}{hint}")
        arms.append(next(arm for arm in scene.articulations if name in ("", arm.name)))
    robots = sorted({arm.asset for arm in arms})
    if len(robots) > 1:
        fact = (
            f"the robot differs from scene to scene ({', '.join(robots)}), but actions need one; "
            f"fix it, such as with overrides=['shared.robot={robots[0]}']"
        )
        refuse_field(document, "elements", fact)
    if factory.library.robot(robots[0]).gripper is None:
        refuse_field(document, "elements", f"robot '{robots[0]}' has no gripper; expected one")
    return arms[0]


def choose_camera(factory: PipelineFactory, name: str, settings: Node) -> tuple[str, Intrinsics]:
    """Name and size of a camera.

    Args:
        factory: Factory of the configuration.
        name: Name of the camera; empty = the first one.
        settings: Source of the name.

    Raises:
        ConfigError: it does not exist, or takes no photographs.
    """
    sensors = [sensor.describe() for sensor in factory.config.sensors]
    known = [s.name for s in sensors if s.modality is Modality.CAMERA and Channel.RGB in s.channels]
    if not known:
        fact = "there is no camera with channel 'rgb'; expected one"
        refuse_field(factory.config.document, "sensors", fact)
    if name and name not in known:
        fact = f"there is no camera '{name}' with channel 'rgb'; expected {' or '.join(known)}"
        refuse_field(settings, "camera", f"{fact}{did_you_mean(name, known)}")
    chosen = name or known[0]
    return chosen, factory.nominal[0].camera(chosen).intrinsics
