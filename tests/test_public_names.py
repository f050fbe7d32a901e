import subprocess
import sys

import pytest

import skarxlag


def test_every_public_name_is_found_and_listed():
    for name in skarxlag.__all__:
        public = getattr(skarxlag, name)
        assert public.__name__ == name and public.__doc__
        assert name in dir(skarxlag)


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="has no attribute 'make_coffee'"):
        skarxlag.make_coffee  # noqa: B018
    with pytest.raises(ImportError, match="make_coffee"):
        exec("from skarxlag import make_coffee")


@pytest.mark.parametrize("argument", ["--version", "--help"])
def test_version_and_help_import_nothing_large(argument):
    code = (
        "import sys, contextlib, skarxlag.commands\n"
        "with contextlib.suppress(SystemExit):\n"
        f"    skarxlag.commands.main([{argument!r}])\n"
        "large = {'numba', 'numpy', 'scipy', 'sklearn', 'pandas', 'joblib'} & set(sys.modules)\n"
        "assert not large, large\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.DEVNULL)
