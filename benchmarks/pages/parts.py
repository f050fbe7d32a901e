"""List of the generated parts of README and docs: their commands, their outputs and their dates."""

import json
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from skarxlag import __version__

ROOT = Path(__file__).parents[2]
RECORD = ROOT / "docs" / "generated.json"


class Part(NamedTuple):
    """The output of one command.

    Parameters
    ----------
    command : str
        Arguments of Python; several commands are joined by " && ".
    blocks : dict of str to tuple of str
        Names of the marked blocks that it writes, by page.
    images : tuple of str, default=()
        Patterns of the images that it writes.
    tables : tuple of str, default=()
        Blocks whose tables are stored in a csv file.
    downloads : bool
        Whether it takes ``--data-home``, the folder of the real rigs.
    """

    command: str
    blocks: dict
    images: tuple = ()
    tables: tuple = ()
    downloads: bool = False

    def outputs(self):
        """Return every block, as "page: block", and the patterns of its images."""
        blocks = [f"{page}: {name}" for page, names in self.blocks.items() for name in names]
        return [*blocks, *self.images]


_STUDIES = ("noise", "window length", "order", "pole", "gains", "speed", "crack size", "compound")
_STUDIES += ("torque",)
_PAPER_RUNS = ("compared", "bank", "single residual", "long windows", "stretches")
_PAPER_TABLES = tuple(f"paper tables {run}" for run in _PAPER_RUNS)
PARTS = {
    "overview": Part(
        "-m benchmarks.pages.overview", {}, ("docs/_static/overview.png",), downloads=True
    ),
    "cross-speed": Part(
        "-m benchmarks.cross_speed "
        "--figure docs/images/cross_speed.svg --write README.md docs/cross_speed.md",
        {
            "README.md": ("cross-speed overview",),
            "docs/cross_speed.md": ("cross-speed tables",),
        },
        ("docs/images/cross_speed*.svg",),
        ("cross-speed tables",),
        downloads=True,
    ),
    "ablation": Part(
        "-m benchmarks.recipe ablation --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("ablation",)},
        tables=("ablation",),
        downloads=True,
    ),
    "constants": Part(
        "-m benchmarks.recipe constants --write docs/cross_speed.md && "
        "-m benchmarks.recipe constants --wide --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("constants", "constants wide")},
        tables=("constants", "constants wide"),
    ),
    "targets": Part(
        "-m benchmarks.recipe targets --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("targets",)},
    ),
    "recording-evidence": Part(
        "-m benchmarks.recipe recording-evidence --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("recording evidence",)},
    ),
    "detection": Part(
        "-m benchmarks.detection rates --write docs/detection.md",
        {"docs/detection.md": ("detection", "detection families", "detection cost")},
        tables=("detection families", "detection cost"),
        downloads=True,
    ),
    "detection-constants": Part(
        "-m benchmarks.detection constants --write docs/detection.md",
        {"docs/detection.md": ("detection constants",)},
        tables=("detection constants",),
    ),
    "detection-unknown": Part(
        "-m benchmarks.detection unknown --write docs/detection.md",
        {"docs/detection.md": ("unknown", "other kinds")},
        tables=("unknown", "other kinds"),
        downloads=True,
    ),
    "detection-runs": Part(
        "-m benchmarks.detection runs --figure docs/images/detection_runs.svg "
        "--write docs/detection.md",
        {"docs/detection.md": ("runs",)},
        ("docs/images/detection_runs.svg",),
        tables=("runs",),
        downloads=True,
    ),
    "runs-to-failure": Part(
        "-m benchmarks.monitoring --figure docs/images/runs_to_failure.svg "
        "--write docs/monitoring.md",
        {"docs/monitoring.md": ("runs to failure",)},
        ("docs/images/runs_to_failure.svg",),
        downloads=True,
    ),
    "soak": Part(
        "-m benchmarks.monitoring.soak --write docs/monitoring.md",
        {"docs/monitoring.md": ("soak",)},
    ),
    "sensors": Part(
        "-m benchmarks.monitoring.sensors --write docs/plant.md",
        {"docs/plant.md": ("sensors in one process",)},
    ),
    "quality": Part(
        "-m benchmarks.quality --write docs/signal_quality.md",
        {"docs/signal_quality.md": ("signal quality",)},
        downloads=True,
    ),
    "bearings": Part(
        "-m benchmarks.pages.bearings --write docs/bearings.md",
        {"docs/bearings.md": ("bearings",)},
    ),
    "formats": Part(
        "-m benchmarks.pages.formats --write docs/recordings.md",
        {"docs/recordings.md": ("file formats",)},
    ),
    "recordings-figure": Part(
        "-m benchmarks.pages.recordings_figure", {}, ("docs/images/recordings.svg",)
    ),
    "report-image": Part(
        "-m benchmarks.pages.report_image",
        {},
        ("docs/images/report.png",),
        downloads=True,
    ),
    "diagram-image": Part("-m benchmarks.pages.diagram_image", {}, ("docs/images/diagram.png",)),
    "stretches": Part(
        "-m benchmarks.stretches --write docs/stretches.md",
        {"docs/stretches.md": ("stretches overview", "stretches training")},
        tables=("stretches training",),
        downloads=True,
    ),
    "stretches-simulated": Part(
        "-m benchmarks.stretches --rig simulated --seconds 1 2 --seed 21 22 23 24 "
        "--method 'make_diagnoser, nominal rpm' 'no rpm' "
        "'make_diagnoser, windows of 4800 vote' --output skarxlag-results/stretches-simulated "
        "--write docs/stretches.md",
        {"docs/stretches.md": ("stretches simulated",)},
    ),
    "fault-orders": Part(
        "-m benchmarks.fault_orders --method 'openconmo, envelope' 'openconmo, prewhitening' "
        "'openconmo, kurtogram' predictive-maintenance-mcp pyBearing "
        "&& -m benchmarks.fault_orders --settings --write docs/fault_orders.md",
        {
            "docs/fault_orders.md": tuple(
                f"fault orders {name}"
                for name in ("named", "stretches", "reference", "methods", "settings")
            )
        },
        tables=("fault orders stretches", "fault orders settings"),
        downloads=True,
    ),
    "fault-orders-joint": Part(
        "-m benchmarks.fault_orders joint --write docs/fault_orders.md",
        {"docs/fault_orders.md": ("fault orders joint", "fault orders joint settings")},
        tables=("fault orders joint settings",),
        downloads=True,
    ),
    "fault-orders-runs": Part(
        "-m benchmarks.fault_orders runs --write docs/fault_orders.md",
        {"docs/fault_orders.md": ("fault orders runs",)},
        downloads=True,
    ),
    "speed": Part(
        "-m benchmarks.speed --write benchmarks/README.md",
        {"benchmarks/README.md": ("speed",)},
    ),
    "fleet": Part(
        "-m benchmarks.speed.fleet --write docs/fleet.md",
        {"docs/fleet.md": ("fleet",)},
    ),
    "fleet-scale": Part(
        "-m benchmarks.speed.fleet_scale --write docs/fleet.md",
        {"docs/fleet.md": ("fleet-scale",)},
    ),
    "fleet-figure": Part(
        "-m benchmarks.pages.fleet_figure",
        {},
        ("docs/images/fleet.svg",),
    ),
    "paper-tables": Part(
        "-m benchmarks.paper tables --write docs/paper/tables.md",
        {"docs/paper/tables.md": _PAPER_TABLES},
        ("docs/paper/images/tables_averages.svg",),
        _PAPER_TABLES,
    ),
    "sensitivity": Part(
        "-m benchmarks.paper sensitivity --write docs/paper/sensitivity.md",
        {
            "docs/paper/sensitivity.md": tuple(
                f"sensitivity {name}" for name in ("protocol", *_STUDIES)
            )
        },
        ("docs/paper/images/sensitivity_*.svg",),
        tuple(f"sensitivity {name}" for name in _STUDIES if name != "torque"),
    ),
    "fault-estimation": Part(
        "-m benchmarks.paper fault-estimation --write docs/paper/fault_estimation.md",
        {
            "docs/paper/fault_estimation.md": tuple(
                f"fault estimation {name}"
                for name in ("observers", "synthetic", "bearing", "gains")
            )
        },
        ("docs/paper/images/fault_estimation_*.svg",),
        tuple(f"fault estimation {name}" for name in ("synthetic", "bearing", "gains")),
    ),
    "paper-figures": Part(
        "-m benchmarks.pages.paper_figures",
        {},
        tuple(f"docs/paper/images/{stem}" for stem in ("figure_*", "ladder.png", "bank.png")),
    ),
}


def recorded():
    """Return version and date of each output."""
    return json.loads(RECORD.read_text("utf-8")) if RECORD.exists() else {}


def record(outputs):
    """Record that these outputs have just been written with the present version."""
    known, outputs = recorded(), set(outputs)
    for part in PARTS.values():
        for output in outputs.intersection(part.outputs()):
            known[output] = {"version": __version__, "date": f"{datetime.now(UTC):%Y-%m-%d %H:%M}"}
    if known:
        RECORD.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", "utf-8")


def states():
    """Return the oldest version and date of the outputs of each part, the oldest part first.

    Returns
    -------
    dict of str to (str, str)
        Version and date, both empty for a part with an output that was never written.
    """
    known = recorded()
    never = {"version": "", "date": ""}
    found = {
        name: min(
            (state["date"], state["version"])
            for state in (known.get(output, never) for output in part.outputs())
        )[::-1]
        for name, part in PARTS.items()
    }
    return dict(sorted(found.items(), key=lambda each: each[1][::-1]))


def outdated():
    """Return the parts that were not written with the present version of the package."""
    return [name for name, (version, _) in states().items() if version != __version__]
