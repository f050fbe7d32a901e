import pytest

from tests.plant.commands.conftest import (  # noqa: F401
    fitted,
    inputs,
    models,
    piped,
    run,
    watch,
)
from tests.plant.watch.watching import save_model


@pytest.fixture(scope="session")
def model(fitted, tmp_path_factory):  # noqa: F811
    """A file of the diagnoser, with healthy limits that take the level, too."""
    path = tmp_path_factory.mktemp("models") / "m.skops"
    save_model(fitted[0], path, 2)
    return path
