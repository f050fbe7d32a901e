import sys

import pytest

from benchmarks.monitoring import soak

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.mark.slow
def test_memory_and_descriptors_stay_flat(tmp_path, capsys):
    page = tmp_path / "page.md"
    page.write_text("x\n<!-- soak: begin -->\n<!-- soak: end -->\n", encoding="utf-8")
    soak.main(["--windows", "800", "--write", str(page)])
    assert capsys.readouterr().out.strip() in page.read_text("utf-8")
    table = soak.soak(8000, n_steps=4)
    assert table["windows"].tolist() == [0, 2000, 4000, 6000, 8000]
    assert table["descriptors"].nunique() == 1
    # A verdict that is kept takes more than 100 bytes, so 6000 of them would show.
    assert table["MiB"].iloc[-1] - table["MiB"].iloc[1] <= 2
    assert (table["us a window"].iloc[1:] > 0).all()
