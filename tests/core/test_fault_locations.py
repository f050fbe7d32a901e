import pytest

from skarxlag.core.fault_locations import location_of_label


@pytest.mark.parametrize(
    ("label", "location"),
    [
        ("BPFO 3", "outer"),
        ("inner_race", "inner"),
        ("Roller", "ball"),
        ("baseline", "healthy"),
        ("outer race and ball", None),
        ("IR-OR", None),
        ("OR-IR", None),
        ("IR7_OR7", None),
    ],
)
def test_location_follows_from_the_name_unless_it_states_several(label, location):
    assert location_of_label(label) == location
