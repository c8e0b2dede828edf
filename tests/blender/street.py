"""Three houses of a street as CityGML: what most tests of the add-on show."""

from small_city import TOLD, house


def describe_house(name, low, size=(10, 8, 6), told=""):
    """A house with a gable roof: 7 surfaces; the ridge runs from west to east."""
    return house(name, low, size, ridge=3, told=told)


STREET = [
    describe_house("house0", (0, 0)),
    describe_house("house1", (14, 0), told=TOLD),
    describe_house("house2", (2, 22)),
]
