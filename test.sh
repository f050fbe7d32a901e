#!/bin/sh
# Every check that a change must pass: the tests with the oldest and with the newest versions of
# all that pyproject.toml allows, the style, and the site without a warning. Needs Python 3.11 or
# later and nothing else.
set -eu
cd "$(dirname "$0")"

environment() {
    "${PYTHON:-python3}" -m venv ".venv-$1"
    ".venv-$1/bin/python" -m pip install --quiet uv
    ".venv-$1/bin/uv" pip install --quiet --python ".venv-$1/bin/python" --upgrade \
        --resolution "$1" --editable ".[$2]"
}

environment lowest-direct test
.venv-lowest-direct/bin/python -m pytest "$@"
environment highest test,docs
.venv-highest/bin/ruff check .
.venv-highest/bin/ruff format --check .
.venv-highest/bin/python -m pytest "$@"
rm -rf docs/_build docs/gallery docs/project docs/api/generated docs/api/backreferences
.venv-highest/bin/python -m sphinx -q -W --keep-going -b html docs docs/_build/html
