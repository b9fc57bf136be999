"""Stand-ins for the asset library: solids of known size, and small scenes made of them."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from gen_data.core.asset_types import ConvexParts, Joint, RobotModel
from gen_data.core.errors import AssetError, Rejection
from gen_data.core.scene import Body, ObjectGroup, Scene, SupportSurface
from gen_data.core.se3 import SE3
from gen_data.physics.engine import Engine
from tests.physics.panda import mesh_vertices, panda

TABLE_TOP_Z_M = 0.75
TABLE_SIZE_M = (1.2, 0.8)


class Solids:
    """An asset library whose ids are sizes: ``box 0.1 0.2 0.3``, ``cylinder 0.03 0.12``."""

    def convex_parts(self, asset_id: str) -> ConvexParts:
        return _parts(asset_id)

    def robot(self, asset_id: str) -> RobotModel:
        if asset_id not in ROBOTS:
            raise AssetError(f"no robot '{asset_id}'")
        return ROBOTS[asset_id]()

    def __getattr__(self, name: str) -> Any:
        """Physics gets by with collision geometry and kinematics, and this library stores none."""
        if name in ("derived", "is_stored"):
            raise AttributeError(name)
        raise AssertionError(f"physics must not ask the library for '{name}'")


@cache
def _parts(asset_id: str) -> ConvexParts:
    kind, *rest = asset_id.replace("/", " ").split()
    if kind == "panda":
        return ConvexParts((_thinned(mesh_vertices(rest[0])),))
    sizes = [float(word) for word in rest]
    makers = {
        "box": lambda x, y, z: (box(x, y, z),),
        "cylinder": lambda r, h: (cylinder(r, h),),
        "cone": lambda r, h: (cylinder(r, h, top_radius_m=1e-4),),
        "ball": lambda r: (ball(r),),
        "mug": mug,
        "bin": lambda x, y, z: tray(x, y, z, wall_m=0.01),
        "mast": lambda: (
            box(0.04, 0.08, 0.04, at=(0, 0, -0.1)),
            box(0.015, 0.015, 0.2, at=(-0.0125, 0, 0.02)),
        ),
        "bar": lambda: (box(0.26, 0.04, 0.04, at=(0.15, 0, 0)),),
    }
    return ConvexParts(tuple(makers[kind](*sizes)))


def box(x: float, y: float, z: float, at: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    signs = [[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
    return 0.5 * np.array(signs) * (x, y, z) + at


def cylinder(
    radius_m: float, height_m: float, top_radius_m: float | None = None, z_m: float = 0.0
) -> np.ndarray:
    angle = np.arange(24) * 2 * math.pi / 24
    ring = np.stack([np.cos(angle), np.sin(angle), np.zeros(24)], axis=1)
    top = radius_m if top_radius_m is None else top_radius_m
    return np.concatenate(
        [ring * radius_m + [0, 0, z_m - height_m / 2], ring * top + [0, 0, z_m + height_m / 2]]
    )


def ball(radius_m: float) -> np.ndarray:
    i = np.arange(200) + 0.5
    z, turn = 1 - 2 * i / 200, math.pi * (1 + math.sqrt(5)) * i
    r = np.sqrt(1 - z * z)
    return radius_m * np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def mug(radius_m: float, height_m: float) -> tuple[np.ndarray, ...]:
    """A floor, ten staves and a handle; the centre of the bounding box is the origin."""
    floor = cylinder(radius_m, 0.008, z_m=-height_m / 2 + 0.004)
    staves = []
    for k in range(10):
        points = [
            (r * math.cos(a), r * math.sin(a), z)
            for a in (2 * math.pi * (k + t) / 10 for t in (0, 0.5, 1))
            for r in (radius_m - 0.005, radius_m)
            for z in (-height_m / 2 + 0.008, height_m / 2)
        ]
        staves.append(np.array(points))
    handle = box(0.03, 0.01, 0.6 * height_m, at=(radius_m + 0.015, 0, 0))
    return tuple(part - (0.015, 0, 0) for part in (floor, *staves, handle))


def tray(x: float, y: float, z: float, wall_m: float) -> tuple[np.ndarray, ...]:
    """An open bin: floor and four walls of one thickness, outer size x, y, z."""
    side = (x - wall_m) / 2, (y - wall_m) / 2
    return (
        box(x, y, wall_m, at=(0, 0, (wall_m - z) / 2)),
        box(wall_m, y, z, at=(side[0], 0, 0)),
        box(wall_m, y, z, at=(-side[0], 0, 0)),
        box(x, wall_m, z, at=(0, side[1], 0)),
        box(x, wall_m, z, at=(0, -side[1], 0)),
    )


def _thinned(points: np.ndarray) -> np.ndarray:
    """The hull's vertices."""
    from scipy.spatial import ConvexHull

    return points[np.sort(ConvexHull(points).vertices)]


def gantry() -> RobotModel:
    """A post, two bars of 0.3 m that turn in the horizontal plane, 0.1 m up, and no gripper."""

    def hinge(name: str, parent: str, child: str, at: tuple[float, float, float]) -> Joint:
        return Joint(name, "revolute", parent, child, SE3(at), (0, 0, 1), -2.5, 2.5)

    bars = {"upper": "bar", "fore": "bar"}
    return RobotModel(
        links=("post", "upper", "fore"),
        joints=(
            hinge("shoulder", "post", "upper", (0, 0, 0.1)),
            hinge("elbow", "upper", "fore", (0.3, 0, 0)),
        ),
        visuals=bars,
        collisions=bars,
        home=(0.0, 0.5),
        gripper=None,
        no_collide=frozenset({("upper", "fore")}),
    )


ROBOTS = {"panda": cache(panda), "gantry": gantry}


def table_scene(*bodies: Body, placement: str = "drop", walled: bool = False) -> Scene:
    """A table of 1.2 m by 0.8 m, 0.75 m high, on a floor, and bodies of a group ``things``."""
    x, y = TABLE_SIZE_M
    surface = SupportSurface(
        "table", "table", SE3((0, 0, TABLE_TOP_Z_M)), TABLE_SIZE_M, clearance_m=2.0, walled=walled
    )
    furniture = (
        Body("floor", "box 6 6 0.1", SE3((0, 0, -0.05))),
        Body("table", f"box {x} {y} 0.04", SE3((0, 0, TABLE_TOP_Z_M - 0.02))),
    )
    group = ObjectGroup("things", ("table",), (), len(bodies), placement)  # type: ignore[arg-type]
    things = tuple(replace(body, group="things", motion="dynamic") for body in bodies)
    return Scene("test", bodies=furniture + things, surfaces=(surface,), groups=(group,))


def accepted(engine: Engine, scene: Scene) -> Scene:
    """The scene at rest; physics must accept it."""
    outcome = engine.settle(scene)
    assert outcome.rejection is None, outcome.rejection
    return outcome.scene


def refusal(engine: Engine, scene: Scene) -> Rejection:
    """Reason and remedy; physics must refuse the scene."""
    outcome = engine.settle(scene)
    assert outcome.rejection is not None
    return outcome.rejection


def thing(
    name: str, asset: str, x: float = 0.0, y: float = 0.0, above_m: float = 0.2,
    turn_deg: float = 0.0, axis: int = 0, **more: Any,
) -> Body:  # fmt: skip
    """A body whose origin is some height above the table's top, turned about X (0), Y or Z."""
    half_rad = math.radians(0.5 * turn_deg)
    turn = [math.cos(half_rad), 0.0, 0.0, 0.0]
    turn[1 + axis] = math.sin(half_rad)
    pose = SE3((x, y, TABLE_TOP_Z_M + above_m), tuple(turn))  # type: ignore[arg-type]
    return Body(name, asset, pose, mass_kg=0.3, **more)


HOUSEHOLD = (
    "box 0.19 0.06 0.28", "box 0.15 0.22 0.025", "cylinder 0.033 0.12", "mug 0.04 0.10",
    "ball 0.035", "cone 0.04 0.12", "box 0.05 0.05 0.05", "cylinder 0.08 0.02",
)  # fmt: skip


def random_turn(rng: np.random.Generator) -> SE3:
    """A rotation, uniform over all orientations."""
    w, x, y, z = (float(v) for v in rng.normal(size=4))
    norm = math.sqrt(w * w + x * x + y * y + z * z)
    return SE3(quaternion_wxyz=(w / norm, x / norm, y / norm, z / norm))


def world_vertices(body: Body) -> np.ndarray:
    vertices = np.concatenate(_parts(body.asset).parts_m) * body.scale
    return body.T_world_body.apply(vertices)


def dropped_clutter(seed: int, count: int = 10) -> Scene:
    """Household objects in any orientation, each 2 to 10 cm above the one before."""
    rng = np.random.Generator(np.random.Philox(key=seed))
    half = np.array(TABLE_SIZE_M) / 2
    bodies, top = [], 0.0
    for number in range(count):
        turn = random_turn(rng)
        body = Body(f"things/{number}", HOUSEHOLD[int(rng.integers(len(HOUSEHOLD)))], turn)
        points = world_vertices(body)
        low, high = points.min(axis=0), points.max(axis=0)
        x, y = (float(v) for v in rng.uniform(-half - low[:2], half - high[:2]))
        above = top + float(rng.uniform(0.02, 0.10)) - float(low[2])
        top = above + float(high[2])
        placed = SE3((x, y, TABLE_TOP_Z_M + above), turn.quaternion_wxyz)
        bodies.append(replace(body, T_world_body=placed, mass_kg=0.3))
    return table_scene(*bodies)
