"""The documentation site: ``python -m sphinx -W --keep-going -b html docs docs/_build/html``.

Nothing is fetched, neither by the build nor by a browser that shows the pages.
"""

import os
import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

import ziamath

from skarxlag.core.base import SITE

sys.path.insert(0, str(Path(__file__).parent))
os.environ.setdefault("OMP_NUM_THREADS", "1")

REPOSITORY = "https://github.com/skarxlag/skarxlag"

project = "skarxlag"
author = "the developers of skarxlag"
copyright = author
release = version = installed_version("skarxlag")

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "myst_parser",
    "sphinx_gallery.gen_gallery",
    "api_links",
    "kept_outputs",
    "mathml",
    "repository",
]
exclude_patterns = ["_build", "**/sg_execution_times.rst", "sg_execution_times.rst"]
templates_path = ["_templates"]
highlight_language = "none"
default_role = "py:obj"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4

add_module_names = False
toc_object_entries_show_parents = "hide"
autosummary_generate = True
autodoc_member_order = "bysource"
autodoc_typehints = "none"
numpydoc_show_class_members = False

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    # Examples with other names need a download. Their last output is kept and shown.
    "filename_pattern": r"plot_\w+\.py$",
    "subsection_order": [
        f"../examples/{folder}"
        for folder in ("diagnosis", "detection", "recordings", "method", "paper")
    ],
    "within_subsection_order": "FileNameSortKey",
    "doc_module": "skarxlag",
    "reference_url": {"skarxlag": None},
    "backreferences_dir": "api/backreferences",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "min_reported_time": 1e6,
    "remove_config_comments": True,
}

html_baseurl = SITE
html_theme = "pydata_sphinx_theme"
html_title = "skarxlag"
html_math_renderer = "mathml"
# ziamath is taken for its font alone: formulas look the same in every browser.
html_static_path = ["_static", str(Path(ziamath.__file__).with_name("fonts"))]
html_favicon = "_static/logo.svg"
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_use_index = False
html_domain_indices = False
html_context = {"default_mode": "auto"}
# The left column lists the pages beside a page, where there are any.
html_sidebars = {
    page: []
    for page in (
        "index",
        "install",
        "getting_started",
        "method",
        "cross_speed",
        "data",
        "simulated_rig",
        "project/*",
    )
}
html_theme_options = {
    "logo": {
        "text": "skarxlag",
        "image_light": "_static/logo.svg",
        "image_dark": "_static/logo.svg",
    },
    "icon_links": [
        {"name": "Repository", "url": REPOSITORY, "icon": "fa-brands fa-github"},
    ],
    "navbar_end": ["theme-switcher", "navbar-icon-links"],
    "show_prev_next": False,
    "header_links_before_dropdown": 6,
    "footer_start": [],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "pygments_light_style": "a11y-high-contrast-light",
    "pygments_dark_style": "a11y-high-contrast-dark",
}


def _skip_scikit_learn(app, what, name, obj, skip, options):
    """Leave out what scikit-learn generates or documents itself."""
    module = getattr(getattr(obj, "fget", obj), "__module__", None)
    of_scikit_learn = (module or "").startswith("sklearn.")
    return True if of_scikit_learn or re.fullmatch(r"set_\w+_request", name) else None


def setup(app):
    """Connect the events."""
    app.connect("autodoc-skip-member", _skip_scikit_learn)
