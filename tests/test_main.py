import os
import subprocess
import sys

import pytest

import skarxlag
from skarxlag.commands import main


def test_module_runs_as_a_program(tmp_path):
    command = [sys.executable, "-m", "skarxlag"]
    shown = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert shown.stdout.strip() == f"skarxlag {skarxlag.__version__}"
    missing = tmp_path / "gone.skops"
    failed = subprocess.run(
        [*command, "diagnose", missing, "x.npy"], capture_output=True, text=True
    )
    assert failed.returncode == 1 and not failed.stdout
    assert failed.stderr.strip() == f"skarxlag diagnose: error: {missing}: no such file"


@pytest.mark.parametrize("command", ["evaluate", "fit", "diagnose", "watch"])
def test_help(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"skarxlag {command}" in capsys.readouterr().out


@pytest.mark.parametrize("argv", [[], ["guess"]])
def test_commands_are_named_if_none_is_given(argv, capsys):
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2
    assert "COMMAND" in capsys.readouterr().err


def test_a_reader_that_went_away_a_full_disk_and_odd_names_end_without_a_traceback(tmp_path):
    command = [sys.executable, "-m", "skarxlag", "diagnose"]
    odd = os.fsencode(tmp_path) + b"/caf\xe9.skops"
    shown = subprocess.run([*command, odd, "x.npy"], capture_output=True, text=True)
    assert shown.returncode == 1
    assert shown.stderr.strip().endswith("caf\\udce9.skops: no such file")
    code = (
        "import sys, skarxlag.commands, skarxlag.commands.diagnose as command\n"
        "command.run = lambda args: print('x' * 100_000) or 0\n"
        "sys.exit(skarxlag.commands.main(['diagnose', 'm', 'x']))\n"
    )
    reader = subprocess.Popen(["true"], stdin=subprocess.PIPE)
    reader.wait()
    gone = subprocess.run([sys.executable, "-c", code], stdout=reader.stdin, stderr=-1, text=True)
    reader.stdin.close()
    assert (gone.returncode, gone.stderr) == (141, "")
    with open("/dev/full", "w") as full:
        full = subprocess.run([sys.executable, "-c", code], stdout=full, stderr=-1, text=True)
    assert full.returncode == 1
    assert full.stderr.strip() == "skarxlag diagnose: error: [Errno 28] No space left on device"


def test_control_c_ends_without_a_traceback(monkeypatch, capsys):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr("skarxlag.commands.diagnose.run", interrupted)
    assert main(["diagnose", "m", "x"]) == 130
    assert capsys.readouterr().err.strip() == "skarxlag diagnose: interrupted"
