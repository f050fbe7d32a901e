"""Types in docstrings are those that type checkers see. `checks.sh` tests the types themselves."""

import importlib
import inspect
import pkgutil
import re
import tomllib
from pathlib import Path

import pytest

import skarxlag

ROOT = Path(__file__).parents[1]


def own_functions(owner, module):
    """Functions, methods and properties that a module or a class of it defines in public."""
    for name, member in vars(owner).items():
        member = getattr(member, "__func__", member)
        member = getattr(member, "__wrapped__", member)
        if name.startswith("_") and name != "__init__":
            continue
        if isinstance(member, property):
            yield member.fget
        elif inspect.isfunction(member) and member.__module__ == module:
            yield member
        elif (
            inspect.isclass(member)
            and member.__module__ == module
            and owner is not member
        ):
            yield from own_functions(member, module)


MODULES = [
    module.name
    for module in pkgutil.walk_packages(skarxlag.__path__, "skarxlag.")
    if not any(
        part.startswith("_") or part in ("commands", "pages", "watch")
        for part in module.name.split(".")
    )
]


PLAIN = re.compile(r"(int|float|str|bool|dict|list|DataFrame)\b")


def documented(owner):
    """Return what a docstring says of each parameter, and of a single result."""
    parts = re.split(r"\n\n(\w[\w ]*)\n---+\n", inspect.getdoc(owner) or "")
    sections = dict(zip(parts[1::2], parts[2::2], strict=True))
    for names, text in re.findall(
        r"^(\w+(?:, \w+)*) : (.+)$", sections.get("Parameters", ""), flags=re.M
    ):
        for name in names.split(", "):
            yield name, text
    results = re.findall(
        r"^(?:\w+ : )?(\w.*)$", sections.get("Returns", ""), flags=re.M
    )
    if len(results) == 1:
        yield "return", results[0]


@pytest.mark.parametrize("name", MODULES)
def test_annotations_are_what_docstrings_say(name):
    module = importlib.import_module(name)
    owners = list(own_functions(module, name))
    for each in vars(module).values():
        if (
            inspect.isclass(each)
            and each.__module__ == name
            and "__init__" in vars(each)
        ):
            owners.append(each)
    for owner in owners:
        signature = inspect.signature(owner)
        annotations = {
            key: each.annotation for key, each in signature.parameters.items()
        }
        annotations["return"] = signature.return_annotation
        for key, stated in documented(owner):
            plain = PLAIN.match(stated)
            # joblib has no types.
            if plain is None or key not in annotations or "joblib." in stated:
                continue
            given = annotations[key]
            text = given if isinstance(given, str) else inspect.formatannotation(given)
            # An array-like may be a list or a table.
            fits = plain[1] in text or "ArrayLike" in text
            assert fits, f"{owner.__qualname__}, {key}: {stated!r}, but {text}"


def test_types_reach_checkers_of_installations_in_place():
    # A plain path, which checkers follow; they do not run the import hook that is the
    # default.
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"][
        "setuptools"
    ]
    assert settings["package-dir"] == {"": "."}
    assert (ROOT / "skarxlag" / "py.typed").exists()


def test_help_shows_array_like_by_its_name():
    shown = str(inspect.signature(skarxlag.ThresholdLadder.fit))
    assert "ArrayLike | None" in shown
    assert "Buffer" not in shown
