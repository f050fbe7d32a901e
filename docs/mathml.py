"""Formulas as MathML, made while the pages are built, so that they show without scripts."""

import math_core
from docutils import nodes
from sphinx.util import logging

_converter = math_core.LatexToMathML(fancy_error=False)
_logger = logging.getLogger(__name__)


def _mathml(translator, node, *, display):
    """MathML of a formula; a warning at its place for one that cannot be read."""
    latex = node.astext()
    if display and r"\\" in latex:
        # A directive's lines are aligned at their ampersands, as in Sphinx's other
        # renderers.
        latex = rf"\begin{{aligned}}{latex}\end{{aligned}}"
    try:
        formula = _converter.convert_with_local_state(latex, displaystyle=display)
    except math_core.LatexError as error:
        _logger.warning("%s in formula %s", error, latex, location=node)
        formula = translator.encode(latex)
    translator.body.append(f'<div class="math">{formula}</div>' if display else formula)
    raise nodes.SkipNode


def _visit_inline(translator, node):
    _mathml(translator, node, display=False)


def _visit_block(translator, node):
    _mathml(translator, node, display=True)


def setup(app):
    """Offer the renderer to `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (_visit_inline, None), (_visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
