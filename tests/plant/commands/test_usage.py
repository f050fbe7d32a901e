"""Wrong arguments: one line, and the help of the argument."""

import pytest


@pytest.mark.parametrize(
    ("arguments", "message", "of_help"),
    [
        ("fit t.csv -o m.skops --outputs x", "argument --outputs: 'x'", "are sensors"),
        ("fit t.csv", "required: -o/--output", "-o FILE.skops"),
        ("fit -o m", "required: table", "csv table of the"),
        ("diagnose", "argument MODEL.skops: none", "MODEL.skops  or --bearing"),
        ("watch m.skops --idle 0", "argument --idle: '0', expected", "--idle SECONDS"),
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
