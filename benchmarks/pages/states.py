"""State of each generated part: whether its numbers are those of the present code.

``docs/generated.json`` holds for each output the date, the version of the package, the
digest of what its numbers depend on, and its canaries.
"""

import json
import time
from datetime import UTC, datetime
from typing import NamedTuple

from benchmarks.pages.canaries import changed, part_canaries
from benchmarks.pages.digests import code_files, data_files, part_digest
from benchmarks.pages.modules import ROOT
from benchmarks.pages.parts import PARTS
from skarxlag import __version__

RECORD = ROOT / "docs" / "generated.json"
#: Names of the states. A part that is "moved" depends on changed code, but its canaries
#: held.
CURRENT = "current"
MOVED = "moved"
OUTDATED = "outdated"
NEVER = "never made"
_STARTED = time.time()


class State(NamedTuple):
    """State of a part: its name, one of the four above, the date, and what differs."""

    part: str
    name: str
    date: str
    differs: str = ""

    @property
    def is_valid(self):
        """Return whether the numbers are those of the present code, as far as canaries show it."""
        return self.name in (CURRENT, MOVED)


def recorded():
    """Return version, date, digest and canaries of each output."""
    return json.loads(RECORD.read_text("utf-8")) if RECORD.exists() else {}


def record(outputs):
    """Record that these outputs have just been written with the present code.

    If a file of the code was changed after this process began, the outputs get no
    digest: the process may have run the earlier code.
    """
    records = recorded()
    outputs = set(outputs)
    for part in PARTS.values():
        for output in outputs.intersection(part.outputs()):
            date = f"{datetime.now(UTC):%Y-%m-%d %H:%M}"
            records[output] = {
                "version": __version__,
                "date": date,
                **_fingerprint(part),
            }
    _write(records)


def restamp(part):
    """Record the present digest of a part whose canaries held."""
    records = recorded()
    for output in part.outputs():
        records[output] |= _fingerprint(part)
    _write(records)


def _fingerprint(part):
    files = [*code_files(part), *data_files(part)]
    if max(path.stat().st_mtime for path in files) > _STARTED:
        return {}
    return {"digest": part_digest(part), "canaries": part_canaries(part.canaries)}


def _write(records):
    if records:
        RECORD.write_text(json.dumps(records, indent=1, sort_keys=True) + "\n", "utf-8")


def state(name):
    """Return the state of a part, that of its oldest output."""
    part = PARTS[name]
    records = recorded()
    if not all(output in records for output in part.outputs()):
        return State(name, NEVER, "")
    outputs = [records[output] for output in part.outputs()]
    date = min(made["date"] for made in outputs)
    if not all("digest" in made for made in outputs):
        return State(name, OUTDATED, date, "no digest")
    digest = part_digest(part)
    moved = [made for made in outputs if made["digest"] != digest]
    if not moved:
        return State(name, CURRENT, date)
    if not all(made["canaries"] for made in moved):
        return State(name, OUTDATED, date, "no canary")
    now = part_canaries(part.canaries)
    differs = sorted(
        {name for made in moved for name in changed(made["canaries"], now)}
    )
    return State(name, OUTDATED if differs else MOVED, date, ", ".join(differs))


def states(names=()):
    """Return the states of these parts, or of all, the oldest first."""
    return sorted(
        (state(name) for name in names or PARTS), key=lambda state: state.date
    )


def outdated():
    """Return the parts that are to be made again."""
    return [state.part for state in states() if not state.is_valid]
