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

environment lowest-direct test &
environment highest test,docs
wait $!

# The parts run next to each other, so that no processor idles. The tests run the examples, so the
# site is built without their output.
rm -rf docs/_build docs/gallery docs/project docs/api/generated docs/api/backreferences
.venv-highest/bin/python -m sphinx -q -W --keep-going -D plot_gallery=0 -b html docs docs/_build/html &
site=$! oldest=
trap 'kill $site $oldest 2>/dev/null || true' EXIT
sh checks.sh .venv-highest/bin

# What rests on other libraries: scikit-learn's contract of one estimator of each class, compiled
# code, files, and the main job. These tests are fewer, so half of the processes suffice: each has to
# collect the tests and to compile the loops.
report=.venv-lowest-direct/report.txt
half=$(.venv-highest/bin/python -c 'import os; print(min(4, max(1, os.cpu_count() // 2)))')
(tests lowest-direct -n "$half" -m "not variant" tests/kernels tests/recordings/formats tests/test_common.py \
    tests/test_main.py tests/test_persistence.py tests/commands/test_evaluate.py "$@") >$report &
oldest=$! failed=0
(tests highest "$@") || failed=1
wait $oldest || failed=1
echo "With the oldest versions:"
cat $report
wait $site
exit $failed
