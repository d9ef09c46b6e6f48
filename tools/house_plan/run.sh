#!/usr/bin/env bash
# Draws the house together in one command: bash tools/house_plan/run.sh (of a clean working tree)
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
git diff --quiet || { echo "commit first" >&2; exit 1; }
python -B tools/house_plan/apply.py . "$@"
ruff check --fix-only -q --select I,F401,F811,PLC0414,RUF100 --fixable I,F401 sumo3dviz_pt tests tools docs examples || true
ruff format -q --exclude tools/house_plan
ruff check --fix -q || true
ruff format -q --exclude tools/house_plan
