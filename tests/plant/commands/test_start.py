"""Commands refuse wrong arguments without the libraries that they compute with."""

import json
import subprocess
import sys

#: Prints the statuses of command lines, and the libraries that take most of the time of
#: a short command, as far as they were imported.
PROGRAM = """
import json
import sys
from skarxlag.plant.commands import main

results = []
for arguments in json.loads(sys.argv[1]):
    try:
        status = main(arguments)
    except SystemExit as stop:
        status = stop.code
    heavy = ("numba", "pandas", "scipy", "sklearn", "skops")
    imported = [name for name in heavy if name in sys.modules]
    results.append([" ".join(arguments), status, imported])
print(json.dumps(results))
"""
REFUSED = {
    "diagnose m.skops x.npy --nope": 2,
    "diagnose": 2,
    "diagnose m.skops": 2,
    "diagnose gone.skops x.npy": 1,
    "diagnose m.skops x.npy -o x.doc": 2,
    "info gone.skops": 1,
    "watch gone.skops -": 1,
    "fit t.csv -o a.skops --n-jobs 0": 2,
    "fit t.csv -o nowhere/a.skops": 2,
    "fit bad.csv -o a.skops": 1,
    "fit gone.csv -o a.skops": 1,
}


def test_refusals_import_no_numerics(tmp_path):
    (tmp_path / "m.skops").touch()
    (tmp_path / "t.csv").write_text("path,condition\nx.npy,good\n")
    (tmp_path / "bad.csv").write_text("path,condition\nx.npy,\n")
    lines = json.dumps([line.split() for line in REFUSED])
    command = [sys.executable, "-c", PROGRAM, lines]
    options = {"cwd": tmp_path, "capture_output": True, "check": True}
    done = subprocess.run(command, **options)
    expected = [[line, status, []] for line, status in REFUSED.items()]
    assert json.loads(done.stdout) == expected, done.stderr.decode()
