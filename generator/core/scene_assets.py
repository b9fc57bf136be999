"""Assets that a scene consists of."""

from gen_data.core.scene import Scene


def assets_in(scene: Scene) -> set[str]:
    """Asset ids of a scene; the links of a robot count as the robot."""
    links = tuple(f"{articulation.name}/" for articulation in scene.articulations)
    bodies = [b for b in scene.bodies if not (links and b.name.startswith(links))]
    materials = (material for body in scene.bodies for material in body.materials)
    return {
        scene.environment.image,
        *(articulation.asset for articulation in scene.articulations),
        *(body.asset for body in bodies),
        *(material.texture.partition("#")[0] for material in materials if material.texture),
    }
