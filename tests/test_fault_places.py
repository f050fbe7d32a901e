from skarxlag.fault_places import least_margin, place_of_label


def test_names_of_labels():
    names = {"BPFO 3": "outer", "inner_race": "inner", "Roller": "ball", "baseline": "healthy"}
    assert {name: place_of_label(name) for name in names} == names
    assert place_of_label("outer race and ball") is None


def test_a_smaller_share_of_wrong_names_needs_a_larger_margin():
    assert least_margin(1e-5) > least_margin(0.02) > least_margin(0.3) >= 0
