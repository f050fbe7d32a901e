"""Wrong arguments: one line, and the help of the argument."""

import numpy as np
import pytest

from tests.plant.watch.watching import RATE, WINDOW, sound


@pytest.mark.parametrize(
    ("arguments", "message", "of_help"),
    [
        ("fit t.csv -o m.skops --train-rpm x", "argument --train-rpm: 'x'", "97"),
        ("fit t.csv", "required: -o/--output", "-o FILE.skops"),
        ("fit -o m", "required: table", "csv table of the"),
        ("diagnose", "argument MODEL.skops: none", "MODEL.skops  or --bearing"),
        ("diagnose -q -v", "argument -v/--verbose: not allowed", "-v, --verbose"),
        ("watch m.skops --poll 0", "argument --poll: '0', expected", "--poll SECONDS"),
        ("info --jason", "required: FILE", "FILE "),
        ("info f --jason", "unrecognized arguments: --jason", "--help lists all"),
        ("fits", "COMMAND: invalid choice: 'fits'", "diagnose a running sensor"),
        ("", "required: COMMAND", "diagnose a running sensor"),
    ],
)
def test_usage_errors_are_one_line_with_the_help_of_the_argument(
    run, arguments, message, of_help
):
    code, out, err = run(*arguments.split())
    first, *rest = err.splitlines()
    assert code == 2 and out == "" and ": error: " in first and message in first
    assert of_help in "\n".join(rest) and "usage:" not in err
    assert "--healthy" not in err


def test_a_rate_beside_a_table(run, tmp_path):
    """The option fills the lines that do not state the rate."""
    lines = ["path,condition,sampling_rate"]
    for name in ("good", "worn"):
        np.save(tmp_path / f"{name}.npy", sound(name, 40 * WINDOW, 1))
        lines.append(f"{name}.npy,{name},")
    table, model = tmp_path / "table.csv", tmp_path / "m.skops"
    table.write_text("\n".join(lines))
    options = ("--diagnoser", "diagnoser", "--window-length", WINDOW, "-o", model)
    code, _, err = run("fit", table, *options)
    assert code == 1 and "sampling_rate is missing" in err
    code, out, _ = run("fit", table, *options, "--sampling-rate", RATE)
    assert code == 0 and f"at {RATE:g} Hz" in out
    code, out, err = run(
        "diagnose", model, "--table", table, "--sampling-rate", 2 * RATE
    )
    assert code == 1 and f"sampled at {2 * RATE:g} Hz" in err
    code, out, err = run("diagnose", model, "--table", table, "--sampling-rate", RATE)
    assert code == 0 and "2 of 2 verdicts on recordings of the training agree" in out
