import os
import subprocess
import sys

import pytest

import skarxlag
from skarxlag.commands import main


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="file names of Windows are always text")
def test_a_name_that_is_no_text_ends_without_a_traceback(tmp_path):
    odd = os.fsencode(tmp_path) + b"/caf\xe9.skops"
    command = [sys.executable, "-m", "skarxlag", "diagnose", odd, "x.npy"]
    shown = subprocess.run(command, capture_output=True, text=True)
    assert shown.returncode == 1
    assert shown.stderr.strip().endswith("caf\\udce9.skops: no such file")


PRINTS_MUCH = [
    sys.executable,
    "-c",
    "import sys, skarxlag.commands, skarxlag.commands.diagnose as command\n"
    "command.run = lambda args: print('x' * 100_000) or 0\n"
    "sys.exit(skarxlag.commands.main(['diagnose', 'm', 'x']))\n",
]


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no signal for a pipe without a reader")
def test_a_reader_that_went_away_ends_without_a_traceback():
    reader, writer = os.pipe()
    os.close(reader)
    gone = subprocess.run(PRINTS_MUCH, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (gone.returncode, gone.stderr) == (141, "")


@pytest.mark.slow
@pytest.mark.skipif(
    not os.path.exists("/dev/full"), reason="this system has no device that is always full"
)
def test_a_full_disk_ends_without_a_traceback():
    with open("/dev/full", "w") as full:
        found = subprocess.run(PRINTS_MUCH, stdout=full, stderr=subprocess.PIPE, text=True)
    assert found.returncode == 1
    assert found.stderr.strip() == "skarxlag diagnose: error: [Errno 28] No space left on device"


def test_control_c_ends_without_a_traceback(monkeypatch, capsys):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr("skarxlag.commands.diagnose.run", interrupted)
    assert main(["diagnose", "m", "x"]) == 130
    assert capsys.readouterr().err.strip() == "skarxlag diagnose: interrupted"
