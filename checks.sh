#!/bin/sh
# Checks that run nothing: style, types, and the files that the repository's host reads. Needs the
# extra "test" in the environment whose bin folder is $1, or in the current one.
set -eu
cd "$(dirname "$0")"
bin=${1:+$(cd "$1" && pwd)/}
"${bin}ruff" check .
"${bin}ruff" format --check .
# Types, as scripts that use the package see them: a script with right and wrong calls, and every
# public type is known. The checker asks the first Python of the path where packages are, and runs
# in another folder, so that it finds the package as it is installed.
(
    PATH="${bin:+${bin}:}$PATH"
    cd tests
    basedpyright typed_use.py
    # What scikit-learn, numpy and pandas leave open is not counted, nor are the commands
    # and the core, which nobody imports.
    { basedpyright --verifytypes skarxlag --ignoreexternal --outputjson || true; } | python -c '
import json, sys

symbols = json.load(sys.stdin)["typeCompleteness"]["symbols"]
unknown = [
    symbol["name"]
    for symbol in symbols
    if symbol["isExported"] and (not symbol["isTypeKnown"] or symbol["isTypeAmbiguous"])
    and not symbol["name"].startswith(("skarxlag.plant.commands.", "skarxlag.plant.watch.", "skarxlag.plant.pages.", "skarxlag.core."))
]
if unknown or len(symbols) < 100:
    sys.exit("\n".join(["these types are not known:", *unknown]))
'
)
"${bin}check-jsonschema" --quiet --builtin-schema vendor.github-workflows .github/workflows/*.yml
"${bin}check-jsonschema" --quiet --builtin-schema vendor.dependabot .github/dependabot.yml
