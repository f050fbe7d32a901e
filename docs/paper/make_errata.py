"""Write errata.md from the data in errata.json: ``python docs/paper/make_errata.py``."""

import json
from collections import Counter
from pathlib import Path

HERE = Path(__file__).parent
INTRODUCTION = """\
# Errata of the paper

<!-- Written by make_errata.py from errata.json; edit that file. -->

What is wrong, missing or contradictory in {source}
([doi](https://doi.org/{doi})).

Every entry was checked before it was listed. Tests in `tests/paper/` recompute the figures from the
paper's own rows and run the equations as printed; each entry names its tests. Where an entry is by
reading alone, it says so.

We read the paper as text, in which subscripts, superscripts and rows of an equation may be damaged.
Where such damage could explain an entry, the entry says so: look at the printed page before you
cite it. What the package computes in each place is on the page [Equations](equations.md).
"""


def plain_table(header, rows, numeric=()):
    """Markdown table; columns whose index is in `numeric` are aligned to the right."""
    marks = ["---:" if place in numeric else "---" for place in range(len(header))]
    return "\n".join(f"| {' | '.join(map(str, row))} |" for row in [header, marks, *rows]) + "\n"


def heading(entry):
    """Heading of an entry's section, which its links lead to."""
    return f"{entry['id']} {entry['title']}"


def tests(entry):
    """The tests of an entry as code."""
    return ", ".join(f"`{name.rpartition('::')[2]}`" for name in entry["tests"])


def section(entry):
    """One entry that is not an average."""
    checked = entry["check"] + (f" by {tests(entry)}" if entry["tests"] else "")
    lines = [
        f"### {heading(entry)}\n",
        f"{entry['where']}: **{entry['severity']}**.\n",
        f"- Printed: {entry['printed']}",
        f"- Problem: {entry['problem']}",
        f"- Instead: {entry['corrected']}",
    ]
    if "doubt" in entry:
        lines.append(f"- Doubt: {entry['doubt']}")
    lines.append(f"- Check: {checked}.\n")
    if "cells" in entry:
        header = ["rpm", "mm", "method", "condition", "Tables 2-5", "Tables 8-9"]
        rows = [list(cell.values()) for cell in entry["cells"]]
        lines.append(plain_table(header, rows, numeric=(0, 1, 4, 5)))
    return "\n".join(lines)


def averages(entries):
    """All wrong averages as one table."""
    rows = [[e["id"], e["where"], e["printed"], e["corrected"]] for e in entries]
    remarks = [f"{e['id']}: {e['problem']} {e['doubt']}" for e in entries if "doubt" in e]
    names = dict.fromkeys(name for entry in entries for name in entry["tests"])
    return "\n".join(
        [
            f"### {entries[0]['id']} to {entries[-1]['id']} Averages of Tables 2 to 5\n",
            f"{len(entries)} of the 16 printed averages are not the mean of their eight rows "
            "(in percent).\n",
            plain_table(["", "where", "printed", "from the rows"], rows, numeric=(2, 3)),
            *[f"{remark}\n" for remark in remarks],
            f"- Check: recomputed by {tests({'tests': names})}.\n",
        ]
    )


def page(data):
    """The whole page as Markdown."""
    entries = data["entries"]
    counts = Counter(entry["severity"] for entry in entries)
    severities = [[name, what, counts[name]] for name, what in data["severities"].items()]
    checked = Counter(entry["check"] for entry in entries)
    checks = [[name, what, checked[name]] for name, what in data["checks"].items()]
    blocks = [
        INTRODUCTION.format(source=data["source"], doi=data["doi"]),
        plain_table(["severity", "what it means", "entries"], severities, numeric=(2,)),
        plain_table(["check", "how", "entries"], checks, numeric=(2,)),
    ]
    for part, title in data["parts"].items():
        blocks.append(f"## {title}\n")
        own = [entry for entry in entries if entry["part"] == part]
        wrong_averages = [entry for entry in own if entry["kind"] == "average"]
        if wrong_averages:
            blocks.append(averages(wrong_averages))
        blocks += [section(entry) for entry in own if entry["kind"] != "average"]
    return "\n".join(blocks)


def main():
    """Read errata.json and write errata.md, both beside this file."""
    data = json.loads((HERE / "errata.json").read_text("utf-8"))
    (HERE / "errata.md").write_text(page(data), "utf-8")


if __name__ == "__main__":
    main()
