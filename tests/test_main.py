import os
import re
import subprocess
import sys

import pytest

import skarxlag
from skarxlag.plant.commands import _parser, main


@pytest.mark.slow
def test_module_runs_as_a_program(tmp_path):
    command = [sys.executable, "-m", "skarxlag"]
    # File names of Windows are always text.
    is_text = os.name == "nt"
    name, shown = ("x", "x") if is_text else (os.fsdecode(b"caf\xe9"), "caf\\udce9")
    command += ["diagnose", tmp_path / f"{name}.skops", "x.npy"]
    failed = subprocess.run(command, capture_output=True, text=True)
    assert failed.returncode == 1 and not failed.stdout
    message = f"skarxlag diagnose: error: {tmp_path / shown}.skops: no such file"
    assert failed.stderr.strip() == message


def test_version(capsys):
    with pytest.raises(SystemExit):
        main(["--version"])
    assert capsys.readouterr().out.strip() == f"skarxlag {skarxlag.__version__}"


@pytest.mark.parametrize("command", ["evaluate", "fit", "diagnose", "watch"])
def test_help(command, capsys):
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    assert f"skarxlag {command}" in capsys.readouterr().out


#: A command that prints much, without the libraries that the real one imports.
PRINTS_MUCH = [
    sys.executable,
    "-c",
    "import sys, types, skarxlag.plant.commands\n"
    "from skarxlag.plant.commands import checks, parsers\n"
    "checks.diagnose = parsers.diagnose = lambda args: None\n"
    "command = types.ModuleType('skarxlag.plant.commands.diagnose')\n"
    "command.run = lambda args: print('x' * 100_000) or 0\n"
    "sys.modules[command.__name__] = command\n"
    "sys.exit(skarxlag.plant.commands.main(['diagnose']))\n",
]


@pytest.mark.skipif(
    os.name == "nt", reason="Windows has no signal for a pipe without a reader"
)
def test_a_reader_that_went_away_ends_without_a_traceback():
    reader, writer = os.pipe()
    os.close(reader)
    gone = subprocess.run(PRINTS_MUCH, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert (gone.returncode, gone.stderr) == (141, "")


@pytest.mark.skipif(
    not os.path.exists("/dev/full"),
    reason="this system has no device that is always full",
)
def test_a_full_disk_ends_without_a_traceback():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            PRINTS_MUCH, stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1
    assert (
        done.stderr.strip()
        == "skarxlag diagnose: error: standard output: [Errno 28] No space left on device"
    )


def test_control_c_ends_without_a_traceback(monkeypatch, capsys, tmp_path):
    def interrupted(args):
        raise KeyboardInterrupt

    monkeypatch.setattr("skarxlag.plant.commands.diagnose.run", interrupted)
    model = tmp_path / "m.skops"
    model.touch()
    assert main(["diagnose", str(model), "x"]) == 130
    assert capsys.readouterr().err.strip() == "skarxlag diagnose: interrupted"


#: A module that sends Ctrl-C to its process as soon as one of the libraries is
#: imported.
INTERRUPTER = """
import os, signal, sys

# A parent may have let this process ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)

class Interrupter:
    def find_spec(self, name, path=None, target=None):
        if name == os.environ["INTERRUPT_AT"]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupter())
"""


@pytest.mark.slow
@pytest.mark.skipif(
    os.name == "nt", reason="Windows sends Ctrl-C to a whole group of processes"
)
@pytest.mark.parametrize(
    ("library", "command"),
    [
        ("numpy", ["fit", "x.csv", "-o", "new.skops"]),
        ("sklearn.pipeline", ["diagnose", "m.skops", "x.npy"]),
    ],
)
def test_control_c_during_imports_ends_with_one_line(tmp_path, library, command):
    (tmp_path / "sitecustomize.py").write_text(INTERRUPTER)
    # Nothing is wrong that is noticed before the imports.
    (tmp_path / "x.csv").write_text("path\nx.npy\n")
    (tmp_path / "m.skops").touch()
    paths = [str(tmp_path), os.path.dirname(os.path.dirname(skarxlag.__file__))]
    environment = os.environ | {
        "PYTHONPATH": os.pathsep.join(paths),
        "INTERRUPT_AT": library,
    }
    arguments = [sys.executable, "-m", "skarxlag", *command]
    streams = {"capture_output": True, "text": True}
    done = subprocess.run(arguments, cwd=tmp_path, env=environment, **streams)
    assert done.returncode == 130 and done.stdout == ""
    assert re.fullmatch(r"skarxlag( fit| diagnose)?: interrupted", done.stderr.strip())


def test_options_may_stand_between_other_arguments():
    argv = ["diagnose", "m.skops", "--channel", "0", "a.npy", "-q", "b.npy"]
    args = _parser(argv).parse_args(argv)
    assert (args.model.name, args.recordings) == ("m.skops", ["a.npy", "b.npy"])
    assert args.quiet and args.channel is not None


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        ([], "COMMAND"),
        (["guess"], "COMMAND"),
        (["diagnose", "m.skops", "--chanel"], "--chanel"),
    ],
)
def test_what_is_missing_or_unknown_is_named(argv, named, capsys):
    with pytest.raises(SystemExit) as stop:
        main(argv)
    assert stop.value.code == 2 and named in capsys.readouterr().err
