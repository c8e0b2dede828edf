"""A CityGML of a few box houses, written anew for each test."""

import citygml_text as text

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/2.0" xmlns:bldg="http://www.opengis.net/citygml/building/2.0"
 xmlns:gml="http://www.opengis.net/gml">
<gml:boundedBy><gml:Envelope srsName="urn:ogc:def:crs:EPSG::25833" srsDimension="3"><gml:lowerCorner>390000 5818000 30
</gml:lowerCorner><gml:upperCorner>390100 5818100 60</gml:upperCorner></gml:Envelope></gml:boundedBy>
"""
# Options of a quick run.
FAST = [
    "--suns",
    "typical-days:1",
    "--samples",
    "16",
    "--shadow-samples",
    "4",
    "--max-bounces",
    "1",
    "--quiet",
]
TABLES = {
    "faces.csv",
    "groups.csv",
    "buildings.csv",
    "uses.csv",  # the file tells what house a is used for
    "timeseries.nc",
    "surfaces.nc",
    "transfer.nc",
    "summary.json",
}
EAST, NORTH, UP = 390_000.0, 5_818_000.0, 30.0


def surface(kind, name, points):
    placed = [(f"{EAST + x:.3f}", f"{NORTH + y:.3f}", f"{UP + z:.3f}") for x, y, z in points]
    return text.surface(text.members(text.polygon(name, placed)), kind)


def house(name, low, size, ridge=4.0, told=""):
    """A house with a gable roof whose ridge runs east: north and south roofs; `told` is XML."""
    x0, y0 = low
    x1, y1, z = x0 + size[0], y0 + size[1], size[2]
    middle, top = (y0 + y1) / 2, z + ridge
    walls = {
        "south": [(x0, y0, 0), (x1, y0, 0), (x1, y0, z), (x0, y0, z)],
        "east": [(x1, y0, 0), (x1, y1, 0), (x1, y1, z), (x1, middle, top), (x1, y0, z)],
        "north": [(x1, y1, 0), (x0, y1, 0), (x0, y1, z), (x1, y1, z)],
        "west": [(x0, y1, 0), (x0, y0, 0), (x0, y0, z), (x0, middle, top), (x0, y1, z)],
    }
    parts = [
        surface(
            "GroundSurface", f"{name}_ground", [(x0, y0, 0), (x0, y1, 0), (x1, y1, 0), (x1, y0, 0)]
        )
    ]
    parts += [surface("WallSurface", f"{name}_{side}", points) for side, points in walls.items()]
    south = [(x0, y0, z), (x1, y0, z), (x1, middle, top), (x0, middle, top)]
    north = [(x1, y1, z), (x0, y1, z), (x0, middle, top), (x1, middle, top)]
    parts.append(surface("RoofSurface", f"{name}_roof_south", south))
    parts.append(surface("RoofSurface", f"{name}_roof_north", north))
    return text.building(told, *parts, name=name)


# what the file tells of house a: attributes and an address
TOLD = """<gml:name>Old mill</gml:name>
<bldg:function codeSpace="http://www.sig3d.org/codelists/citygml/2.0">1120</bldg:function>
<bldg:yearOfConstruction>1904</bldg:yearOfConstruction>
<bldg:address><Address><xalAddress><xAL:AddressDetails xmlns:xAL="urn:xal2"><xAL:Country>
<xAL:Locality Type="Town"><xAL:LocalityName>Halle</xAL:LocalityName><xAL:Thoroughfare Type="Street">
<xAL:ThoroughfareNumber>12</xAL:ThoroughfareNumber><xAL:ThoroughfareName>Große Straße
</xAL:ThoroughfareName></xAL:Thoroughfare></xAL:Locality></xAL:Country></xAL:AddressDetails>
</xalAddress></Address></bldg:address>
"""
HOUSES = (
    house("a", (0, 0), (12, 10, 8), told=TOLD)
    + house("b", (20, -3), (10, 14, 14))
    + house("c", (2, 24), (14, 9, 6))
)


def write_gml(path, *members, head=HEAD):
    """A CityGML of some members; returns the path."""
    path.write_text(f"{head}{''.join(members)}</CityModel>\n", encoding="utf-8")
    return path


def write_small_city(path):
    """Three houses; returns the path."""
    return write_gml(path, HOUSES)
