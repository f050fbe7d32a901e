"""Markdown of the repository, as the site needs it.

In the repository pages link to each other by relative path. On the site an example is a
page of the gallery, and the pages of `PAGES`, which lie outside this folder, are copied
into ``project/``; the links follow.
"""

import os
import re
from pathlib import Path, PurePosixPath

DOCS = Path(__file__).parent
ROOT = DOCS.parent
PAGES = {
    "benchmarks/README.md": "project/benchmarks.md",
    "CONTRIBUTING.md": "project/contributing.md",
    "CHANGELOG.md": "project/changelog.md",
    "SECURITY.md": "project/security.md",
}
_LINK = re.compile(r"\]\((?!\w+:|#)([^)#\s]+)(#[^)\s]*)?\)")


def _on_site(path):
    """Return where the site has a file or folder of the repository, as a path within docs."""
    if path == "README.md":
        return "index.md"
    if path == "examples":
        return "gallery/index.rst"
    if path.startswith("examples/") and path.endswith(".py"):
        return (
            f"gallery/{PurePosixPath(path).relative_to('examples').with_suffix('.rst')}"
        )
    return PAGES.get(path) or os.path.relpath(path, "docs")


def relink(text, source, page):
    """Text of the repository's file `source` with its links as `page` of the site needs them."""

    def replaced(match):
        path = os.path.normpath(os.path.join(os.path.dirname(source), match[1]))
        target = os.path.relpath(_on_site(path), os.path.dirname(page) or ".")
        return f"]({target}{match[2] or ''})"

    return _LINK.sub(replaced, text)


def _copy_pages(app):
    for source, page in PAGES.items():
        text = relink((ROOT / source).read_text("utf-8"), source, page)
        target = DOCS / page
        target.parent.mkdir(exist_ok=True)
        if not target.exists() or target.read_text("utf-8") != text:
            target.write_text(text, "utf-8")


def _relink_page(app, docname, source):
    page = f"{docname}.md"
    if page not in PAGES.values() and (DOCS / page).exists():
        source[0] = relink(source[0], f"docs/{page}", page)
    # Doctest needs the empty line at the end of a block, a reader does not.
    source[0] = source[0].replace("\n\n```\n", "\n```\n")


def _relink_included(app, path, docname, content):
    if str(path).startswith(".."):
        source = os.path.normpath(os.path.join("docs", path))
        content[0] = relink(content[0], source, f"{docname}.md")


def setup(app):
    """Copy before pages are read, and relink while they are."""
    app.connect("builder-inited", _copy_pages)
    app.connect("source-read", _relink_page)
    app.connect("include-read", _relink_included)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
