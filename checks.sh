#!/bin/sh
# Checks that run nothing: style, types, and the files that the repository's host reads. Needs the
# extra "test" in the environment whose bin folder is $1, or in the current one.
set -eu
cd "$(dirname "$0")"
bin=${1:+$1/}
"${bin}ruff" check .
"${bin}ruff" format --check .
"${bin}mypy"
"${bin}check-jsonschema" --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
"${bin}check-jsonschema" --quiet --builtin-schema vendor.dependabot .github/dependabot.yml
