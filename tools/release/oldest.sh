#!/usr/bin/env bash
# The README's quick tests with the oldest versions of its dependencies that pyproject.toml allows,
# on the oldest Python: tools/release/oldest.sh [ARGUMENTS OF PYTEST]
# What these need in turn is as new as they allow; what old packages then call deprecated is not
# our matter. The folder OLDEST, or a temporary one, has them.
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

folder=${OLDEST:-$(mktemp -d)}
python=${PYTHON:-python3.11}
"$python" -m venv "$folder/tools"
"$folder/tools/bin/pip" install -q --require-hashes -r <(sed -n '/^uv==/,/[^\\]$/p' tools/release/requirements.txt)
"$python" -m venv "$folder/venv"
"$folder/tools/bin/uv" pip install --python "$folder/venv/bin/python" --resolution lowest-direct -e ".[test]"
"$folder/venv/bin/sumo3dviz-pt" doctor --install --yes </dev/null
"$folder/venv/bin/pytest" -q -n 2 -W ignore::DeprecationWarning -p no:cacheprovider "$@"
