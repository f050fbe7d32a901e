#!/bin/sh
# Every check that a change must pass: the tests with the oldest and with the newest versions of
# all that pyproject.toml allows, and the style. Needs Python 3.11 or later and nothing else.
set -eu
cd "$(dirname "$0")"

environment() {
    "${PYTHON:-python3}" -m venv ".venv-$1"
    ".venv-$1/bin/python" -m pip install --quiet uv
    ".venv-$1/bin/uv" pip install --quiet --python ".venv-$1/bin/python" --upgrade \
        --resolution "$1" --editable '.[test]'
}

environment lowest-direct
.venv-lowest-direct/bin/python -m pytest "$@"
environment highest
.venv-highest/bin/ruff check .
.venv-highest/bin/ruff format --check .
.venv-highest/bin/python -m pytest "$@"
