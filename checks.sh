#!/bin/sh
# Checks that run nothing: style, types, and the files that the repository's host reads. Needs the
# extra "test" in the environment whose bin folder is $1, or in the current one.
set -eu
cd "$(dirname "$0")"
bin=${1:+$(cd "$1" && pwd)/}
"${bin}ruff" check .
"${bin}ruff" format --check .
"${bin}mypy"
# From another folder, so that the checker finds the package as it is installed.
(cd tests && "${bin}mypy" --config-file= --cache-dir=../.mypy_cache --follow-imports=silent \
    --ignore-missing-imports --warn-unused-ignores typed_use.py)
"${bin}check-jsonschema" --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
"${bin}check-jsonschema" --quiet --builtin-schema vendor.dependabot .github/dependabot.yml
