#!/bin/sh
# Every check that a change must pass: style and types, all tests with the newest versions of the
# dependencies, the tests that depend on versions with the oldest that pyproject.toml allows, and
# the site without a warning. Needs Python 3.11 or later and nothing else. Arguments go to pytest.
set -eu
cd "$(dirname "$0")"
export OMP_NUM_THREADS=1 # the tests run in as many processes as there are processors
unset PYTHONDONTWRITEBYTECODE # or each process would compile all the libraries that it imports

environment() {
    if [ ! -x ".venv-$1/bin/uv" ]; then
        "${PYTHON:-python3}" -m venv ".venv-$1"
        ".venv-$1/bin/python" -m pip install --quiet uv
    fi
    ".venv-$1/bin/uv" pip install --quiet --python ".venv-$1/bin/python" --upgrade \
        --resolution "$1" --editable ".[$2]"
}

# Numba's cache does not notice a change in a function that a cached one calls, nor does it keep
# the code of two versions of itself: each environment and each state of the kernels has its own.
tests() {
    environment=$1 && shift
    cache="$PWD/.venv-$environment/numba-$(cat skarxlag/kernels/*.py | cksum | tr ' ' -)"
    exec env NUMBA_CACHE_DIR="$cache" \
        ".venv-$environment/bin/python" -m pytest -n logical --maxprocesses 8 --dist loadfile "$@"
}

# What rests on other libraries, with their oldest versions: scikit-learn's contract, compiled code,
# files, and the main job. These tests are fewer, so half of the processes suffice: each has to
# collect the tests and to compile the loops. If that is one process, it needs none that leads it.
# They begin while the other environment is installed, and all parts run next to each other, so
# that no processor idles.
mkdir -p .venv-lowest-direct
report=.venv-lowest-direct/report.txt
half=$((($(getconf _NPROCESSORS_ONLN) + 1) / 2))
[ $half -gt 1 ] || half=0
(
    environment lowest-direct test
    tests lowest-direct -n "$half" -m "not any_version" tests/kernels/test_compiled.py tests/plant/readers/formats \
        tests/test_common.py tests/persistence/test_models.py tests/plant/commands/test_evaluate.py "$@"
) >$report 2>&1 &
oldest=$! site= failed=0
trap 'kill $oldest $site 2>/dev/null || true' EXIT

# The tests run the examples, so the site is built without their output.
environment highest test,docs
rm -rf docs/_build docs/gallery docs/project docs/api/generated docs/api/backreferences
.venv-highest/bin/python -m sphinx -q -W --keep-going -D plot_gallery=0 -b html docs docs/_build/html &
site=$!
sh checks.sh .venv-highest/bin
(tests highest "$@") || failed=1
wait $oldest || failed=1
echo "With the oldest versions:"
cat $report
wait $site
exit $failed
