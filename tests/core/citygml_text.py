"""CityGML written by hand, for what no real file at hand shows."""

HEAD = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<CityModel xmlns="http://www.opengis.net/citygml/2.0" '
    'xmlns:gml="http://www.opengis.net/gml" '
    'xmlns:bldg="http://www.opengis.net/citygml/building/2.0" '
    'xmlns:xlink="http://www.w3.org/1999/xlink">\n'
)
SQUARE = [(0, 0, 0), (4, 0, 0), (4, 0, 3), (0, 0, 3)]


def ring(points, closed=True):
    points = [*points, points[0]] if closed else points
    numbers = " ".join(f"{value}" for point in points for value in point)
    return f"<gml:LinearRing><gml:posList>{numbers}</gml:posList></gml:LinearRing>"


def polygon(name, points, *holes, closed=True):
    identifier = f' gml:id="{name}"' if name else ""
    inside = wrap(ring(points, closed), "gml:exterior") + "".join(
        wrap(ring(hole), "gml:interior") for hole in holes
    )
    return f"<gml:Polygon{identifier}>{inside}</gml:Polygon>"


def members(*inside):
    return "".join(f"<gml:surfaceMember>{text}</gml:surfaceMember>" for text in inside)


def links(*names):
    return "".join(f'<gml:surfaceMember xlink:href="#{name}"/>' for name in names)


def wrap(inside, *tags):
    """Elements around a text, the outermost first."""
    for tag in reversed(tags):
        inside = f"<{tag}>{inside}</{tag}>"
    return inside


def surface(inside, kind="WallSurface", lod=2):
    return wrap(
        inside, "bldg:boundedBy", f"bldg:{kind}", f"bldg:lod{lod}MultiSurface", "gml:MultiSurface"
    )


def solid(inside, lod=2):
    return wrap(inside, f"bldg:lod{lod}Solid", "gml:Solid", "gml:exterior", "gml:CompositeSurface")


def building(*inside, name="house"):
    identifier = f' gml:id="{name}"' if name else ""
    return f"<cityObjectMember><bldg:Building{identifier}>{''.join(inside)}</bldg:Building></cityObjectMember>\n"


def model(*buildings):
    return HEAD + "".join(buildings) + "</CityModel>\n"
