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
# Every public type is known. This checker asks the first Python of the path where packages are.
(
    PATH="${bin:+${bin}:}$PATH"
    cd tests
    basedpyright typed_use.py
    # What scikit-learn, numpy and pandas leave open is not counted.
    types=$(basedpyright --verifytypes skarxlag --ignoreexternal) ||
        { echo "$types" | sed '1,/^Symbols used/d' && exit 1; }
)
"${bin}check-jsonschema" --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
"${bin}check-jsonschema" --quiet --builtin-schema vendor.dependabot .github/dependabot.yml
