"""Links between the API reference and what names its parts: Markdown pages, and notebooks.

Names in code style on the Markdown pages are linked to their place in the API
reference. Estimators in notebooks link to their pages; that these are built is checked.
"""

import re
from pathlib import Path

from docutils import nodes
from sphinx.util.logging import getLogger
from sphinx.util.nodes import make_refnode

import skarxlag
from skarxlag.core.base import SITE, DocumentedEstimator

_PREFIXES = ("", "skarxlag.", "skarxlag.datasets.", "skarxlag.plotting.")


def _documented(objects, text):
    """Full name of what a code text such as ``ARXLaguerre.fit(X)`` names, or None."""
    name = re.match(r"[\w.]*", text)[0].rstrip(".")
    # An attribute is described with its class.
    for candidate in (name, name.rpartition(".")[0]):
        for prefix in _PREFIXES:
            if candidate and prefix + candidate in objects:
                return prefix + candidate
    return None


def _link_names(app, doctree, docname):
    if Path(app.env.doc2path(docname)).suffix != ".md":
        return
    objects = app.env.domains["py"].objects
    for literal in list(doctree.findall(nodes.literal)):
        full_name = _documented(objects, literal.astext())
        if full_name is None or isinstance(
            literal.parent, nodes.reference | nodes.title
        ):
            continue
        place = objects[full_name]
        literal.replace_self(
            make_refnode(
                app.builder,
                docname,
                place.docname,
                place.node_id,
                literal.deepcopy(),
                full_name,
            )
        )


def _check_pages_of_estimators(app, env):
    """Warn where the HTML representation of an estimator would link to a page that is not built."""
    for name in skarxlag.__all__:
        public = getattr(skarxlag, name)
        if isinstance(public, type) and issubclass(public, DocumentedEstimator):
            link = public._doc_link_template.format(estimator_name=public.__name__)
            if link.removeprefix(SITE).removesuffix(".html") not in env.found_docs:
                getLogger(__name__).warning(
                    "%s links to %s, which is no page", name, link
                )


def setup(app):
    """Link and check when every page is read."""
    app.connect("doctree-resolved", _link_names)
    app.connect("env-check-consistency", _check_pages_of_estimators)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
