"""Weight of the code in tokens, by wing: ``python -m tests.weight``.

Docstrings, comments and layout do not count. The exit status is 1 if a budget is exceeded.
"""

import io
import sys
import tokenize
from pathlib import Path

import pandas as pd

ROOT = Path(__file__).parents[1]
_LAYOUT = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}
#: Most tokens of each wing.
BUDGETS = {"library": 80_000, "plant": 42_000, "benchmarks": 50_000}
#: Tokens that the wings which are above their budgets must not exceed on the way there.
LIMITS = {"library": 86_992, "plant": 49_644, "benchmarks": 50_000, "tests": 211_063}
#: Most tokens of the tests for each token of library and plant.
TESTS_TO_CODE = 1.3
#: Most tokens of a line on average: code is not packed to count fewer lines.
TOKENS_OF_LINE = 9.0


def weigh(source: str) -> tuple[int, int]:
    """Count the tokens of a source text, and the lines that they stand on.

    Parameters
    ----------
    source : str
        Text of a module.

    Returns
    -------
    tokens, lines : int
        Without docstrings, comments and layout.

    Examples
    --------
    >>> weigh('def f(x):\\n    "Docstring."\\n    return x + 1  # comment')
    (10, 2)
    """
    tokens = list(tokenize.generate_tokens(io.StringIO(source).readline))
    neighbours = zip([None, *tokens], tokens, [*tokens[1:], None], strict=False)
    places = [
        token.start[0]
        for before, token, after in neighbours
        if token.type not in _LAYOUT
        # A docstring is a statement of its own.
        and not (
            token.type == tokenize.STRING
            and (before is None or before.type in _LAYOUT)
            and after.type == tokenize.NEWLINE
        )
    ]
    return len(places), len(set(places))


def weights() -> pd.DataFrame:
    """Return the tokens and lines of each module, with its wing and room."""
    rows = []
    for folder in ("skarxlag", "tests", "benchmarks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            parts = path.relative_to(ROOT).parts
            wing = "library" if folder == "skarxlag" else folder
            if parts[1] == "plant" and folder == "skarxlag":
                wing = "plant"
            depth = 3 if wing == "plant" else 2
            room = "/".join(parts[:depth]) if len(parts) > depth else folder
            tokens, lines = weigh(path.read_text())
            rows.append((wing, room, "/".join(parts), tokens, lines))
    return pd.DataFrame(rows, columns=["wing", "room", "module", "tokens", "lines"])


def exceeded(modules: pd.DataFrame) -> list[str]:
    """Return a sentence on each budget that is exceeded.

    Parameters
    ----------
    modules : DataFrame
        As `weights` returns it.

    Returns
    -------
    list of str
        Empty if all budgets hold.
    """
    sums = modules.groupby("wing")[["tokens", "lines"]].sum()
    of_package = sums.loc[["library", "plant"], "tokens"].sum()
    budgets = BUDGETS | {"tests": int(TESTS_TO_CODE * of_package)}
    sentences = [
        f"{wing}: {sums.loc[wing, 'tokens']} tokens, expected at most {budget}"
        for wing, budget in budgets.items()
        if sums.loc[wing, "tokens"] > budget
    ]
    density = sums["tokens"] / sums["lines"]
    sentences += [
        f"{wing}: {value:.2f} tokens a line, expected at most {TOKENS_OF_LINE:g}"
        for wing, value in density.items()
        if value > TOKENS_OF_LINE
    ]
    return sentences


def main() -> int:
    """Print the weights of rooms and wings, and return the exit status."""
    modules = weights()
    for keys in (["wing", "room"], ["wing"]):
        sums = modules.groupby(keys)[["tokens", "lines"]].sum()
        print(sums.to_string(), end="\n\n")
    sentences = exceeded(modules)
    print(*(sentences or ["All budgets hold."]), sep="\n")
    return 1 if sentences else 0


if __name__ == "__main__":
    sys.exit(main())
