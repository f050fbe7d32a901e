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
    assert failed.stderr.strip() == f"python -m skarxlag diagnose: error: {missing}: no such file"


@pytest.mark.parametrize("command", ["evaluate", "fit", "diagnose"])
def test_help(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"python -m skarxlag {command}" in capsys.readouterr().out


@pytest.mark.parametrize("argv", [[], ["guess"]])
def test_commands_are_named_if_none_is_given(argv, capsys):
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2
    assert "COMMAND" in capsys.readouterr().err
