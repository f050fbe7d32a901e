#!/bin/sh
# Run the tests of the module that differs from the last commit, then those of its room.
# Cosmic Ray calls this for each mutant: see CONTRIBUTING.md.
set -eu
module=$(git diff --name-only -- skarxlag | head -n 1)
room=$(basename "$(dirname "$module")")
NUMBA_CACHE_DIR=$(mktemp -d) # the cache does not notice a change in a function that a cached one calls
export NUMBA_CACHE_DIR
trap 'rm -r "$NUMBA_CACHE_DIR"' EXIT
own=tests/$room/test_$(basename "$module")
[ ! -f "$own" ] || python -m pytest -qx -p no:cacheprovider "$own" "$module"
python -m pytest -qx -p no:cacheprovider "tests/$room" "skarxlag/$room"
