"""How racks are called: after the roof that they stand on."""

RACK = "rack"  # the kind
MARK = "/rack"


def name_rack(roof, number):
    """Id of a roof's rack, counted from 1."""
    return f"{roof}{MARK}{number}"


def roof_of_rack(name):
    """Id of the roof that a rack stands on, as it was before it was cut into cells."""
    return name.rpartition(MARK)[0]
