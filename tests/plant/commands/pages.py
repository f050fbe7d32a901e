"""Helpers that the tests of pages share."""

import re
from base64 import b64decode
from html.parser import HTMLParser


class Document(HTMLParser):
    """Text of a page and what it loads. Elements that are not closed are an error."""

    def __init__(self, content):
        super().__init__()
        self.texts, self.loads, self.open = [], [], []
        self.feed(content)
        assert not self.open
        self.text = " ".join(" ".join(self.texts).split())

    def handle_starttag(self, tag, attributes):
        self.loads += [value for name, value in attributes if name in ("src", "href")]
        self.texts += [value for name, value in attributes if name == "alt"]
        if tag not in ("meta", "br", "img"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        pass

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.texts.append(data)


def text_of(page):
    return Document(page).text


def captions(page):
    return re.findall("<figcaption>(.*?)</figcaption>", page)


def pictures(page):
    """The SVG of each picture, by its caption."""
    sources = re.findall('src="data:image/svg\\+xml;base64,([^"]*)"', page)
    texts = [b64decode(source).decode() for source in sources]
    return dict(zip(captions(page), texts, strict=True))
