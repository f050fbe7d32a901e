"""Print of ``skarxlag diagnose`` on recordings of the UESTC rig, for README and docs/results.md.

``python -m benchmarks.pages.terminal_example --write FILE ...`` fits a model at 800 rpm
and diagnoses two recordings that were made at 1400 rpm.
"""

import argparse
import io
import shutil
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path

from benchmarks.pages.blocks import write_blocks
from benchmarks.recordings import fetch_uestc
from skarxlag.plant.commands import main as run

BLOCK = "terminal example"
TRAIN_RPM = 800
RPM = 1400
CONDITIONS = {"N": "healthy", "I": "inner race", "O": "outer race", "B": "ball"}
#: Names of the diagnosed files, as a plant may call them.
DIAGNOSED = {"N": "pump_7.mat", "O": "pump_8.mat"}


def printed(data_home=None):
    """Return what the command prints.

    Parameters
    ----------
    data_home : str or None, default=None
        Folder of the downloaded rigs.
    """
    rig = fetch_uestc(data_home=data_home)
    rate = f"{rig.sampling_rate:g}"
    files = {
        Path(path).stem.removesuffix("_1"): Path(path).resolve()
        for path in rig.filenames
    }
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        lines = ["path,condition,rpm,sampling_rate"]
        for letter, condition in CONDITIONS.items():
            lines.append(
                f"{files[f'{letter}_{TRAIN_RPM}']},{condition},{TRAIN_RPM},{rate}"
            )
        Path("table.csv").write_text("\n".join(lines), encoding="utf-8")
        Path("rec").mkdir()
        for letter, name in DIAGNOSED.items():
            shutil.copy(files[f"{letter}_{RPM}"], Path("rec") / name)
        text = io.StringIO()
        with redirect_stdout(text):
            fit = [
                "fit",
                "table.csv",
                "--healthy",
                "healthy",
                "-o",
                "bearing.skops",
                "-q",
            ]
            assert run(fit) == 0
            recordings = [f"rec/{name}" for name in DIAGNOSED.values()]
            options = ["--sampling-rate", rate, "--rpm", str(RPM)]
            start = text.tell()
            assert run(["diagnose", "bearing.skops", *recordings, *options, "-q"]) == 0
    return text.getvalue()[start:]


def block(text):
    r"""Return the text as a block of Markdown, below the command line that prints it.

    Examples
    --------
    >>> print(block("a  b\n"))
        $ skarxlag diagnose bearing.skops rec/*.mat --rpm 1400
        a  b
    """
    command = f"$ skarxlag diagnose bearing.skops rec/*.mat --rpm {RPM}"
    return "\n".join(f"    {line}".rstrip() for line in [command, *text.splitlines()])


def main(arguments=None):
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data-home", help="folder of the downloaded rigs")
    parser.add_argument("--write", type=Path, nargs="*", default=[], metavar="FILE")
    options = parser.parse_args(arguments)
    text = block(printed(options.data_home))
    for page in options.write:
        write_blocks(page, {BLOCK: text})
    print(text)


if __name__ == "__main__":
    main()
