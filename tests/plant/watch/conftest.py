from tests.plant.commands.conftest import (  # noqa: F401
    fitted,
    inputs,
    models,
    piped,
    run,
    watch,
)
