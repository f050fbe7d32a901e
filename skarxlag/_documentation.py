"""Links from the HTML representation of estimators to their pages on the site."""

from typing import ClassVar

#: Where the workflow of the documentation publishes the site.
SITE = "https://skarxlag.github.io/skarxlag/"


class DocumentedEstimator:
    """Names the page of an estimator to scikit-learn, which links to it in notebooks."""

    _doc_link_module: ClassVar = __name__.partition(".")[0]
    _doc_link_template: ClassVar = SITE + "api/generated/skarxlag.{estimator_name}.html"
