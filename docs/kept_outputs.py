"""Kept outputs of examples that a build does not run, because they need recordings.

``python -m benchmarks.figures.gallery`` runs these examples and writes the outputs to
``images/gallery``. Here they are added to the pages of the gallery.
"""

from pathlib import Path, PurePosixPath

DOCS = Path(__file__).parent
KEPT = DOCS / "images" / "gallery"
#: Begin of the buttons at the end of a page of the gallery.
_END = ".. _sphx_glr_download_"


def kept_output(name):
    """Return the text of a page that shows the kept output of an example.

    Parameters
    ----------
    name : str
        Name of the example without suffix.
    """
    return f"""
.. rubric:: Output

This page shows the output of a run on the recordings. The build of this site does not
run the example.

.. image:: /images/gallery/{name}.png
   :alt: Figure that the example draws
   :class: sphx-glr-single-img

.. literalinclude:: /images/gallery/{name}.txt
   :language: none

"""


def _add_output(app, docname, source):
    name = PurePosixPath(docname).name
    if not (docname.startswith("gallery/") and (KEPT / f"{name}.png").exists()):
        return
    before, mark, after = source[0].partition(_END)
    source[0] = before + kept_output(name) + mark + after


def setup(app):
    """Add the outputs when a page is read."""
    app.connect("source-read", _add_output)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
