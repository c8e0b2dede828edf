"""Three houses of a street as CityGML: what most tests of the add-on show."""

from small_city import house


def describe_house(name, low, size=(10, 8, 6)):
    """A house with a gable roof: 7 surfaces; the ridge runs from west to east."""
    return house(name, low, size, ridge=3)


STREET = [
    describe_house(f"house{number}", low) for number, low in enumerate(((0, 0), (14, 0), (2, 22)))
]
