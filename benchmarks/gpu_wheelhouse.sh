#!/usr/bin/env bash
# All that a machine with a GPU and without a network needs, in parts of at most 30 MB.
#
#     benchmarks/gpu_wheelhouse.sh FOLDER [KIND...]      here; KIND as in sm_90
#     bash FOLDER/join.sh TARGET                         there, with all parts in FOLDER
#     . TARGET/activate && python3 -m benchmarks.gpu ...
#
# Packed are this tree as committed, wheels for PYTHON_VERSION (3.12) without those named in SKIP
# ("numpy scipy ..." that are there already), the files of pybullet's data that assets refer to,
# and compiled kernels: for the CPU, and for the given kinds of GPUs, if there are any. Others are
# compiled there on first use, by Warp alone. FOLDER/list.txt has all packed files with their sizes.
set -euo pipefail
folder=$(mkdir -p "$1" && cd "$1" && pwd)
kinds=("${@:2}")
root=$(cd "$(dirname "$0")/.." && pwd)
staging=$(mktemp -d)
trap 'rm -rf "$staging"' EXIT
cd "$root"

mkdir "$staging/wheels"
platforms=()
for n in 17 24 27 28 31 34; do platforms+=(--platform "manylinux_2_${n}_x86_64"); done
platforms+=(--platform manylinux2014_x86_64)
python - "${PYTHON_VERSION:-3.12}" ${SKIP:-} > "$staging/requirements.txt" <<'PYTHON'
"""Print the distribution's requirements that hold there, without those to skip."""
import sys
import tomllib

from packaging.requirements import Requirement

version, *skipped = sys.argv[1:]
there = {"python_version": version, "sys_platform": "linux", "platform_machine": "x86_64"}
with open("pyproject.toml", "rb") as file:
    wanted = map(Requirement, tomllib.load(file)["project"]["dependencies"])
for one in wanted:
    if one.name not in skipped and (one.marker is None or one.marker.evaluate(there)):
        print(f"{one.name}{one.specifier}")
PYTHON
python -m pip download -q --dest "$staging/wheels" --only-binary :all: --implementation cp \
    --python-version "${PYTHON_VERSION:-3.12}" "${platforms[@]}" -r "$staging/requirements.txt"
for name in ${SKIP:-}; do rm -f "$staging/wheels/${name//-/_}"-*.whl; done

mkdir "$staging/tree"
git archive HEAD | tar x -C "$staging/tree" --exclude='docs/*.png' --exclude=docs/pictures
(cd "$staging/tree" && PYTHONPATH=$PWD python -m gen_data.renderers.warp.kernel_bundle \
    ${kinds[@]+"${kinds[@]}"})
GEN_DATA_ASSETS="$staging/assets" PYTHONPATH="$staging/tree" python -m gen_data assets install pybullet

(cd "$staging" && find tree/generator/renderers/warp/compiled wheels assets -type f -printf '%s %p\n') \
    | sort -rn > "$folder/list.txt"
rm -f "$folder"/part.*
tar c -C "$staging" tree wheels assets | gzip -6 | split -b 30M -d -a 2 - "$folder/part."
cat > "$folder/join.sh" <<'BASH'
#!/usr/bin/env bash
# Join the parts next to this script, and install them into a folder: bash join.sh TARGET
set -euo pipefail
mkdir -p "$1" && target=$(cd "$1" && pwd)
cat "$(dirname "$0")"/part.* | tar xz -C "$target"
python3 -m pip install -q --no-index --no-deps --no-cache-dir --upgrade --target "$target/site" "$target"/wheels/*.whl
cat > "$target/activate" <<END
export PYTHONPATH=$target/tree:$target/site GEN_DATA_ASSETS=$target/assets
cd $target/tree
END
BASH
du -h "$folder"/part.* "$folder/join.sh"
