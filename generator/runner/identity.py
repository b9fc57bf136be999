"""Identity of a data set: its plan and the licences of its assets."""

from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version

from gen_data.assemble.config import RUN_KEYS
from gen_data.assemble.pipeline_factory import PipelineFactory, annotators_of
from gen_data.assemble.plugin_tables import third_party_packages
from gen_data.assets.installed_packs import TAG, installed_packs
from gen_data.assets.paths import packs_dir
from gen_data.core.asset_types import Asset
from gen_data.core.scene import Scene
from gen_data.core.version import __version__
from gen_data.runner.licence_table import licence_table
from gen_data.runner.plan import Plan

BYTES_DEPEND_ON = {
    "OpenEXR": "OpenEXR",
    "PIL": "pillow",
    "cascadio": "cascadio",
    "collada": "pycollada",
    "cv2": "opencv-python-headless",
    "deflate": "deflate",
    "fast_simplification": "fast-simplification",
    "foxglove_schemas_protobuf": "foxglove-schemas-protobuf",
    "google": "protobuf",
    "google_crc32c": "google-crc32c",
    "h5py": "h5py",
    "inflect": "inflect",
    "mapbox_earcut": "mapbox-earcut",
    "mcap": "mcap",
    "mcap_protobuf": "mcap-protobuf-support",
    "mujoco": "mujoco",
    "numpy": "numpy",
    "pxr": "usd-core",
    "pyarrow": "pyarrow",
    "pybullet": "pybullet",
    "pycocotools": "pycocotools",
    "pyoidn": "pyoidn",
    "rerun": "rerun-sdk",
    "scipy": "scipy",
    "shapely": "shapely",
    "trimesh": "trimesh",
    "warp": "warp-lang",
}
"""Packages whose release can change the bytes of a data set, by imported module.

``tests/architecture/test_identity.py`` checks that each imported library is here or known to be
harmless.
"""


def make_plan(factory: PipelineFactory) -> Plan:
    """Make the plan of a factory's data set.

    It names the physics engine even if that is this machine's default: on others it may not be.
    """
    config = factory.config
    resolved = {key: v for key, v in config.resolved.items() if key not in RUN_KEYS}
    physics = resolved.get("physics") or {}
    engine = {"engine": config.general.physics.engine}
    assets = possible_assets(factory)
    return Plan(
        config={**resolved, "physics": {**physics, **engine}},
        name=config.name,
        seed=config.general.seed,
        n=factory.n,
        shard_size=config.general.shard_size,
        versions={
            **{name: release(name) for name in ("gen-data", *BYTES_DEPEND_ON.values())},
            **_packs(assets),
            **third_party_packages((*config.plugins(), *annotators_of(config))),
        },
        assets={asset.asset_id: asset.sha256 for asset in assets},
    )


def installation_differences(plan: Plan) -> list[str]:
    """Packages whose release here differs from the plan's, one line each; none if all are equal."""
    here = {name: release(name) for name in ("gen-data", *BYTES_DEPEND_ON.values())}
    return [
        f"{name}: {wanted} expected, {here[name]} here"
        for name, wanted in plan.versions.items()
        if name in here and here[name] != wanted
    ]


def format_licences(factory: PipelineFactory, used: Sequence[str]) -> str:
    """Markdown table of the assets with these ids, grouped by source."""
    library = factory.library
    return licence_table(library.get(asset_id) for asset_id in used)


def possible_assets(factory: PipelineFactory) -> tuple[Asset, ...]:
    """Every object, robot and panorama that a sample may contain, sorted by id."""
    library = factory.library
    ids = {asset_id for scene in factory.nominal for asset_id in _asset_ids(scene)}
    drawn = {
        asset_id
        for scene in factory.config.probes
        for randomizer in scene.randomizers
        for asset_id in randomizer.possible_assets(library)
    }
    return tuple(library.get(asset_id) for asset_id in sorted(ids | drawn))


def _packs(assets: tuple[Asset, ...]) -> dict[str, str]:
    """Versions of the installed packs, if a sample may contain an asset of any."""
    if not any(TAG in asset.tags for asset in assets):
        return {}
    return {
        f"pack {record.name}": f"{record.version} {record.digest[:16]}"
        for record in installed_packs(packs_dir())
    }


def _asset_ids(scene: Scene) -> set[str]:
    placed = {instance.asset for instance in scene.instances if instance.asset}
    robots = {articulation.asset for articulation in scene.articulations}
    links = {f"{a.name}/" for a in scene.articulations}
    bodies = {b.asset for b in scene.bodies if not any(b.name.startswith(p) for p in links)}
    drawn = {asset_id for group in scene.groups for asset_id in group.assets}
    return placed | robots | bodies | drawn


def release(package: str) -> str:
    """Installed version of a package; ``absent`` if there is none."""
    try:
        # Another project has this name on the package index.
        return __version__ if package == "gen-data" else version(package)
    except PackageNotFoundError:
        return "absent"
