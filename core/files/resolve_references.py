"""Resolve xlinks, so that a polygon referenced by several elements exists once."""

MISSING = "reference to a polygon that is not in the file"


def resolve_references(content):
    """Apply references to their polygons: thematic class, further LoDs, orientation.

    A Solid that references the polygons of its boundary surfaces adds nothing; a boundary surface that references
    polygons of a Solid gives them its class. Polygons referenced by another building stay with the building that
    defines them.

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
        polygon.flipped = True  # the solid defines its outside; a neighbour's solid does not
    if reference.lod not in polygon.lods():
        polygon.more_lods = (*polygon.more_lods, reference.lod)
