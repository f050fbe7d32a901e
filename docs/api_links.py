"""Names in code style on the Markdown pages, linked to their place in the API reference."""

import re
from pathlib import Path

from docutils import nodes
from sphinx.util.nodes import make_refnode

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
        if full_name is None or isinstance(literal.parent, nodes.reference | nodes.title):
            continue
        place = objects[full_name]
        literal.replace_self(
            make_refnode(
                app.builder, docname, place.docname, place.node_id, literal.deepcopy(), full_name
            )
        )


def setup(app):
    """Link when every page is read."""
    app.connect("doctree-resolved", _link_names)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
