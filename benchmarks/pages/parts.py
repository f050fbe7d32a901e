"""List of the generated parts of README and docs: their commands, outputs and dependencies."""

from typing import NamedTuple


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
    data : tuple of str
        Patterns of files in the repository that its numbers depend on: checksums of
        recordings, and tables of other parts.
    canaries : tuple of str
        Functions of `benchmarks.pages.cells` that show whether its numbers changed.
    of_machine : bool
        Whether its numbers are times and memory. Their digest names the code that was
        measured, and their canaries only show that the code still runs.
    """

    command: str
    blocks: dict
    images: tuple = ()
    tables: tuple = ()
    downloads: bool = False
    data: tuple = ()
    canaries: tuple = ()
    of_machine: bool = False

    def outputs(self):
        """Return every block, as "page: block", and the patterns of its images."""
        blocks = [
            f"{page}: {name}" for page, names in self.blocks.items() for name in names
        ]
        return [*blocks, *self.images]


_CHECKSUMS = ("skarxlag/datasets/checksums/*.sha256", "benchmarks/recipe/rigs.sha256")
#: Page that the report fills. No import statement names it.
REPORT = "skarxlag/plant/pages/report.html.j2"
_WINDOWS = ("windows", "spectraquest")
_PAPER_RUNS = ("compared", "as typed")
_PAPER_TABLES = tuple(f"paper tables {run}" for run in _PAPER_RUNS)
PARTS = {
    "terminal-example": Part(
        "-m benchmarks.pages.terminal_example --write README.md docs/results.md",
        {"README.md": ("terminal example",), "docs/results.md": ("terminal example",)},
        downloads=True,
        data=_CHECKSUMS,
        canaries=("stretches", "probabilities", "detector"),
    ),
    "overview": Part(
        "-m benchmarks.pages.overview",
        {},
        ("docs/_static/overview.png",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=_WINDOWS,
    ),
    "cross-speed": Part(
        "-m benchmarks.cross_speed "
        "--figure docs/images/cross_speed.svg --write README.md docs/cross_speed.md",
        {
            "README.md": ("cross-speed overview",),
            "docs/cross_speed.md": ("cross-speed tables", "cross-speed differences"),
        },
        ("docs/images/cross_speed*.svg",),
        ("cross-speed overview", "cross-speed tables", "cross-speed differences"),
        downloads=True,
        data=(
            *_CHECKSUMS,
            "docs/tables/constants.csv",
            "benchmarks/cross_speed/stored/*.csv",
        ),
        canaries=(*_WINDOWS, "proposal", "baseline", "cross_speed"),
    ),
    "ablation": Part(
        "-m benchmarks.recipe ablation --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("ablation overview", "ablation")},
        tables=("ablation overview", "ablation"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=(*_WINDOWS, "proposal", "baseline"),
    ),
    "constants": Part(
        "-m benchmarks.recipe constants --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("constants",)},
        tables=("constants",),
        data=_CHECKSUMS,
        canaries=(*_WINDOWS, "stretches", "constants"),
    ),
    "constants-wide": Part(
        "-m benchmarks.recipe constants --wide --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("constants wide",)},
        tables=("constants wide",),
        data=_CHECKSUMS,
        canaries=(*_WINDOWS, "stretches", "constants"),
    ),
    "targets": Part(
        "-m benchmarks.recipe targets --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("targets",)},
        tables=("targets",),
        data=_CHECKSUMS,
        canaries=(*_WINDOWS, "stretches"),
    ),
    "another-bearing": Part(
        "-m benchmarks.another_bearing verdicts --write docs/another_bearing.md && "
        "-m benchmarks.another_bearing verdicts --write README.md",
        {
            "docs/another_bearing.md": ("another bearing", "another bearing measures"),
            "README.md": ("another bearing overview",),
        },
        tables=(
            "another bearing",
            "another bearing measures",
            "another bearing overview",
        ),
        data=_CHECKSUMS,
        canaries=("probabilities", "stretches", "another_bearing"),
    ),
    "another-bearing-noise": Part(
        "-m benchmarks.another_bearing noise --write docs/another_bearing.md",
        {"docs/another_bearing.md": ("another bearing noise",)},
        tables=("another bearing noise",),
        data=_CHECKSUMS,
        canaries=("probabilities", "stretches"),
    ),
    "another-bearing-curve": Part(
        "-m benchmarks.another_bearing curve --write docs/another_bearing.md",
        {"docs/another_bearing.md": ("another bearing curve",)},
        tables=("another bearing curve",),
        data=_CHECKSUMS,
        canaries=("probabilities", "stretches", "another_bearing"),
    ),
    "another-bearing-constants": Part(
        "-m benchmarks.another_bearing constants --write docs/another_bearing.md",
        {"docs/another_bearing.md": ("another bearing constants",)},
        tables=("another bearing constants",),
        data=_CHECKSUMS,
        canaries=("probabilities", "stretches"),
    ),
    "recording-evidence": Part(
        "-m benchmarks.recipe recording-evidence --write docs/cross_speed.md",
        {"docs/cross_speed.md": ("recording evidence",)},
        tables=("recording evidence",),
        data=_CHECKSUMS,
        canaries=(*_WINDOWS, "stretches"),
    ),
    "detection": Part(
        "-m benchmarks.detection rates --write docs/detection.md",
        {"docs/detection.md": ("detection", "detection families", "detection cost")},
        tables=("detection", "detection families", "detection cost"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("detector",),
    ),
    "detection-constants": Part(
        "-m benchmarks.detection constants --write docs/detection.md",
        {"docs/detection.md": ("detection constants",)},
        tables=("detection constants",),
        data=_CHECKSUMS,
        canaries=("detector",),
    ),
    "detection-unknown": Part(
        "-m benchmarks.detection unknown --write docs/detection.md",
        {"docs/detection.md": ("unknown", "other kinds")},
        tables=("unknown", "other kinds"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("detector",),
    ),
    "detection-runs": Part(
        "-m benchmarks.detection runs --figure docs/images/detection_runs.svg "
        "--write docs/detection.md",
        {"docs/detection.md": ("runs",)},
        ("docs/images/detection_runs.svg",),
        tables=("runs",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("detector",),
    ),
    "runs-to-failure": Part(
        "-m benchmarks.monitoring --figure docs/images/runs_to_failure.svg "
        "--write docs/monitoring.md",
        {"docs/monitoring.md": ("runs to failure", "few healthy snapshots")},
        ("docs/images/runs_to_failure.svg",),
        ("runs to failure", "few healthy snapshots"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("detector",),
    ),
    "soak": Part(
        "-m benchmarks.monitoring.soak --write docs/monitoring.md",
        {"docs/monitoring.md": ("soak",)},
        tables=("soak",),
        canaries=("soak",),
        of_machine=True,
    ),
    "sensors": Part(
        "-m benchmarks.monitoring.sensors --write docs/plant.md",
        {"docs/plant.md": ("sensors in one process",)},
        canaries=("soak",),
        of_machine=True,
    ),
    "quality": Part(
        "-m benchmarks.quality --write docs/signal_quality.md",
        {"docs/signal_quality.md": ("signal quality",)},
        tables=("signal quality",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("quality",),
    ),
    "bearings": Part(
        "-m benchmarks.pages.bearings --write docs/bearings.md",
        {"docs/bearings.md": ("bearings",)},
        tables=("bearings",),
        data=("skarxlag/bearings/catalogue.csv",),
        canaries=("bearings",),
    ),
    "formats": Part(
        "-m benchmarks.pages.formats --write docs/recordings.md",
        {"docs/recordings.md": ("file formats",)},
        canaries=("formats",),
    ),
    "recordings-figure": Part(
        "-m benchmarks.pages.recordings_figure",
        {},
        ("docs/images/recordings.svg",),
        canaries=("kept_windows",),
    ),
    "pipeline-figure": Part(
        "-m benchmarks.pages.pipeline_figure",
        {},
        ("docs/images/pipeline.svg",),
        canaries=("pipeline",),
    ),
    "cutting-figure": Part(
        "-m benchmarks.pages.cutting_figure",
        {},
        ("docs/images/cutting.svg",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("kept_windows",),
    ),
    "comb-figure": Part(
        "-m benchmarks.pages.comb_figure",
        {},
        ("docs/images/comb.svg",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("fault_orders",),
    ),
    "speed-figure": Part(
        "-m benchmarks.pages.speed_figure",
        {},
        ("docs/images/distances.svg",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=_WINDOWS,
    ),
    "gallery": Part(
        "-m benchmarks.pages.gallery",
        {},
        ("docs/images/gallery/*",),
        downloads=True,
        data=(*_CHECKSUMS, "examples/*/real_*.py", "skarxlag/**/*.py"),
        canaries=(*_WINDOWS, "stretches", "detector", "fault_orders"),
    ),
    "dot-plots": Part(
        "-m benchmarks.pages.dot_plots",
        {},
        ("docs/images/dots_*.svg",),
        data=("docs/tables/*.csv",),
        canaries=("dots",),
    ),
    "report-image": Part(
        "-m benchmarks.pages.report_image",
        {},
        ("docs/images/report.png",),
        downloads=True,
        data=(*_CHECKSUMS, REPORT),
        canaries=(*_WINDOWS, "report"),
    ),
    "diagram-image": Part(
        "-m benchmarks.pages.diagram_image",
        {},
        ("docs/images/diagram.png",),
        canaries=("diagram",),
    ),
    "stretches": Part(
        "-m benchmarks.stretches --write docs/stretches.md",
        {"docs/stretches.md": ("stretches overview", "stretches training")},
        tables=("stretches overview", "stretches training"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("stretches",),
    ),
    "stretches-simulated": Part(
        "-m benchmarks.stretches --rig simulated --seconds 1 2 --seed 21 22 23 24 "
        "--method 'make_diagnoser, nominal rpm' 'no rpm' "
        "'make_diagnoser, windows of 4800 vote' --output skarxlag-results/stretches-simulated "
        "--write docs/stretches.md",
        {"docs/stretches.md": ("stretches simulated",)},
        tables=("stretches simulated",),
        canaries=("stretches",),
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
        tables=(
            "fault orders named",
            "fault orders stretches",
            "fault orders methods",
            "fault orders settings",
        ),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("fault_orders",),
    ),
    "fault-orders-joint": Part(
        "-m benchmarks.fault_orders joint --write docs/fault_orders.md",
        {"docs/fault_orders.md": ("fault orders joint", "fault orders joint settings")},
        tables=("fault orders joint", "fault orders joint settings"),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("fault_orders", "stretches"),
    ),
    "fault-orders-runs": Part(
        "-m benchmarks.fault_orders runs --write docs/fault_orders.md",
        {"docs/fault_orders.md": ("fault orders runs",)},
        tables=("fault orders runs",),
        downloads=True,
        data=_CHECKSUMS,
        canaries=("fault_orders", "gathered_combs"),
    ),
    "speed": Part(
        "-m benchmarks.speed --write benchmarks/README.md",
        {"benchmarks/README.md": ("speed",)},
        tables=("speed",),
        canaries=("speed",),
        of_machine=True,
    ),
    "fleet": Part(
        "-m benchmarks.speed.fleet --write docs/fleet.md",
        {"docs/fleet.md": ("fleet",)},
        canaries=("speed",),
        of_machine=True,
    ),
    "fleet-scale": Part(
        "-m benchmarks.speed.fleet_scale --write docs/fleet.md",
        {"docs/fleet.md": ("fleet-scale",)},
        tables=("fleet-scale",),
        canaries=("speed",),
        of_machine=True,
    ),
    "fleet-figure": Part(
        "-m benchmarks.pages.fleet_figure",
        {},
        ("docs/images/fleet.svg",),
        canaries=("speed",),
        of_machine=True,
    ),
    "paper-tables": Part(
        "-m benchmarks.paper tables --write docs/paper/tables.md",
        {"docs/paper/tables.md": _PAPER_TABLES},
        ("docs/paper/images/tables_averages.svg",),
        canaries=(
            "windows",
            "proposal",
            "baseline",
        ),
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
        canaries=("proposal", "baseline"),
    ),
    "paper-figures": Part(
        "-m benchmarks.pages.paper_figures",
        {},
        tuple(
            f"docs/paper/images/{stem}"
            for stem in ("figure_*", "ladder.png", "bank.png")
        ),
        canaries=("windows", "proposal", "baseline"),
    ),
}
