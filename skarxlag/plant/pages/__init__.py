"""Pages to read in a browser: one file each, without scripts and without network."""

from datetime import UTC, datetime
from typing import Any

from ..._version import __version__


def render(name: str, **facts: Any) -> str:
    """Return a page.

    Parameters
    ----------
    name : str
        Its template in this folder, such as ``"report"``.
    **facts
        Names in the template. All texts are escaped.
    """
    from jinja2 import Environment, PackageLoader

    environment = Environment(
        loader=PackageLoader("skarxlag.plant.pages", ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    saved = f"{datetime.now(UTC):%Y-%m-%d}, skarxlag {__version__}"
    return environment.get_template(f"{name}.html.j2").render(facts, saved=saved)
