"""Cells of large polygons are called after the polygon that they were cut from."""


def whole_of_cell(name):
    """Id of the polygon that a cell ``id#k`` was cut from; else the name itself."""
    whole, mark, cell = name.rpartition("#")
    return whole if mark and cell.isdigit() else name
