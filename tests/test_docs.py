"""README, docs and examples run as they stand, and are found."""

import doctest
import importlib
import inspect
import json
import os
import pkgutil
import re
import runpy
import tomllib
from pathlib import Path

import numpy as np
import pytest

import skarxlag
from skarxlag import datasets, kernels, plotting
from skarxlag.datasets import simulate_rig
from skarxlag.datasets.rig import Rig
from skarxlag.models.observer_base import EVALUATIONS
from tests.public_rigs import write_real_rigs

ROOT = Path(__file__).parents[1]
# Written by a build of the site.
BUILT = {"_build", "gallery", "project"}
DOCS = [
    page
    for page in sorted((ROOT / "docs").rglob("*.md"))
    if BUILT.isdisjoint(page.relative_to(ROOT / "docs").parts)
]
PAGES = [ROOT / "README.md", *DOCS]
LINKED = [*sorted(ROOT.glob("*.md")), ROOT / "benchmarks" / "README.md", *DOCS]
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def _name(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_blocks_of_page(page):
    text = page.read_text(encoding="utf-8")
    parsed = doctest.DocTestParser().get_doctest(text, {}, page.name, str(page), 0)
    assert bool(parsed.examples) == ("```pycon" in text)
    report = []
    doctest.DocTestRunner(optionflags=OPTIONS).run(parsed, out=report.append)
    assert not report, "".join(report)


def _links(page):
    """Files within the repository that a page links to, each with the anchor or None."""
    # Formulas and the site's own list of pages hold brackets that are no links.
    prose = re.sub(
        r"\$+[^$]*\$+|^```\{.*?^```", "", page.read_text("utf-8"), flags=re.S | re.M
    )
    links = re.findall(r"\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]*))?\)", prose)
    return [
        ((page.parent / path).resolve() if path else page, anchor)
        for path, anchor in links
    ]


def _is_built(path):
    return (ROOT / "docs" / "gallery") in path.parents


def _anchors(page):
    headings = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), flags=re.M)
    return [re.sub(r"[^\w -]", "", each).lower().replace(" ", "-") for each in headings]


@pytest.mark.parametrize("page", LINKED, ids=_name)
def test_links_within_the_repository(page):
    links = [link for link in _links(page) if not _is_built(link[0])]
    assert not [path for path, _ in links if not path.exists()]
    to_headings = [link for link in links if link[1] and link[0].suffix == ".md"]
    assert not [link for link in to_headings if link[1] not in _anchors(link[0])]


def test_readme_reaches_everything_in_two_clicks():
    first = {path for path, _ in _links(ROOT / "README.md")}
    pages = [path for path in first if path.suffix == ".md"]
    second = first.union(*({path for path, _ in _links(page)} for page in pages))
    expected = {*LINKED, ROOT / "examples"} - {ROOT / "README.md"}
    assert not expected - second


def test_api_page_lists_every_public_name():
    pages = [ROOT / "docs" / "api" / f"{name}.rst" for name in ("index", "kernels")]
    text = "".join(page.read_text("utf-8") for page in pages)
    listed, module = set(), None
    for line in text.splitlines():
        if line.startswith(".. currentmodule:: "):
            module = line.split()[-1]
        elif name := re.fullmatch(r"(?:   |\.\. py:data:: )([\w.]+)", line):
            listed.add(f"{module}.{name[1]}")
    public = {
        f"{kernels.__name__}.{each.name}"
        for each in pkgutil.iter_modules(kernels.__path__)
    }
    for name in ("skarxlag", "skarxlag.datasets", "skarxlag.plotting"):
        public |= {f"{name}.{each}" for each in importlib.import_module(name).__all__}
    # The type of a result: users read it, but do not create it.
    assert listed == public | {"skarxlag.monitoring.MonitorVerdict"}


@pytest.mark.parametrize(
    ("source", "page", "link", "on_site"),
    [
        ("docs/a.md", "a.md", "../SECURITY.md#x", "project/security.md#x"),
        ("docs/a.md", "a.md", "https://doi.org/10.1", "https://doi.org/10.1"),
        ("docs/b/a.md", "b/a.md", "../../examples", "../gallery/index.rst"),
        ("docs/a.md", "a.md", "../examples/b/plot_c.py", "gallery/b/plot_c.rst"),
        ("CONTRIBUTING.md", "project/contributing.md", "docs/data.md", "../data.md"),
    ],
)
def test_links_on_the_site(source, page, link, on_site):
    relink = runpy.run_path(str(ROOT / "docs" / "repository.py"))["relink"]
    assert relink(f"[text]({link})", source, page) == f"[text]({on_site})"


@pytest.fixture(scope="module")
def real_rigs(tmp_path_factory):
    """Data sets that hold the recordings beside the checkout."""
    if not os.environ.get("SKARXLAG_DATA"):
        pytest.skip("needs the recordings of the real rigs")
    root = tmp_path_factory.mktemp("rigs")
    write_real_rigs(root)
    return root


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=_name)
def test_example(example, monkeypatch, capsys, request):
    if "load_public_rig" in example.read_text("utf-8"):
        root = request.getfixturevalue("real_rigs")
        monkeypatch.setenv("BEARING_DATASETS_ROOT", str(root))
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.setattr(pyplot, "show", lambda: None)
    runpy.run_path(str(example), run_name="__main__")
    has_figure = bool(pyplot.get_fignums())
    pyplot.close("all")
    assert has_figure and capsys.readouterr().out


@pytest.mark.parametrize("name", ["getting_started", "real_recordings"])
def test_notebook_runs(name, monkeypatch, request):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    monkeypatch.setattr(pyplot, "show", lambda: None)
    if name == "real_recordings":
        root = request.getfixturevalue("real_rigs")
        monkeypatch.setenv("BEARING_DATASETS_ROOT", str(root))
    notebook = json.loads((ROOT / "examples" / f"{name}.ipynb").read_text("utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    names = {}
    for cell in cells:
        exec("".join(cell["source"]), names)
    assert pyplot.get_fignums()
    pyplot.close("all")
    assert not any(cell["outputs"] for cell in cells)
    if name == "real_recordings":
        # One stretch of a second may show no comb above the limit, but no wrong one.
        named, target = names["locations"], names["rig"].target
        is_named = named != "healthy"
        assert np.mean(is_named) > 0.95
        assert named[is_named].tolist() == target[is_named].tolist()
    else:
        assert len(names["verdicts"]) == len(names["conditions"])


def test_every_extra_is_in_the_table_of_the_installation():
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    text = (ROOT / "docs" / "install.md").read_text("utf-8")
    rows = re.findall(r"^\| `(\w+)` \|", text, flags=re.M)
    assert sorted(rows) == sorted(stated["project"]["optional-dependencies"])


def test_every_residual_evaluation_is_in_the_table():
    text = (ROOT / "docs" / "paper" / "observers.md").read_text("utf-8")
    rows = re.findall(r"^\| `\"(\w+)\"` \|", text, flags=re.M)
    assert rows == EVALUATIONS


def test_every_parameter_of_the_simulated_rig_is_in_its_table():
    text = (ROOT / "docs" / "simulated_rig.md").read_text("utf-8")
    rows = re.findall(r"^\| `(\w+)` \| ([^|]*) \|", text, flags=re.M)
    parameters = dict(inspect.signature(simulate_rig).parameters)
    assert parameters.pop("rig").default == Rig()
    parameters |= inspect.signature(Rig).parameters
    assert [name for name, _ in rows] == list(parameters)
    for name, shown in rows:
        default = np.ravel(parameters[name].default)
        if default.dtype.kind in "fi":
            values = re.sub(r"(?<=\d),(?=\d)", "", shown).split(",")
            assert [float(each) for each in values] == default.tolist(), name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_name_of_a_module_in_a_page_exists(page):
    modules = {each.name for each in pkgutil.iter_modules(skarxlag.__path__)}
    for name in re.findall(
        r"`(?:skarxlag\.)?([a-z_]+(?:\.\w+)+)`", page.read_text("utf-8")
    ):
        if name.partition(".")[0] in modules:
            pkgutil.resolve_name(f"skarxlag.{name}")


#: Functions of the benchmarks and of modules, which pages name without their module.
NOT_PUBLIC = {"make_single_observer_pio", "load_distribution"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_public_function_and_method_in_a_page_exists(page):
    public = {
        name: getattr(module, name)
        for module in (skarxlag, datasets, plotting)
        for name in module.__all__
    }
    text = page.read_text("utf-8")
    verbs = "make|fetch|load|save|simulate|read|iter|list"
    functions = re.findall(rf"`((?:{verbs})_\w+)(?:\([^`]*\))?`", text)
    assert set(functions) <= public.keys() | NOT_PUBLIC
    methods = re.findall(r"`([A-Z]\w+)\.(\w*[a-z])(?:\([^`]*\))?`", text)
    assert not [
        f"{name}.{method}"
        for name, method in methods
        if name in public and not hasattr(public[name], method)
    ]
