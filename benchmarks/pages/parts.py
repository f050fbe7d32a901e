"""List of the generated parts of README and docs, with their commands and dependencies."""

import ast
import hashlib
import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
RECORD = ROOT / "docs" / "generated.json"
#: Sources that every figure depends on.
CORE = (
    "skarxlag/*.py",
    "skarxlag/kernels/*.py",
    "skarxlag/residual_evaluations/*.py",
)


class Part(NamedTuple):
    """The output of one command.

    Parameters
    ----------
    command : str
        Arguments of Python; several commands are joined by " && ".
    reads : tuple of str
        Patterns of the sources that it depends on beside `CORE`.
    blocks : dict of str to tuple of str
        Names of the marked blocks that it writes, by page.
    images : tuple of str, default=()
        Patterns of the images that it writes.
    downloads : bool
        Whether it takes ``--data-home``, the folder of the real rigs.
    """

    command: str
    reads: tuple
    blocks: dict
    images: tuple = ()
    downloads: bool = False

    def outputs(self):
        """Every block, as "page: block", and the patterns of its images."""
        blocks = [f"{page}: {name}" for page, names in self.blocks.items() for name in names]
        return [*blocks, *self.images]


_CROSS_SPEED = ("skarxlag/datasets/*.py", "benchmarks/cross_speed/*.py")
_SIMULATED = ("skarxlag/datasets/*.py",)
_STUDIES = ("noise", "window length", "order", "pole", "gains", "speed", "crack size", "compound")
_STUDIES += ("torque",)
_EFFECTS = ("valleys", "drift", "best poles", "poles", "amplitude", "evidence", "correlation")
_EFFECTS += ("adaptation",)
PARTS = {
    "overview": Part(
        "-m benchmarks.pages.overview",
        ("skarxlag/datasets/*.py", "skarxlag/plotting/*.py", "benchmarks/pages/overview.py"),
        {},
        ("docs/_static/overview.png",),
        downloads=True,
    ),
    "cross-speed": Part(
        "-m benchmarks.cross_speed --rig hit_sm uestc --method MultiRocketHydra "
        "--window-length 1200 && -m benchmarks.cross_speed "
        "--figure docs/images/cross_speed.svg --write README.md docs/cross_speed.md",
        _CROSS_SPEED,
        {
            "README.md": ("cross-speed overview",),
            "docs/cross_speed.md": ("cross-speed tables",),
        },
        ("docs/images/cross_speed*.svg",),
        downloads=True,
    ),
    "ablation": Part(
        "-m benchmarks.recipe ablation --write docs/cross_speed.md",
        (*_CROSS_SPEED, "benchmarks/recipe/ablation.py"),
        {"docs/cross_speed.md": ("ablation",)},
        downloads=True,
    ),
    "confidence": Part(
        "-m benchmarks.recipe confidence --write docs/cross_speed.md",
        (*_CROSS_SPEED, "benchmarks/recipe/confidence.py"),
        {"docs/cross_speed.md": ("confidence",)},
        downloads=True,
    ),
    "detection": Part(
        "-m benchmarks.detection rates --write docs/detection.md",
        (*_CROSS_SPEED, "benchmarks/detection/*.py"),
        {"docs/detection.md": ("detection", "detection families", "detection cost")},
        downloads=True,
    ),
    "detection-unknown": Part(
        "-m benchmarks.detection unknown --write docs/detection.md",
        (*_CROSS_SPEED, "benchmarks/detection/*.py"),
        {"docs/detection.md": ("unknown", "other kinds")},
        downloads=True,
    ),
    "detection-runs": Part(
        "-m benchmarks.detection runs --figure docs/images/detection_runs.svg "
        "--write docs/detection.md",
        ("benchmarks/detection/runs.py", "benchmarks/pages/svg_figures.py"),
        {"docs/detection.md": ("runs",)},
        ("docs/images/detection_runs.svg",),
        downloads=True,
    ),
    "speed-effects": Part(
        "-m benchmarks.recipe speed-effects --write docs/cross_speed.md",
        (*_CROSS_SPEED, "benchmarks/recipe/s*.py", "benchmarks/recipe/evidence_over_time.py"),
        {"docs/cross_speed.md": _EFFECTS},
        downloads=True,
    ),
    "runs-to-failure": Part(
        "-m benchmarks.monitoring --figure docs/images/runs_to_failure.svg "
        "--write docs/monitoring.md",
        ("skarxlag/monitoring/*.py", "benchmarks/monitoring/*.py"),
        {"docs/monitoring.md": ("runs to failure",)},
        ("docs/images/runs_to_failure.svg",),
        downloads=True,
    ),
    "formats": Part(
        "-m benchmarks.pages.formats --write docs/recordings.md",
        ("skarxlag/recordings/formats/*.py", "benchmarks/pages/formats.py"),
        {"docs/recordings.md": ("file formats",)},
    ),
    "recordings-figure": Part(
        "-m benchmarks.pages.recordings_figure",
        (
            "skarxlag/recordings/r*.py",
            "skarxlag/recordings/windows.py",
            "benchmarks/pages/recordings_figure.py",
            "benchmarks/pages/svg_figures.py",
        ),
        {},
        ("docs/images/recordings.svg",),
    ),
    "report-image": Part(
        "-m benchmarks.pages.report_image",
        (
            "skarxlag/commands/*.py",
            "benchmarks/pages/report_image.py",
            "benchmarks/pages/browser.py",
        ),
        {},
        ("docs/images/report.png",),
        downloads=True,
    ),
    "diagram-image": Part(
        "-m benchmarks.pages.diagram_image",
        ("benchmarks/pages/diagram_image.py", "benchmarks/pages/browser.py"),
        {},
        ("docs/images/diagram.png",),
    ),
    "battery": Part(
        "-m benchmarks.recipe battery --write docs/cross_speed.md",
        (*_CROSS_SPEED, "benchmarks/recipe/battery*.py"),
        {"docs/cross_speed.md": ("battery",)},
        downloads=True,
    ),
    "constants": Part(
        "-m benchmarks.recipe sensitivity --write docs/cross_speed.md",
        (*_CROSS_SPEED, "benchmarks/recipe/*.py"),
        {"docs/cross_speed.md": ("sensitivity",)},
        downloads=True,
    ),
    "stretches": Part(
        "-m benchmarks.stretches --rig hit_sm --seconds 0.5 1 --method "
        "'MultiRocketHydra, windows of 1200 vote' && -m benchmarks.stretches "
        "--write docs/stretches.md README.md",
        (*_CROSS_SPEED, "benchmarks/stretches/*.py"),
        {
            "README.md": ("stretches overview",),
            "docs/stretches.md": ("stretches overview", "stretches training"),
        },
        downloads=True,
    ),
    "stretches-simulated": Part(
        "-m benchmarks.stretches --rig simulated --seconds 1 2 --seed 21 22 23 24 "
        "--method 'make_stretch_diagnoser, nominal rpm' 'no rpm' "
        "'make_diagnoser, windows of 4800 vote' --output skarxlag-results/stretches-simulated "
        "--write docs/stretches.md",
        (*_SIMULATED, "benchmarks/stretches/*.py"),
        {"docs/stretches.md": ("stretches simulated",)},
    ),
    "stretch-constants": Part(
        "-m benchmarks.recipe stretches --write docs/stretches.md",
        ("benchmarks/recipe/stretches.py", "benchmarks/recipe/random_rigs.py"),
        {"docs/stretches.md": ("stretch constants",)},
    ),
    "speed": Part(
        "-m benchmarks.speed --write benchmarks/README.md",
        ("benchmarks/speed/*.py",),
        {"benchmarks/README.md": ("speed",)},
    ),
    "fleet": Part(
        "-m benchmarks.speed.fleet --write docs/fleet.md",
        ("skarxlag/commands/r*.py", "benchmarks/speed/fleet.py", "benchmarks/speed/timing.py"),
        {"docs/fleet.md": ("fleet",)},
    ),
    "fleet-figure": Part(
        "-m benchmarks.pages.fleet_figure",
        (
            "skarxlag/commands/r*.py",
            "skarxlag/commands/cluster.py",
            "benchmarks/pages/fleet_figure.py",
            "benchmarks/pages/svg_figures.py",
        ),
        {},
        ("docs/images/fleet.svg",),
    ),
    "paper-tables": Part(
        "-m benchmarks.paper tables --write docs/paper/tables.md",
        (*_SIMULATED, "skarxlag/paper/*", "benchmarks/paper/tables*.py"),
        {
            "docs/paper/tables.md": tuple(
                f"paper tables {run}"
                for run in ("compared", "bank", "single residual", "long windows", "stretches")
            )
        },
        ("docs/paper/images/tables_averages.svg",),
    ),
    "sensitivity": Part(
        "-m benchmarks.paper sensitivity --write docs/paper/sensitivity.md",
        (*_SIMULATED, "benchmarks/paper/sensitivity/*.py"),
        {
            "docs/paper/sensitivity.md": tuple(
                f"sensitivity {name}" for name in ("protocol", *_STUDIES)
            )
        },
        ("docs/paper/images/sensitivity_*.svg",),
    ),
    "fault-estimation": Part(
        "-m benchmarks.paper fault-estimation --write docs/paper/fault_estimation.md",
        (*_SIMULATED, "benchmarks/paper/fault_estimation/*.py"),
        {
            "docs/paper/fault_estimation.md": tuple(
                f"fault estimation {name}"
                for name in ("observers", "synthetic", "bearing", "gains")
            )
        },
        ("docs/paper/images/fault_estimation_*.svg",),
    ),
    "paper-figures": Part(
        "-m benchmarks.pages.paper_figures",
        (
            *_SIMULATED,
            "skarxlag/plotting/*.py",
            "skarxlag/commands/paper_figures.py",
            "benchmarks/pages/paper_figures.py",
            "benchmarks/pages/diagrams.py",
        ),
        {},
        tuple(f"docs/paper/images/{stem}" for stem in ("figure_*", "ladder.png", "bank.png")),
    ),
}


@cache
def _code(path):
    """Return a Python source without what computes nothing; other files as bytes.

    Comments, docstrings, layout and types are left out.
    """
    if path.suffix != ".py":
        return path.read_bytes()
    tree = ast.parse(path.read_text("utf-8"))
    for node in ast.walk(tree):
        if getattr(node, "annotation", None):
            node.annotation = None if isinstance(node, ast.arg) else ast.Name("type")
        if getattr(node, "returns", None):
            node.returns = None
        body = getattr(node, "body", None)
        first = getattr(body[0], "value", None) if isinstance(body, list) and body else None
        if isinstance(first, ast.Constant) and isinstance(body[0], ast.Expr):
            first.value = ""
    return ast.unparse(tree).encode()


def fingerprint(part, root=ROOT):
    """SHA-256 of the code that a part depends on; comments, docstrings and types do not count."""
    digest = hashlib.sha256()
    for pattern in (*CORE, *part.reads):
        for path in sorted(root.glob(pattern)):
            if path.is_file():
                digest.update(path.relative_to(root).as_posix().encode() + _code(path))
    return digest.hexdigest()[:16]


def recorded():
    """Return the recorded state of the code that each output was generated from."""
    return json.loads(RECORD.read_text("utf-8")) if RECORD.exists() else {}


def record(outputs):
    """Record that these outputs have just been written."""
    known, outputs = recorded(), set(outputs)
    for part in PARTS.values():
        for output in outputs.intersection(part.outputs()):
            known[output] = fingerprint(part)
    if known:
        RECORD.write_text(json.dumps(known, indent=1, sort_keys=True) + "\n", "utf-8")


def stale():
    """Return the outputs of each part that are out of date or were never recorded.

    Returns
    -------
    dict of str to list of str
        Parts that are up to date are left out.
    """
    known = recorded()
    found = {}
    for name, part in PARTS.items():
        now = fingerprint(part)
        outdated = [output for output in part.outputs() if known.get(output) != now]
        if outdated:
            found[name] = outdated
    return found
