"""Let xlinks find their polygons, so that a polygon named by several elements is there once."""

MISSING = "reference to a polygon that the file does not hold"


def resolve_references(content):
    """Give every polygon what its references say about it: thematic class, further LoDs, orientation.

    A Solid that names the polygons of its boundary surfaces adds nothing; a boundary surface that names polygons of
    a Solid gives them its class. Polygons named by another building stay with the building that draws them.

    Parameters
    ----------
    content : FileContent
        Changed in place.
    """
    index = {polygon.surface_id: polygon for polygon in reversed(content.polygons) if polygon.surface_id}
    for reference in content.references:
        if reference.target in index:
            targets = [index[reference.target]]
        elif reference.target in content.groups:
            first, last = content.groups[reference.target]
            targets = content.polygons[first:last]
        else:
            content.skip(MISSING, reference.target)
            continue
        for polygon in targets:
            _apply(reference, polygon)


def _apply(reference, polygon):
    if polygon.building != reference.building:
        return
    if reference.thematic and not polygon.thematic:
        polygon.thematic, polygon.source = reference.thematic, "surface"
    if reference.flipped and reference.source == "solid" and reference.part in (0, polygon.part):
        polygon.flipped = True  # the solid says that its outside is the other side; a neighbour's solid has no say
    if reference.lod not in polygon.lods():
        polygon.more_lods = (*polygon.more_lods, reference.lod)
